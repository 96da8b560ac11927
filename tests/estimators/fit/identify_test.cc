// A whole data set to a model: DC test, steps, steady records, hold-outs; and what is refused, with its
// reason.
#include "estimators/fit/identify.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "estimators/fit/identify_json.h"
#include "estimators/fit/maps/sensitivity.h"
#include "estimators/model/convert.h"
#include "estimators/model/model_file.h"
#include "rig/base/error.h"
#include "tests/estimators/fit/synthetic.h"

namespace imrig::est {
namespace {

using synthetic::Motor;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

const Motor& paper_motor() { return synthetic::motors()[1]; }

MachineParameters<double> truth_of(const Motor& m) {
  return inverse_gamma_of(TCircuit{m.R_s, m.R_r, m.L_ls, m.L_lr, m.L_m});
}

double rated_current(const Motor& m) { return m.v_peak_V * m.slip / m.R_r; }

Noise noise_of(const Motor& m) {
  Noise noise;
  noise.current_A = 0.003 * rated_current(m);
  noise.voltage_V = 0.001 * m.v_peak_V;
  noise.speed_rad_s = rad_s_of_rpm(0.2);
  return noise;
}

// Gates off, then three levels of direct current along -b.
Record dc_record(const Motor& m, std::uint64_t seed) {
  Record r;
  r.id = fmt::format("dc_{}", seed);
  r.kind = RecordKind::kDc;
  r.series.sample_time_s = 60e-6;
  const SpaceVector along = -std::polar(1.0, 2.0 * kPi / 3.0);
  for (int segment = 0; segment < 4; ++segment) {
    const double current = segment * rated_current(m) / 3.0;
    for (int k = 0; k < 5000; ++k) {
      r.series.i.push_back(current * along);
      r.series.v.push_back(m.R_s * current * along);
      r.series.speed_rad_s.push_back(0.0);
      r.series.segment.push_back(segment);
      r.series.gates_on.push_back(segment > 0);
      r.series.stator_C.push_back(25.0);
    }
  }
  synthetic::add_noise(r.series, noise_of(m).current_A, noise_of(m).voltage_V, 0.0, seed);
  return r;
}

Record step_record(const Motor& m, double voltage, double frequency, double slip, std::uint64_t seed) {
  Record r;
  r.id = fmt::format("v{:.2f}_f{:.2f}_s{:.3f}", voltage, frequency, slip);
  r.kind = RecordKind::kStep;
  auto c = synthetic::step_case(m, voltage * frequency, frequency, slip, 60e-6, 5000);
  c.filter_s = 200e-6;
  r.series = synthetic::record(m, c);
  const Noise noise = noise_of(m);
  synthetic::add_noise(r.series, noise.current_A, noise.voltage_V, noise.speed_rad_s, seed);
  return r;
}

Record steady_record(const Motor& m, double slip, std::uint64_t seed) {
  Record r = step_record(m, 0.9, 1.0, slip, seed);
  auto c = synthetic::step_case(m, 0.9, 1.0, slip, 60e-6, 5000);
  c.step_at_s = 0.0;
  r.series = synthetic::record(m, c);
  synthetic::add_noise(r.series, noise_of(m).current_A, 0.0, 0.0, seed);
  r.id = fmt::format("steady_{:.3f}", slip);
  r.kind = RecordKind::kSteady;
  return r;
}

DataSet empty_set(const Motor& m) {
  DataSet data;
  data.name = m.name;
  data.pole_pairs = m.pole_pairs;
  data.noise = noise_of(m);
  data.accuracy = {0.002, 0.002};
  data.hash = 0x1234;
  return data;
}

DataSet campaign(const Motor& m, bool with_dc, std::uint64_t seed) {
  DataSet data = empty_set(m);
  if (with_dc) data.records = {dc_record(m, seed), dc_record(m, seed + 1)};
  for (const double voltage : {0.5, 0.9}) {
    for (const double frequency : {0.6, 1.0}) {
      for (const double load : {0.05, 0.5, 1.0}) {
        data.records.push_back(step_record(m, voltage, frequency, load * m.slip / frequency, ++seed + 50));
        data.records.back().holdout = voltage == 0.9 && load == 0.5;
      }
    }
  }
  return data;
}

const RecordResult& row(const IdentifyResult& result, const std::string& id) {
  for (const auto& r : result.records) {
    if (r.id == id) return r;
  }
  throw Error("no row " + id);
}

// True, identified, interval, error; and the check that both marks are met.
void expect_truth(const Motor& m, const Model& model) {
  const auto t = truth_of(m);
  const std::array truth{t.R_s, t.R_r, t.L_l, t.L_m};
  std::printf("%-22s      true  identified                 95 %% interval     error\n", m.name);
  for (std::size_t k = 0; k < truth.size(); ++k) {
    const auto& base = base_parameters()[k];
    const Parameter& p = model.*base.place;
    std::printf("%-20s %s %10.6g %11.6g  [%10.6g, %10.6g] %+8.3f %%  %s\n", "", base.name, truth[k], p.value,
                p.ci95_low, p.ci95_high, 100.0 * (p.value / truth[k] - 1.0), p.found.c_str());
    EXPECT_NEAR(p.value / truth[k], 1.0, 0.01) << base.name;
    EXPECT_NEAR(p.value, truth[k], 1.5 * (p.ci95_high - p.ci95_low) / 2.0)
        << base.name;  // three standard deviations
  }
}

TEST(IdentifyTest, EveryMotorFromTheDataAloneWithinOnePercent) {
  for (const auto& m : synthetic::motors()) {
    const DataSet data = campaign(m, true, 1);
    const auto begin = std::chrono::steady_clock::now();
    const IdentifyResult result = identify(data);
    const double ms =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
    expect_truth(m, result.model);
    std::printf("%zu records in %.0f ms\n", data.records.size(), ms);
    EXPECT_EQ(result.model.R_s_stator_C, 25.0);
    ASSERT_EQ(result.model.history.size(), 1U);
    EXPECT_LT(result.model.history[0].fitted_nrmse, 0.02);
    EXPECT_LT(result.model.history[0].holdout_nrmse, 0.02);
    EXPECT_EQ(result.model.history[0].data_hash, 0x1234U);
    double chi2 = 0.0;
    for (const auto& r : result.records) chi2 += std::isfinite(r.chi2_per_dof) ? r.chi2_per_dof / 10.0 : 0.0;
    EXPECT_NEAR(chi2, 1.0, 0.2)
        << m.name;  // mean of ten; the residual is coloured, so one record's alone scatters widely
  }
}

TEST(IdentifyTest, AWrongNominalModelOnlySetsTheStart) {
  IdentifyOptions options;
  options.nominal = nominal_model({});
  options.nominal->R_r.value *= 1.7;
  options.nominal->L_l.value *= 0.6;
  options.nominal->L_m.value *= 1.5;
  expect_truth(paper_motor(), identify(campaign(paper_motor(), true, 3), options).model);
}

TEST(IdentifyTest, WithoutDcRecordTheResistanceIsFittedAndSaid) {
  const IdentifyResult result = identify(campaign(paper_motor(), false, 5));
  const auto truth = truth_of(paper_motor());
  EXPECT_THAT(result.notes, Contains(HasSubstr("no dc record")));
  EXPECT_NEAR(result.model.R_s.value / truth.R_s, 1.0, 0.03);
  EXPECT_NEAR(result.model.R_s.value, truth.R_s,
              1.5 * (result.model.R_s.ci95_high - result.model.R_s.ci95_low) / 2.0);
  EXPECT_NEAR(result.model.L_m.value / truth.L_m, 1.0, 0.02);
}

TEST(IdentifyTest, WithoutDcRecordTheNominalResistanceIsTakenAndSaid) {
  IdentifyOptions options;
  options.nominal = nominal_model({});
  const IdentifyResult result = identify(campaign(paper_motor(), false, 5), options);
  EXPECT_EQ(result.model.R_s.value, 0.39);
  EXPECT_THAT(result.notes, Contains(HasSubstr("R_s was not measured")));
}

TEST(IdentifyTest, HoldOutRecordsAreNeverFitted) {
  DataSet data = campaign(paper_motor(), true, 7);
  const IdentifyResult before = identify(data);
  for (auto& r : data.records) {
    if (!r.holdout) continue;
    for (auto& i : r.series.i) i *= 2.0;
  }
  const IdentifyResult after = identify(data);
  for (const auto& base : base_parameters())
    EXPECT_EQ((before.model.*base.place).value, (after.model.*base.place).value) << base.name;
  EXPECT_GT(after.model.history[0].holdout_nrmse, 0.4);
  EXPECT_EQ(after.model.history[0].fitted_nrmse, before.model.history[0].fitted_nrmse);
  for (const auto& r : after.records) {
    if (r.holdout) {
      EXPECT_THAT(r.used_for, IsEmpty()) << r.id;
    }
  }
}

TEST(IdentifyTest, TheSameBitsWithOneThreadOrFour) {
  const DataSet data = campaign(paper_motor(), true, 9);
  IdentifyOptions one, four;
  one.threads = 1;
  four.threads = 4;
  std::size_t told = 0, total = 0;
  four.progress = [&](const Progress& p) {
    told = std::max(told, p.done);
    total = p.total;
  };
  EXPECT_EQ(to_json(identify(data, one)), to_json(identify(data, four)));
  EXPECT_EQ(told, 10U);
  EXPECT_EQ(total, 10U);
}

TEST(IdentifyTest, ASteadyRecordAloneSaysWhatItCannotSeparateAndLeavesAStartThere) {
  const Motor& m = paper_motor();
  DataSet data = empty_set(m);
  data.records = {dc_record(m, 1), steady_record(m, 0.03, 2)};
  const IdentifyResult result = identify(data);
  const RecordResult& steady = row(result, "steady_0.030");
  EXPECT_THAT(steady.used_for, Not(Contains("L_l")));
  EXPECT_THAT(steady.notes, Contains(testing::AllOf(HasSubstr("alone: "), HasSubstr("L_l"), HasSubstr("L_m"), HasSubstr("sigma"))));
  EXPECT_TRUE(is_start(result.model.L_l));
  EXPECT_TRUE(std::isnan(result.model.L_l.ci95_high));
  EXPECT_THAT(result.notes, Contains(HasSubstr("L_l is not determined")));
  // What that leaves of the others: they hold for any leakage that a motor may have.
  const auto truth = truth_of(m);
  EXPECT_TRUE(result.model.R_s.known());
  EXPECT_LT(result.model.R_r.ci95_low, truth.R_r);
  EXPECT_GT(result.model.R_r.ci95_high, truth.R_r);
  EXPECT_LT(result.model.L_m.ci95_low, truth.L_m);
  EXPECT_GT(result.model.L_m.ci95_high, truth.L_m);
}

TEST(IdentifyTest, ReversedPhaseOrderIsNamed) {
  DataSet data = campaign(paper_motor(), true, 11);
  for (auto& v : data.records[3].series.v) v = std::conj(v);
  for (auto& i : data.records[3].series.i) i = std::conj(i);
  const IdentifyResult result = identify(data);
  EXPECT_THAT(result.records[3].rejected, HasSubstr("phase order"));
  expect_truth(paper_motor(), result.model);
}

TEST(IdentifyTest, OneBrokenRecordDoesNotSpoilTheRest) {
  DataSet data = campaign(paper_motor(), true, 13);
  for (auto& i : data.records[4].series.i) i *= 1.3;  // a wrong gain: fits well, to another motor
  data.records[5].series.v[700] = {kMissing, 0.0};    // a gap
  for (auto& i : data.records[6].series.i) i = {std::abs(i), i.real()};  // garbage
  const IdentifyResult result = identify(data);
  expect_truth(paper_motor(), result.model);
  EXPECT_THAT(result.records[4].rejected, HasSubstr("median"));
  EXPECT_THAT(result.records[5].rejected, HasSubstr("missing value"));
  EXPECT_THAT(result.records[6].rejected, Not(IsEmpty()));
}

TEST(IdentifyTest, TheSlipRuleOfThePaperCanBeAskedFor) {
  IdentifyOptions options;
  options.slip_rule = 0.02;
  const IdentifyResult result = identify(campaign(paper_motor(), true, 15), options);
  for (const auto& r : result.records) {
    if (r.kind != RecordKind::kStep || r.holdout) continue;
    if (r.slip > 0.021) {
      EXPECT_THAT(r.used_for, Not(Contains("L_m"))) << r.id;
    }
    if (r.slip < 0.019) {
      EXPECT_THAT(r.used_for, testing::AnyOf(IsEmpty(), testing::ElementsAre("L_m"))) << r.id;
    }
  }
  expect_truth(paper_motor(), result.model);
}

// (8)-(9): what a tenth of a parameter moves the current of the record's steady state.
TEST(IdentifyTest, TheComputedSensitivityDecidesWhichRecordsAreKeptAndSaysSo) {
  IdentifyOptions options;
  options.least_sensitivity = kLeastSensitivity;
  const DataSet data = campaign(paper_motor(), true, 15);
  const IdentifyResult result = identify(data, options), all = identify(data);
  const MachineParameters<double> machine = result.model.machine();
  int kept = 0, dropped = 0;
  for (std::size_t k = 0; k < result.records.size(); ++k) {
    const RecordResult& r = result.records[k];
    if (r.kind != RecordKind::kStep || r.holdout) continue;
    const Sensitivity S = sensitivity_at(machine, 2.0 * kPi * std::abs(r.f_Hz), r.slip);
    for (const char* name : {"R_r", "L_l", "L_m"}) {
      const RecordEstimate& e = r.parameters.at(name);
      if (std::abs(S.of(name) / options.least_sensitivity - 1.0) < 0.2) continue;  // the nominal machine differs a little
      if (S.of(name) > options.least_sensitivity) {
        EXPECT_FALSE(e.by_rule) << r.id << " " << name;
        EXPECT_EQ(e.left_out, all.records[k].parameters.at(name).left_out) << r.id << " " << name;
        ++kept;
      } else if (all.records[k].parameters.at(name).left_out.empty()) {
        EXPECT_THAT(e.left_out, HasSubstr("computed sensitivity S/I")) << r.id << " " << name;
        EXPECT_TRUE(e.by_rule);
        ++dropped;
      }
      // The record's own, the step included, is of the same size wherever the steady state says something.
      EXPECT_GT(e.sensitivity, 0.0);
      if (S.of(name) > 5e-3) {
        EXPECT_NEAR(e.sensitivity / S.of(name), 1.0, 0.5) << r.id << " " << name;
      }
    }
  }
  EXPECT_GT(kept, 10);
  EXPECT_GT(dropped, 3);
  expect_truth(paper_motor(), result.model);
}

TEST(IdentifyTest, AParameterOnItsBoundIsNoResult) {
  const MachineParameters<double> truth = truth_of(paper_motor());
  IdentifyOptions options;
  Model nominal;
  nominal.pole_pairs = paper_motor().pole_pairs;
  nominal.R_s.value = truth.R_s;
  nominal.R_r.value = truth.R_r;
  nominal.L_l.value = truth.L_l;
  nominal.L_m.value = truth.L_m / 4.0;  // its bound is three times this
  options.nominal = nominal;
  const IdentifyResult result = identify(campaign(paper_motor(), true, 19), options);
  for (const auto& r : result.records) {
    if (r.kind != RecordKind::kStep || r.holdout) continue;
    EXPECT_THAT(r.used_for, Not(Contains("L_m"))) << r.id;
    const std::string why = r.parameters.at("L_m").left_out + r.rejected;
    EXPECT_THAT(why, testing::AnyOf(HasSubstr("bound"), HasSubstr("settle"), HasSubstr("misses the current"))) << r.id;
  }
  EXPECT_TRUE(std::isnan(result.model.L_m.ci95_high)) << "the given value stays, without an interval";
  EXPECT_THAT(result.notes, Contains(HasSubstr("L_m is not determined by these records; the given model's value is kept")));
  EXPECT_THAT(to_json(result), HasSubstr("L_m is not determined by these records"));
}

TEST(IdentifyTest, MethodDcFindsTheResistanceAlone) {
  IdentifyOptions options;
  options.method = "dc";
  const IdentifyResult result = identify(campaign(paper_motor(), true, 17), options);
  EXPECT_NEAR(result.model.R_s.value / 0.39, 1.0, 0.01);
  EXPECT_FALSE(result.model.L_m.known());
}

std::string complaint(const DataSet& data, const IdentifyOptions& options) {
  try {
    identify(data, options);
  } catch (const Error& e) {
    return e.what();
  }
  return "no complaint";
}

TEST(IdentifyTest, WhatCannotWorkIsToldInOneSentence) {
  const DataSet data = campaign(paper_motor(), false, 19);
  IdentifyOptions options;
  options.method = "magic";
  EXPECT_THAT(complaint(data, options), testing::AllOf(HasSubstr("magic"), HasSubstr("auto, dc, transient")));
  options.method = "dc";
  EXPECT_THAT(complaint(data, options), HasSubstr("no record it can use"));
  options.method = "points";
  EXPECT_THAT(complaint(data, options), HasSubstr("no record it can use"));
  options.method = "auto";
  EXPECT_THAT(complaint(empty_set(paper_motor()), options), HasSubstr("no record it can use"));
  DataSet unknown = data;
  unknown.pole_pairs = 0;
  EXPECT_THAT(complaint(unknown, options), HasSubstr("pole pairs"));
  DataSet wrong = data;
  wrong.pole_pairs = 3;
  EXPECT_THAT(complaint(wrong, options), HasSubstr("pole_pairs = 2"));
  options.nominal = nominal_model({});
  options.nominal->pole_pairs = 4;
  EXPECT_THAT(complaint(data, options), HasSubstr("4 pole pairs"));
}

TEST(IdentifyJsonTest, HoldsWhatOtherProgramsRelyOn) {
  DataSet data = campaign(paper_motor(), true, 21);
  data.delta = true;
  const auto json = nlohmann::json::parse(to_json(identify(data)));
  EXPECT_EQ(json["version"], 1);
  for (const char* name : {"R_s", "R_r", "L_l", "L_m"}) {
    const auto& p = json["model"][name];
    EXPECT_TRUE(p["value"].is_number());
    EXPECT_LT(p["ci95"][0].get<double>(), p["value"].get<double>());
    EXPECT_GT(p["ci95"][1].get<double>(), p["value"].get<double>());
    EXPECT_NEAR(json["model_delta_phase"][name]["value"].get<double>(), 3.0 * p["value"].get<double>(),
                1e-12);
  }
  EXPECT_EQ(json["model"]["L_m"]["unit"], "H");
  ASSERT_EQ(json["records"].size(), data.records.size());
  EXPECT_EQ(json["records"][0]["id"], "dc_21");
  EXPECT_EQ(json["records"][0]["used_for"], nlohmann::json({"R_s"}));
  EXPECT_TRUE(json["records"][0]["rejected"].is_null());
  EXPECT_TRUE(json["records"][2]["parameters"]["L_m"]["value"].is_number());
  EXPECT_TRUE(json["records"][9]["rejected"].is_string());  // hold-out
  EXPECT_THAT(json["notes"].dump(), HasSubstr("delta"));
}

TEST(IdentifyTest, ItsModelIsSavedAndLoadedToTheSameBits) {
  const Model model = identify(campaign(paper_motor(), true, 23)).model;
  EXPECT_EQ(to_toml(parse_model(to_toml(model), "m.toml")), to_toml(model));
}

}  // namespace
}  // namespace imrig::est
