// Where a model fails, on data whose flaw is known; and on data that have none.

#include "estimators/diagnose/failure_map.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "estimators/diagnose/compare.h"
#include "estimators/diagnose/condition_bins.h"
#include "estimators/diagnose/shuffle_test.h"
#include "tests/estimators/diagnose/known_motor.h"

namespace imrig::est {
namespace {

using test::KnownMotor;
using test::SteadyRun;

const MapCondition& named(const FailureMap& map, const std::string& name) {
  const auto found = std::find_if(map.conditions.begin(), map.conditions.end(),
                                  [&](const MapCondition& c) { return c.name == name; });
  EXPECT_NE(found, map.conditions.end()) << name;
  return *found;
}

// Records over slip and frequency; R_r of the motor that makes them may depend on the slip frequency.
DataSet grid(double R_r_per_Hz, unsigned seed) {
  std::vector<Record> records;
  for (const double f : {20.0, 35.0, 50.0}) {
    for (const double slip_Hz : {0.4, 0.8, 1.2, 1.6}) {
      KnownMotor motor;
      motor.R_r *= 1.0 + R_r_per_Hz * slip_Hz;
      SteadyRun run;
      run.f_Hz = f;
      run.v_V = 4.0 * f;
      run.slip = slip_Hz / f;
      run.samples = 3000;
      run.sigma_i = 0.05;
      run.seed = ++seed;
      records.push_back(test::steady_record(motor, fmt::format("f{}s{}", f, slip_Hz), run));
    }
  }
  // In no order: neither place nor time goes with a condition.
  std::shuffle(records.begin(), records.end(), std::mt19937_64(seed));
  DataSet data = test::data_set(records);
  data.noise.current_A = 0.05;
  return data;
}

TEST(ConditionBins, AreTheSettingsWhereThereAreFew) {
  EXPECT_EQ(condition_bins({50, 30, 50.01, 60, 30, 30, 60, 60, 50, 49.99, 60, 30}),
            (std::vector<int>{1, 0, 1, 2, 0, 0, 2, 2, 1, 1, 2, 0}));
}

TEST(ConditionBins, AreEqualPartsOfWhatIsSpread) {
  std::vector<double> values;
  for (int k = 0; k < 120; ++k) values.push_back(k);
  values.push_back(kMissing);
  const auto bins = condition_bins(values);
  for (int b = 0; b < 6; ++b) EXPECT_EQ(std::count(bins.begin(), bins.end(), b), 20) << b;
  EXPECT_EQ(bins.back(), kNoGroup);
}

TEST(ConditionBins, OfWhatHardlyVariesAreOne) {
  const auto bins = condition_bins({100.0, 100.5, 99.5, 101.0});
  EXPECT_EQ(*std::max_element(bins.begin(), bins.end()), 0);
  EXPECT_TRUE(condition_bins({}).empty());
}

TEST(ConditionBins, NoLonelyValueMakesABinOfItsOwn) {
  std::vector<double> values(40, 1.0);
  for (std::size_t k = 0; k < 20; ++k) values[k] = 2.0;
  values.push_back(9.0);
  const auto bins = condition_bins(values);
  EXPECT_EQ(bins.back(), bins.front());
}

// On data without any dependence a chance of 5 % must come out in about 5 % of the sets: 200 sets of 20
// units.
TEST(ShuffleTest, ClaimsNothingFromNothingAsOftenAsItSays) {
  int claims = 0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> draw;
    std::vector<std::vector<double>> figures(3, std::vector<double>(20));
    for (auto& figure : figures) {
      for (double& x : figure) x = draw(random);
    }
    std::vector<std::vector<int>> groups(5, std::vector<int>(20));
    for (std::size_t g = 0; g < 5; ++g) {
      for (std::size_t u = 0; u < 20; ++u) groups[g][u] = static_cast<int>(random() % (2 + g));
    }
    const auto found = shuffle_test(figures, groups, Shuffle::kFree, 1);
    claims += std::any_of(found.begin(), found.end(), [](const Dependence& d) { return d.p_value <= 0.05; });
  }
  fmt::print("{} of 200 sets without any dependence claimed one at 5 %\n", claims);
  EXPECT_LE(claims, 21) << "binomial(200, 0.05) exceeds 21 once in 1000";
  EXPECT_GE(claims, 2) << "nor may it be blind";
}

// Neighbours in a log are alike; shuffling them freely would find dependence on anything that drifts.
TEST(ShuffleTest, ShiftsInACircleAreNotFooledByDrift) {
  int free = 0, circle = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> draw;
    std::vector<double> figure(100), other(100);
    double a = 0.0, b = 0.0;
    for (std::size_t u = 0; u < 100; ++u) {
      figure[u] = a = 0.9 * a + draw(random);
      other[u] = b = 0.9 * b + draw(random);
    }
    const std::vector<std::vector<int>> groups{condition_bins(other)};
    free += shuffle_test({figure}, groups, Shuffle::kFree, 1).front().p_value <= 0.05;
    circle += shuffle_test({figure}, groups, Shuffle::kCircle, 1).front().p_value <= 0.05;
  }
  fmt::print("two drifts that know nothing of each other: {} of 100 free, {} in a circle\n", free, circle);
  EXPECT_GT(free, 40);
  EXPECT_LE(circle, 15);
}

