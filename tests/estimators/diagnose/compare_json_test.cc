#include "estimators/diagnose/compare_json.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/estimators/diagnose/known_motor.h"

namespace imrig::est {
namespace {

using nlohmann::json;
using test::KnownMotor;

json compared() {
  const KnownMotor motor;
  Record table;
  table.id = "ta\"ble\xff";
  table.kind = RecordKind::kPoints;
  table.points.push_back(test::steady_point(motor, 50.0, 0.03, 200.0));
  table.points.back().p_in_W = kMissing;
  Record brief = test::steady_record(motor, "brief", {.samples = 10});
  return json::parse(compare_json(
      compare(motor.model(), test::data_set({test::steady_record(motor, "a", {}), table, brief}))));
}

std::vector<std::string> keys(const json& object) {
  std::vector<std::string> all;
  for (const auto& [key, value] : object.items()) all.push_back(key);
  return all;
}

void expect_keys(const json& object, const std::vector<std::string>& wanted) {
  for (const auto& key : wanted)
    EXPECT_TRUE(object.contains(key)) << key << " is missing in " << object.dump();
}

TEST(CompareJson, HasTheKeysOtherProgramsRelyOn) {
  const json out = compared();
  expect_keys(out, {"version", "records", "fitted", "holdout"});
  EXPECT_EQ(out["version"], 1);
  const json& record = out["records"][0];
  expect_keys(record, {"id", "kind", "conditions", "channels"});
  EXPECT_EQ(record["kind"], "steady");
  expect_keys(record["conditions"], {"f_Hz", "v_V", "slip", "i_A", "psi_Wb", "torque_Nm", "stator_C"});
  expect_keys(record["channels"]["current_A"], {"rmse", "nrmse", "chi2_per_dof", "floor"});
  expect_keys(out["fitted"], {"nrmse", "chi2_per_dof", "floor_nrmse"});
  EXPECT_EQ(keys(out["holdout"]), keys(out["fitted"]));
}

TEST(CompareJson, WhatIsNotKnownIsNull) {
  const json out = compared();
  EXPECT_TRUE(out["records"][0]["channels"]["current_A"]["floor"].is_null());
  EXPECT_TRUE(out["records"][0]["channels"]["current_A"]["nrmse"].is_number());
  EXPECT_TRUE(out["records"][0]["conditions"]["stator_C"].is_null());
  EXPECT_TRUE(out["holdout"]["nrmse"].is_null());
  EXPECT_TRUE(out["records"][0]["left_out"].is_null());
  EXPECT_TRUE(out["records"][2]["left_out"].is_string());
}

TEST(CompareJson, PointsCarryMeasuredAndPredicted) {
  const json point = compared()["records"][1]["points"][0];
  EXPECT_TRUE(point["channels"]["current_A"]["measured"].is_number());
  EXPECT_TRUE(point["channels"]["current_A"]["predicted"].is_number());
  EXPECT_TRUE(point["channels"]["input_power_W"]["measured"].is_null());
  EXPECT_TRUE(point["channels"]["input_power_W"]["predicted"].is_number());
}

TEST(CompareJson, SaysWhereTheModelFails) {
  const json out = compared();
  ASSERT_EQ(out["maps"].size(), 2u);
  EXPECT_EQ(out["maps"][0]["from"], "time series");
  EXPECT_EQ(out["maps"][1]["from"], "points");
  for (const json& map : out["maps"]) {
    expect_keys(map, {"stretches", "records", "shuffled", "conditions"});
    for (const json& condition : map["conditions"]) {
      expect_keys(condition, {"condition", "p_value", "share", "channel", "part", "bins"});
      for (const json& bin : condition["bins"])
        expect_keys(bin, {"low", "high", "stretches", "records", "channels"});
    }
  }
  EXPECT_EQ(out["spectrum"]["noise"], "beside each line");
  expect_keys(out["spectrum"]["lines"][0],
              {"line", "order", "hint", "records", "seen", "amplitude_A", "over_noise", "worst"});
  EXPECT_EQ(out["spectrum"]["lines"].size(), 11u);
  ASSERT_EQ(out["overlays"].size(), 1u);
  const json& overlay = out["overlays"][0];
  EXPECT_EQ(overlay["record"], "a");
  EXPECT_EQ(overlay["t_s"].size(), overlay["measured_A"].size());
  EXPECT_EQ(overlay["t_s"].size(), overlay["predicted_A"].size());
  EXPECT_GT(out["reach"].size(), 2u);
}

}  // namespace
}  // namespace imrig::est
