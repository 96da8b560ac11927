// model convert and export as a user runs them.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/rig/cli/data_verbs/process.h"
#include "tests/rig/data/scratch.h"

namespace imrig {
namespace {

using nlohmann::json;
using test::Finished;
using test::Scratch;

const std::string kMotor = std::string(IMRIG_SOURCE_DIR) + "/models/motors/proca_keyhani_5hp.toml";

class ModelCircuits : public ::testing::Test {
 protected:
  Finished run(const std::vector<std::string>& arguments) const {
    return test::run(scratch.path(), arguments);
  }
  void expect_refused(const std::vector<std::string>& arguments, const std::string& says) const {
    const Finished done = run(arguments);
    EXPECT_EQ(done.exit_code, 2) << done.out;
    EXPECT_EQ(done.out, "");
    EXPECT_EQ(std::count(done.err.begin(), done.err.end(), '\n'), 1) << done.err;
    EXPECT_NE(done.err.find(says), std::string::npos) << done.err;
  }
  Scratch scratch;
};

// R_s 0.39, R_r 0.22, L_l 0.006, L_m 0.068 by hand: L_s = 0.074, L_mT = sqrt(L_m L_s), R_rT = R_r L_s/L_m.
TEST_F(ModelCircuits, ConvertPrintsTheTCircuit) {
  const Finished done = run({"model", "convert", kMotor, "--to", "t", "--json"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const json p = json::parse(done.out)["parameters"];
  EXPECT_NEAR(p["L_s"]["value"].get<double>(), 0.074, 1e-12);
  EXPECT_NEAR(p["L_m"]["value"].get<double>(), 0.07093659, 1e-8);
  EXPECT_NEAR(p["R_r"]["value"].get<double>(), 0.2394118, 1e-7);
  EXPECT_EQ(p["R_r"]["unit"], "ohm");
  const Finished text = run({"model", "convert", kMotor, "--to", "gamma"});
  EXPECT_EQ(text.exit_code, 0);
  EXPECT_NE(text.out.find("R_R"), std::string::npos);
  EXPECT_NE(text.out.find("0.26054"), std::string::npos) << text.out;  // 0.22 (74/68)^2
}

TEST_F(ModelCircuits, ExportWritesWhatItPrints) {
  for (const std::string format : {"csv", "json", "c"}) {
    const Finished printed = run({"model", "export", kMotor, "--format", format});
    ASSERT_EQ(printed.exit_code, 0) << printed.err;
    const std::string file = scratch.path() + "/motor." + format;
    const Finished written = run({"model", "export", kMotor, "--format", format, "--out", file});
    ASSERT_EQ(written.exit_code, 0) << written.err;
    EXPECT_EQ(written.out, "");
    EXPECT_EQ(test::text_of(file), printed.out);
    EXPECT_NE(printed.out.find("0.068"), std::string::npos);
  }
}

TEST_F(ModelCircuits, WhatCannotBeIsToldInOneSentence) {
  expect_refused({"model", "convert", kMotor, "--to", "pi"}, "gamma");
  expect_refused({"model", "convert", kMotor, "--to", "t", "--ratio", "1.5"}, "leakage");
  expect_refused({"model", "export", kMotor, "--format", "xml"}, "csv, json or c");
  expect_refused({"model", "export", scratch.path() + "/none.toml", "--format", "c"}, "none.toml");
}

}  // namespace
}  // namespace imrig