TEST(ShuffleTest, IgnoresUnitsWithoutTheCondition) {
  std::vector<double> figure;
  std::vector<int> group;
  for (int u = 0; u < 24; ++u) {
    figure.push_back(u % 2 == 0 ? 1.0 + 0.01 * u : 0.01 * u);
    group.push_back(u % 3 == 0 ? kNoGroup : u % 2);
  }
  const auto found = shuffle_test({figure}, {group}, Shuffle::kFree, 1);
  EXPECT_LT(found[0].p_value, 0.01);
  EXPECT_GT(found[0].share, 0.7);
}

TEST(FailureMap, FindsTheConditionThatTheFlawFollows) {
  const auto result = compare(KnownMotor().model(), grid(0.05, 1));
  ASSERT_EQ(result.maps.size(), 1u);
  const FailureMap& map = result.maps[0];
  EXPECT_EQ(map.records, 12u);
  EXPECT_EQ(map.shuffled, "records");
  EXPECT_EQ(named(map, "f_Hz").bins.size(), 3u);
  for (const MapBin& bin : named(map, "f_Hz").bins) EXPECT_EQ(bin.records, 4u);
  // Rotor resistance off by 2 to 8 %: the current's active part follows the load.
  const MapCondition& torque = named(map, "torque_Nm");
  EXPECT_LT(torque.p_value, 0.01);
  EXPECT_GT(torque.share, 0.5);
  EXPECT_GT(torque.bins.back().channels.at("current_A").chi2_per_dof,
            3.0 * torque.bins.front().channels.at("current_A").chi2_per_dof);
  EXPECT_GT(named(map, "f_Hz").p_value, 0.05);
  EXPECT_TRUE(named(map, "direction").bins.empty()) << "one direction only";
  EXPECT_TRUE(named(map, "stator_C").bins.empty()) << "nobody measured it";
}

TEST(FailureMap, OfTheRightModelDependsOnNothing) {
  int claims = 0;
  for (unsigned seed = 0; seed < 10; ++seed) {
    const auto result = compare(KnownMotor().model(), grid(0.0, 100 * seed));
    for (const auto& c : result.maps[0].conditions) {
      claims += c.p_value <= 0.01;
      for (const auto& bin : c.bins)
        EXPECT_NEAR(bin.channels.at("current_A").chi2_per_dof, 1.0, 0.15) << c.name;
    }
  }
  EXPECT_LE(claims, 1);
}

TEST(FailureMap, OfOneLongLogIsMadeOfItsStretches) {
  Record log = test::steady_record(KnownMotor(), "log", {.samples = 1, .sigma_i = 0.05});
  for (const double f : {20.0, 30.0, 40.0, 50.0}) {
    SteadyRun run;
    run.f_Hz = f;
    run.v_V = 4.0 * f;
    run.samples = 10000;
    run.sigma_i = 0.05;
    run.seed = static_cast<unsigned>(f);
    const Record part = test::steady_record(KnownMotor(), "part", run);
    log.series.v.insert(log.series.v.end(), part.series.v.begin(), part.series.v.end());
    log.series.i.insert(log.series.i.end(), part.series.i.begin(), part.series.i.end());
    log.series.speed_rad_s.insert(log.series.speed_rad_s.end(), part.series.speed_rad_s.begin(),
                                  part.series.speed_rad_s.end());
  }
  DataSet data = test::data_set({log});
  data.noise.current_A = 0.05;
  const auto result = compare(KnownMotor().model(), data);
  const FailureMap& map = result.maps.at(0);
  EXPECT_GT(map.stretches, 50u);
  EXPECT_EQ(map.shuffled, "stretches");
  EXPECT_EQ(named(map, "time_s").bins.size(), 6u);
  std::size_t stretches = 0;
  for (const MapBin& bin : named(map, "time_s").bins) stretches += bin.stretches;
  EXPECT_EQ(stretches, map.stretches);
}

