#include "estimators/model/convert_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <map>
#include <random>

#include "rig/base/error.h"

namespace imrig::est {
namespace {

using Complex = std::complex<double>;

Model motor() {
  Model m;
  m.name = "5 hp";
  m.pole_pairs = 2;
  m.R_s = {0.39, 0.387, 0.393, "ohm", ""};
  m.R_r = {0.22, 0.218, 0.222, "ohm", ""};
  m.L_l = {0.006, 0.00597, 0.00603, "H", ""};
  m.L_m = {0.068, 0.0675, 0.0685, "H", ""};
  return m;
}

std::map<std::string, Parameter> in(const Model& m, Circuit circuit, double ratio = 1.0) {
  std::map<std::string, Parameter> out;
  for (const auto& one : parameters_in(m, circuit, ratio)) out[one.name] = one.parameter;
  return out;
}

Complex branch(Complex a, Complex b) { return a * b / (a + b); }

TEST(ConvertModel, EveryCircuitsPrintedParametersHaveTheSameTerminalImpedance) {
  const Model m = motor();
  auto g = in(m, Circuit::kInverseGammaCircuit), t = in(m, Circuit::kTCircuit),
       u = in(m, Circuit::kTCircuit, 0.99), c = in(m, Circuit::kGammaCircuit);
  for (const double w : {5.0, 377.0}) {
    for (const double s : {-0.05, 0.01, 1.0}) {
      const Complex j(0.0, w);
      const Complex z = g["R_s"].value + j * g["L_l"].value + branch(j * g["L_m"].value, g["R_r"].value / s);
      const Complex z_gamma =
          c["R_s"].value + branch(j * c["L_M"].value, j * c["L_L"].value + c["R_R"].value / s);
      EXPECT_NEAR(std::abs(z_gamma / z - 1.0), 0.0, 1e-12);
      for (auto* one : {&t, &u}) {
        const Complex z_t =
            (*one)["R_s"].value + j * (*one)["L_ls"].value +
            branch(j * (*one)["L_m"].value, j * (*one)["L_lr"].value + (*one)["R_r"].value / s);
        EXPECT_NEAR(std::abs(z_t / z - 1.0), 0.0, 1e-12);
      }
    }
  }
  EXPECT_NEAR(t["L_s"].value / t["L_r"].value, 1.0, 1e-12);
  EXPECT_NEAR(u["L_s"].value / u["L_r"].value, 0.99, 1e-12);
}

// The T circuit that the fitted model solves (effects/t_circuit.h): L_ls = (1 - share) L_l, M = L_m + share
// L_l.
TEST(ConvertModel, LeakageThatSaturatesOnBothSidesShowsTheRatio) {
  Model m = motor();
  EXPECT_FALSE(seen_ratio(m));
  m.effects.push_back({"leakage_saturation", "two slopes, both sides", {}});
  m.effects.back().parameters["rotor_share"].value = 0.3;
  const auto ratio = seen_ratio(m);
  ASSERT_TRUE(ratio);
  auto t = in(m, Circuit::kTCircuit, *ratio);
  EXPECT_NEAR(t["L_ls"].value, 0.7 * 0.006, 1e-12);
  EXPECT_NEAR(t["L_m"].value, 0.068 + 0.3 * 0.006, 1e-12);
  EXPECT_NEAR(t["L_lr"].value, (0.068 + 0.3 * 0.006) * 0.3 * 0.006 / 0.068, 1e-12);
  m.effects.back().parameters["rotor_share"].value = 0.0;
  EXPECT_FALSE(seen_ratio(m)) << "the plain form says nothing of it";
}

TEST(ConvertModel, InverseGammaIsTheModelItself) {
  const Model m = motor();
  auto g = in(m, Circuit::kInverseGammaCircuit);
  for (const auto& base : base_parameters()) {
    EXPECT_DOUBLE_EQ(g[base.name].value, (m.*base.place).value);
    EXPECT_NEAR(g[base.name].ci95_low, (m.*base.place).ci95_low, 1e-9);
    EXPECT_NEAR(g[base.name].ci95_high, (m.*base.place).ci95_high, 1e-9);
  }
}

// Against draws of the base parameters with independent normal errors.
TEST(ConvertModel, IntervalsAreThoseOfIndependentErrors) {
  const Model m = motor();
  for (const Circuit circuit : {Circuit::kTCircuit, Circuit::kGammaCircuit}) {
    std::mt19937_64 random(5);
    std::normal_distribution<double> normal;
    std::map<std::string, std::pair<double, double>> sums;
    constexpr int kDraws = 20000;
    for (int k = 0; k < kDraws; ++k) {
      Model drawn = m;
      for (const auto& base : base_parameters())
        (drawn.*base.place).value +=
            normal(random) * ((m.*base.place).ci95_high - (m.*base.place).value) / 1.96;
      for (const auto& one : parameters_in(drawn, circuit)) {
        sums[one.name].first += one.parameter.value / kDraws;
        sums[one.name].second += one.parameter.value * one.parameter.value / kDraws;
      }
    }
    for (const auto& one : parameters_in(m, circuit)) {
      const auto [mean, square] = sums[one.name];
      const double half = 1.96 * std::sqrt(square - mean * mean);
      EXPECT_NEAR((one.parameter.ci95_high - one.parameter.value) / half, 1.0, 0.03) << one.name;
      EXPECT_NEAR((one.parameter.value - one.parameter.ci95_low) / half, 1.0, 0.03) << one.name;
    }
  }
}

TEST(ConvertModel, WhatDependsOnAParameterWithoutIntervalHasNone) {
  Model m = motor();
  m.R_r.ci95_low = m.R_r.ci95_high = kMissing;
  auto t = in(m, Circuit::kTCircuit);
  EXPECT_TRUE(std::isnan(t["R_r"].ci95_low));
  EXPECT_FALSE(std::isnan(t["L_m"].ci95_low));
  EXPECT_FALSE(std::isnan(t["R_s"].ci95_low));
}

TEST(ConvertModel, AnIncompleteModelAndAnImpossibleRatioAreRefused) {
  Model m = motor();
  EXPECT_THROW(parameters_in(m, Circuit::kTCircuit, 1.3), Error);
  m.L_m = {};
  EXPECT_THROW(parameters_in(m, Circuit::kGammaCircuit), Error);
  EXPECT_FALSE(circuit_from("pi"));
}

}  // namespace
}  // namespace imrig::est
