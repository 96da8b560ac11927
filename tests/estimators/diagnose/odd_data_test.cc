// Data that are no tidy campaign: one log, one record that shows it all, values that only look like heat, an
// inverter's command for a voltage, a fast supply.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "estimators/diagnose/compare.h"
#include "estimators/diagnose/diagnose.h"
#include "estimators/diagnose/missing/parts.h"
#include "estimators/diagnose/missing/search_step.h"
#include "estimators/diagnose/missing/trial.h"
#include "estimators/fit/global/driven_record.h"
#include "estimators/fit/global/settle.h"
#include "estimators/model/effects/registry.h"
#include "rig/base/space_vector.h"
#include "tests/estimators/diagnose/flawed_grid.h"
#include "tests/estimators/diagnose/known_motor.h"

namespace imrig::est {
namespace {

const synthetic::Motor& motor() { return synthetic::motors()[1]; }

bool says(const Diagnosis& d, const std::string& words) {
  return std::any_of(d.explanation.begin(), d.explanation.end(),
                     [&](const std::string& line) { return line.find(words) != std::string::npos; });
}

std::string words(const Diagnosis& d) {
  return d.verdict + "\n" + fmt::format("{}", fmt::join(d.explanation, "\n"));
}

std::size_t samples_of(const DataSet& data) {
  std::size_t n = 0;
  for (const Record& r : data.records) n += r.series.size();
  return n;
}

TEST(Parts, OneLogBecomesManyRecordsWithoutALostSample) {
  DataSet data = grid(motor(), 1);
  data.records.resize(1);
  data.records[0].id = "log";
  data.records[0].series =
      synthetic::record(motor(), synthetic::step_case(motor(), 0.8, 1.0, 0.03, 200e-6, 25000));
  std::vector<std::string> cut;
  const DataSet parts = in_parts(data, cut);
  EXPECT_EQ(cut, std::vector<std::string>{"log"});
  EXPECT_EQ(parts.records.size(), 16u);
  EXPECT_EQ(samples_of(parts), samples_of(data));
  EXPECT_EQ(parts.records[1].series.i.front(), data.records[0].series.i[parts.records[0].series.size()]);
  EXPECT_EQ(parts.records[1].series.first_index, static_cast<std::int64_t>(parts.records[0].series.size()));
  EXPECT_EQ(parts.records[1].id, "log from 0.312 s");
}

TEST(Parts, ACampaignOfManyShortRecordsStaysAsItIs) {
  const DataSet data = grid(motor(), 1);
  std::vector<std::string> cut;
  EXPECT_EQ(in_parts(data, cut).records.size(), data.records.size());
  EXPECT_TRUE(cut.empty());
}

TEST(Parts, OneLongRecordAmongManyIsCut) {
  DataSet data = grid(motor(), 1);
  data.records[4].series =
      synthetic::record(motor(), synthetic::step_case(motor(), 0.8, 1.0, 0.03, 200e-6, 10000));
  std::vector<std::string> cut;
  const DataSet parts = in_parts(data, cut);
  EXPECT_EQ(cut, std::vector<std::string>{data.records[4].id});
  EXPECT_EQ(parts.records.size(), data.records.size() + 3);
}

TEST(OddData, AFlawInOneLogIsNamedAndMeasured) {
  DataSet data = grid(motor(), 1);
  data.records.resize(1);
  TimeSeries& log = data.records[0].series;
  synthetic::Case braked = synthetic::step_case(motor(), 0.8, 1.0, 0.0, 200e-6, 15000);
  const double synchronous = 2.0 * kPi * braked.f_Hz / motor().pole_pairs;
  braked.fine = 10;
  braked.speed_rad_s = [synchronous](double t_s) { return synchronous * (1.0 - 0.1 * t_s); };
  log = synthetic::record(motor(), braked);
  for (auto& i : log.i) i += 0.01 * std::conj(i);
  synthetic::add_noise(log, data.noise.current_A, data.noise.voltage_V, data.noise.speed_rad_s, 5);
  const Diagnosis d = diagnose(model_of(motor()), data);
  ASSERT_EQ(d.effect, "current_gain") << words(d);
  EXPECT_TRUE(says(d, "was cut into parts"));
  EXPECT_TRUE(std::isfinite(d.candidates.front().estimate.at("phase_a").ci95_low));
}

Trial fit_of(double chi2_per_value) {
  constexpr std::size_t kValues = 10000;
  Trial t;
  t.chi2 = chi2_per_value * kValues;
  t.model.fit.values = kValues;
  t.model.fit.dof = kValues;
  return t;
}

// One start may hold nearly all of the misfit, and then no other record asks for the effect.
TEST(OddData, AnEffectThatTakesMostOfALargeMisfitNeedsNoSecondRecord) {
  EXPECT_TRUE(explains_most(fit_of(1.5), fit_of(50.0)));
  EXPECT_TRUE(explains_most(fit_of(1.0), fit_of(1.6)));
  EXPECT_FALSE(explains_most(fit_of(30.0), fit_of(50.0))) << "less than half of it";
  EXPECT_FALSE(explains_most(fit_of(1.0), fit_of(1.2))) << "noise is not known that well";
}

TEST(OddData, ValuesThatFollowSlipAreNoHeat) {
  const double slips[] = {0.1, 0.5, 1.0};
  const DataSet data = grid(motor(), 7, {}, [&](std::size_t n) {
    synthetic::Motor m = motor();
    m.R_r *= 1.0 + 0.3 * slips[n % 3];
    return m;
  });
  DiagnoseOptions options;
  options.without = {"rotor_skin_effect"};
  const Model model = model_of(motor());
  const Improvement found = improve(model, data, options);
  const Diagnosis& d = found.diagnosis;
  EXPECT_EQ(d.verdict, "unknown") << d.effect;
  EXPECT_TRUE(says(d, "heat does not"));
  // What was tried explains nothing, and is not handed on.
  EXPECT_TRUE(found.model.effects.empty());
  EXPECT_EQ(found.model.R_r.value, model.R_r.value);
  EXPECT_EQ(found.model.history.size(), model.history.size());
}

// A winding that is warm in some records makes slow errors, a few among thousands of white values.
TEST(OddData, ASlowErrorThatStaysIsNotCalledExplained) {
  const DataSet data = grid(motor(), 7, {}, [&](std::size_t n) {
    synthetic::Motor m = motor();
    m.R_s *= 1.0 + 0.15 * static_cast<double>((n * 7) % 18) / 18.0;
    return m;
  });
  const Diagnosis whole = diagnose(model_of(motor()), data);
  EXPECT_EQ(whole.effect, "stator_heating") << words(whole);
  EXPECT_TRUE(whole.search.at_floor);
  DiagnoseOptions options;
  options.without = {"stator_heating"};
  const Diagnosis d = diagnose(model_of(motor()), data, options);
  EXPECT_FALSE(d.search.at_floor);
  EXPECT_EQ(d.verdict, "unknown") << d.effect;
}

// Dead time with the hardest of signs, where the command stands for the voltage.
TEST(OddData, AHardDeadTimeIsNamedWithItsDrop) {
  constexpr double kDrop_V = 5.0;
  DataSet data = grid(motor(), 7, [](Record& r) {
    for (std::size_t k = 0; k < r.series.v.size(); ++k) {
      const auto i = phases(r.series.i[k]);
      const auto lost = [](double x) { return kDrop_V * (x > 0.0 ? 1.0 : x < 0.0 ? -1.0 : 0.0); };
      r.series.v[k] += space_vector(lost(i[0]), lost(i[1]), lost(i[2]));
    }
  });
  const Diagnosis d = diagnose(model_of(motor()), data);
  EXPECT_EQ(d.effect, "inverter_dead_time") << words(d);
  EXPECT_NEAR(d.candidates.front().estimate.at("drop_V").value, kDrop_V, 0.05 * kDrop_V);
}

TEST(OddData, SamplesOfAFastSupplyAreAveragedOverLess) {
  synthetic::Motor fast = motor();
  fast.f_Hz = 400.0, fast.L_ls /= 8.0, fast.L_lr /= 8.0, fast.L_m /= 8.0;
  const TimeSeries series = synthetic::record(fast, synthetic::step_case(fast, 0.8, 1.0, 0.03, 20e-6, 20000));
  const DrivenRecord record = driven_record(series, fast.pole_pairs);
  EXPECT_GT(record.thinned, 1);
  EXPECT_LE(std::abs(record.frame.w_k) * record.frame.sample_time_s, kThinnedTurn * 1.001);
}

// As a display shows it: whole turns a minute, of a speed that hardly moves; it may sway once in a record.
void round_speeds(DataSet& data, double sway_rad_s = 0.0) {
  constexpr double kRpm = 2.0 * kPi / 60.0;
  std::mt19937_64 random(9);
  std::normal_distribution<double> normal(0.0, 0.1 * kRpm);
  for (Record& r : data.records) {
    auto& w = r.series.speed_rad_s;
    const double mean = std::accumulate(w.begin(), w.end(), 0.0) / static_cast<double>(w.size());
    for (std::size_t k = 0; k < w.size(); ++k) {
      const double turn = 2.0 * kPi * static_cast<double>(k) / static_cast<double>(w.size());
      w[k] = std::round((mean + sway_rad_s * std::sin(turn) + normal(random)) / kRpm) * kRpm;
    }
  }
  data.noise.speed_rad_s = 0.1 * kRpm;
}

TEST(OddData, ASpeedThatWasRoundedIsNoHeat) {
  DataSet data = grid(motor(), 7, {}, {}, 2e-4);
  round_speeds(data);
  const Diagnosis d = diagnose(model_of(motor()), data);
  EXPECT_EQ(d.verdict, "adequate") << words(d);
  EXPECT_TRUE(says(d, "steps of 1 rpm")) << words(d);
  // Where it is not seen that they were, it is.
  for (Record& r : data.records) {
    for (std::size_t k = 0; k < r.series.size(); k += 20) r.series.speed_rad_s[k] += 0.03;
  }
  const Diagnosis unseen = diagnose(model_of(motor()), data);
  EXPECT_NE(unseen.verdict, "adequate") << words(unseen);
}

// Rounding is no failure of the model: a comparison, too, lets each record have its half step.
TEST(OddData, ARoundedSpeedLeavesTheRightModelAtTheFloorOfAComparison) {
  DataSet data = grid(motor(), 7, {}, {}, 2e-4);
  const CompareResult plain = compare(model_of(motor()), data);
  round_speeds(data);
  const CompareResult rounded = compare(model_of(motor()), data);
  EXPECT_LT(rounded.fitted.chi2_per_dof, 1.05 * plain.fitted.chi2_per_dof);
  // Off the grid nothing is known to be rounded.
  for (Record& r : data.records) {
    for (std::size_t k = 0; k < r.series.size(); k += 20) r.series.speed_rad_s[k] += 0.03;
  }
  EXPECT_GT(compare(model_of(motor()), data).fitted.chi2_per_dof, 1.5 * plain.fitted.chi2_per_dof);
}

// A display that sways by a sixth of a step where the shaft does not: more than a constant of each record.
TEST(OddData, ASmallErrorBesideASpeedThatWasRoundedCannotBeTold) {
  DataSet data = grid(motor(), 7, {}, {}, 1.5e-3);
  round_speeds(data, 0.175 * 2.0 * kPi / 60.0);
  const Diagnosis d = diagnose(model_of(motor()), data);
  EXPECT_EQ(d.verdict, "cannot_tell") << words(d);
  EXPECT_TRUE(d.rounding_in_doubt);
  EXPECT_TRUE(says(d, "the small error that is left among it")) << words(d);
}

TEST(OddData, HeatIsFoundBesideASpeedThatWasRounded) {
  DataSet data = grid(motor(), 7, {}, [&](std::size_t n) {
    synthetic::Motor m = motor();
    m.R_r *= 1.0 + 0.2 * static_cast<double>((n * 7) % 18) / 18.0;
    return m;
  });
  round_speeds(data);
  const Diagnosis d = diagnose(model_of(motor()), data);
  ASSERT_EQ(d.effect, "rotor_heating") << words(d);
  // Of the records that are fitted, 0 to 17 eighteenths of 20 %; half a step is 1 % of a slip.
  const auto& estimate = d.candidates.front().estimate;
  const double low = estimate.at("warmth_lowest").value, high = estimate.at("warmth_highest").value;
  EXPECT_NEAR((1.0 + high) / (1.0 + low), 1.0 + 0.2 * 17.0 / 18.0, 0.02);
  EXPECT_TRUE(says(d, "above that of the coldest: about 4")) << words(d);
}

// Nothing but a wide prior tells it from another R_r.
TEST(OddData, HeatThatAllRecordsShareIsNone) {
  const DataSet data = grid(motor(), 7);
  const Model model = model_of(motor());
  const GlobalProblem problem(data, model.machine(), 2);
  WorkingModel warm = working_model(problem, model);
  warm.active = {{*effect_number("rotor_heating"), 0}};
  while (!kEffectInfos[warm.active[0].effect].forms[warm.active[0].form].local) ++warm.active[0].form;
  const std::size_t warmth = kLocalPlace[warm.active[0].effect];
  warm.at.shared[1] *= 1.25;
  for (LocalVector<double>& local : warm.at.local) local[warmth] = -0.2;
  const Trial trial = refit(problem, warm, problem.fitted());
  EXPECT_TRUE(trial.sound) << trial.unsound;
  EXPECT_LT(trial.size, 0.3) << "of what matters";
  EXPECT_NEAR(trial.model.at.shared[1], model.R_r.value, 2e-3 * model.R_r.value);
}

TEST(OddData, WithoutNoiseAreJudgedAsFarAsModelsGo) {
  const auto noiseless = [](const MotorOf& motor_of) {
    DataSet data = grid(motor(), 7, {}, motor_of);
    std::size_t n = 0;
    for (const double f : {0.4, 0.7, 1.0}) {
      for (const double flux : {0.5, 0.9}) {
        for (const double slip : {0.1, 0.5, 1.0}) {
          const synthetic::Motor m = motor_of ? motor_of(n) : motor();
          data.records[n++].series =
              synthetic::record(m, synthetic::step_case(m, flux * f, f, slip * m.slip / f, 200e-6, 1500));
        }
      }
    }
    data.noise = {};
    return data;
  };
  const Diagnosis d = diagnose(model_of(motor()), noiseless({}));
  EXPECT_EQ(d.verdict, "adequate") << words(d);
  const Diagnosis warm = diagnose(model_of(motor()), noiseless([](std::size_t n) {
                                    synthetic::Motor m = motor();
                                    m.R_r *= 1.0 + 0.1 * static_cast<double>((n * 7) % 18) / 18.0;
                                    return m;
                                  }));
  EXPECT_EQ(warm.effect, "rotor_heating") << words(warm);
}

// A step too long for it swings, and the swing holds a wrong flux for a whole record.
TEST(OddData, AnInvertersHardSwitchingIsSimulatedFinely) {
  const DataSet data = grid(motor(), 7);
  const Model model = model_of(motor());
  SharedVector<double> shared = shared_vector(model);
  const std::size_t place = kSharedPlace[*effect_number("inverter_dead_time")];
  shared[place] = 0.1 * motor().v_peak_V, shared[place + 1] = 1e-3 * motor().v_peak_V / motor().R_s;
  shared[place + 2] = 12.0, shared[place + 3] = 1.0;
  const DrivenRecord record = driven_record(data.records[0].series, data.pole_pairs, 0.0);
  const Whitener plain(record, model.machine(), 0.0, {1.0, 0.0, 0.0});
  const int steps = steps_for(record, shared);
  LocalVector<double> local = neutral_local();
  settle_record(record, plain, 4 * steps, shared, {0, 1, 2, 3}, local);
  RecordTrace coarse, fine;
  record_terms(record, plain, steps, shared, local, {}, &coarse);
  record_terms(record, plain, 4 * steps, shared, local, {}, &fine);
  double off = 0.0, all = 0.0;
  for (std::size_t k = 0; k < fine.error.size(); ++k)
    off += std::norm(coarse.error[k] - fine.error[k]), all += std::norm(record.frame.i[k]);
  EXPECT_LT(std::sqrt(off / all), 5e-3) << steps;
  EXPECT_GT(steps, 1);
}

// A rounded speed makes R_r warm, never R_s.
TEST(OddData, AWarmStatorIsFoundBesideASpeedThatWasRounded) {
  const MotorOf warm = [](std::size_t n) {
    synthetic::Motor m = motor();
    m.R_s *= 1.0 + 0.15 * static_cast<double>((n * 7) % 18) / 18.0;
    return m;
  };
  DataSet data = grid(motor(), 7, {}, warm);
  round_speeds(data);
  const Diagnosis d = diagnose(model_of(motor()), data);
  EXPECT_EQ(d.effect, "stator_heating") << words(d);
}

// R_s of a DC test is no guide to a warm winding: a drop of the inverter that takes its place goes again.
TEST(OddData, AWarmStatorIsNoInvertersDrop) {
  const DataSet data = grid(motor(), 7, {}, [](std::size_t n) {
    synthetic::Motor m = motor();
    m.R_s *= 1.0 + 0.4 * static_cast<double>((n * 7) % 18) / 18.0;
    return m;
  });
  const Diagnosis d = diagnose(model_of(motor()), data);
  ASSERT_EQ(d.effect, "stator_heating") << words(d);
  EXPECT_EQ(d.search.final.model.active.size(), 1u) << words(d);
  const auto& estimate = d.candidates.front().estimate;
  const double low = estimate.at("warmth_lowest").value, high = estimate.at("warmth_highest").value;
  EXPECT_NEAR((1.0 + high) / (1.0 + low), 1.0 + 0.4 * 17.0 / 18.0, 0.02);
}

// Steady points of a motor without friction and a torque sensor 0.8 Nm off.
DataSet points_with_offset(const std::vector<double>& directions) {
  const test::KnownMotor known;
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0.0, 1.0);
  std::vector<SteadyPoint> points;
  for (const double direction : directions) {
    for (const double f_Hz : {30.0, 45.0, 60.0}) {
      for (const double slip : {0.005, 0.01, 0.02, 0.03, 0.04}) {
        SteadyPoint p = test::steady_point(known, f_Hz, slip, 3.0 * f_Hz);
        p.i_peak_A += 0.01 * noise(random);
        p.p_in_W += 1.0 * noise(random);
        p.f_Hz *= direction, p.speed_rad_s *= direction;
        p.torque_Nm = direction * p.torque_Nm - 0.8 + 0.05 * noise(random);
        p.p_out_W = kMissing;
        points.push_back(p);
      }
    }
  }
  DataSet data = test::table_set(std::move(points), 0.01);
  data.noise.power_W = 1.0;
  data.noise.torque_Nm = 0.05;
  return data;
}

TEST(OddData, ATorqueSensorThatIsOffIsDoubtedWhereTheShaftTurnsOneWay) {
  const Diagnosis d = diagnose(test::KnownMotor().model(), points_with_offset({1.0}));
  EXPECT_EQ(d.effect, "friction_windage") << words(d);
  EXPECT_TRUE(says(d, "an offset of the torque sensor would look the same")) << words(d);
}

TEST(OddData, ATorqueSensorThatIsOffIsNoFrictionWhereItTurnsBothWays) {
  const Diagnosis d = diagnose(test::KnownMotor().model(), points_with_offset({1.0, -1.0}));
  EXPECT_EQ(d.verdict, "unknown") << words(d);
}

}  // namespace
}  // namespace imrig::est