TEST(FailureMap, OfATableIsMadeOfItsPoints) {
  KnownMotor cold;
  Record table;
  table.id = "table";
  table.kind = RecordKind::kPoints;
  for (int k = 1; k <= 12; ++k) {
    table.points.push_back(test::steady_point(cold, 50.0, 0.004 * k, 200.0));
    table.points.back().p_out_W -= 2.0 * k * k;  // a loss with the load, which no base model has
    table.points.back().torque_Nm = kMissing;
  }
  table.points[0].p_in_W = kMissing;  // an empty cell moves no other channel's error
  const auto result = compare(cold.model(), test::data_set({table}));
  const FailureMap& map = result.maps.at(0);
  EXPECT_EQ(map.from, "points");
  EXPECT_EQ(map.shuffled, "points");
  EXPECT_GT(named(map, "slip").bins.size(), 2u);
  EXPECT_LT(named(map, "slip").p_value, 0.05);
  EXPECT_EQ(named(map, "slip").part, "sign");
  EXPECT_EQ(named(map, "slip").channel, "output_power_W");
  const auto& bins = named(map, "slip").bins;
  EXPECT_GT(bins.back().channels.at("output_power_W").nrmse,
            2.0 * bins.front().channels.at("output_power_W").nrmse);
}

// Conditions, channels and signed errors missing here and there, records empty or few.
TEST(FailureMap, TakesWhateverIsMissing) {
  std::mt19937_64 random(1);
  const auto number = [&] {
    return random() % 5 == 0 ? kMissing : static_cast<double>(random() % 1000) / 500.0 - 1.0;
  };
  for (int round = 0; round < 100; ++round) {
    std::vector<std::vector<Stretch>> records(random() % 12);
    std::vector<const std::vector<Stretch>*> all;
    for (auto& record : records) {
      record.resize(random() % 6);
      for (Stretch& s : record) {
        s.conditions = {number(), number(), number(), number(), number(), number(), number(), number()};
        s.time_s = number();
        if (random() % 4 == 0) continue;
        ChannelResult c;
        c.dof = 2.0;
        add_value(c, std::abs(number()), 1.0, number());
        s.channels["current_A"] = c;
        s.signed_errors = {{"current_A", "active", number()}, {"current_A", "reactive", number()}};
      }
      all.push_back(&record);
    }
    const FailureMap map = failure_map(all, round % 2 == 0 ? "points" : "time series", 1);
    for (const MapCondition& c : map.conditions) {
      std::size_t stretches = 0;
      for (const MapBin& bin : c.bins) stretches += bin.stretches;
      EXPECT_LE(stretches, map.stretches);
      EXPECT_TRUE(std::isnan(c.p_value) || (c.p_value > 0.0 && c.p_value <= 1.0)) << c.p_value;
    }
  }
}

TEST(FailureMap, SaysTheSameBitsAgain) {
  const auto once = compare(KnownMotor().model(), grid(0.05, 1)),
             again = compare(KnownMotor().model(), grid(0.05, 1));
  for (std::size_t c = 0; c < once.maps[0].conditions.size(); ++c) {
    const double a = once.maps[0].conditions[c].p_value, b = again.maps[0].conditions[c].p_value;
    EXPECT_TRUE(a == b || (std::isnan(a) && std::isnan(b)));
  }
}

TEST(DataReach, SaysWhatAPoorLogCannotShow) {
  const auto result =
      compare(KnownMotor().model(), test::data_set({test::steady_record(KnownMotor(), "a", {})}));
  std::string all;
  for (const auto& sentence : result.reach) all += sentence + "\n";
  for (const char* word : {"main flux", "leakage", "skin effect", "winding temperature", "one direction",
                           "shaft torque", "held out", "one record"}) {
    EXPECT_NE(all.find(word), std::string::npos) << word << " in\n" << all;
  }
  EXPECT_EQ(all.find("points only"), std::string::npos);
}

}  // namespace
}  // namespace imrig::est
