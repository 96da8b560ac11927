#include "estimators/model/convert.h"

#include <gtest/gtest.h>

#include <complex>

#include "rig/base/error.h"

namespace imrig::est {
namespace {

using Complex = std::complex<double>;

// Terminal impedances, each straight from its own circuit.
Complex z_t(const TCircuit& t, double w, double s) {
  const Complex m(0.0, w * t.L_m), r(t.R_r / s, w * t.L_lr);
  return Complex(t.R_s, w * t.L_ls) + m * r / (m + r);
}
Complex z_gamma(const GammaCircuit& g, double w, double s) {
  const Complex m(0.0, w * g.L_M), r(g.R_r / s, w * g.L_L);
  return g.R_s + m * r / (m + r);
}
Complex z_inverse_gamma(const MachineParameters<double>& p, double w, double s) {
  const Complex m(0.0, w * p.L_m), r(p.R_r / s, 0.0);
  return Complex(p.R_s, w * p.L_l) + m * r / (m + r);
}

void expect_same(Complex a, Complex b) { EXPECT_NEAR(std::abs(a - b) / std::abs(b), 0.0, 1e-12); }

TEST(ConvertTest, AllCircuitsHaveTheSameTerminals) {
  const TCircuit t{0.56, 0.42, 0.00484, 0.00735, 0.2114};
  const auto p = inverse_gamma_of(t);
  for (const double s : {-0.1, 0.01, 0.05, 1.0}) {
    for (const double w : {20.0, 314.0}) {
      expect_same(z_inverse_gamma(p, w, s), z_t(t, w, s));
      expect_same(z_gamma(gamma_of(p), w, s), z_t(t, w, s));
      expect_same(z_t(t_of(p), w, s), z_t(t, w, s));
      expect_same(z_t(t_of(p, 0.995), w, s), z_t(t, w, s));
    }
  }
}

TEST(ConvertTest, TheRatioOfTheTCircuitIsTheOneAskedFor) {
  const TCircuit t = t_of({0.39, 0.22, 0.006, 0.068}, 1.02);
  EXPECT_NEAR((t.L_ls + t.L_m) / (t.L_lr + t.L_m), 1.02, 1e-12);
}

TEST(ConvertTest, ThereAndBackIsTheSame) {
  const MachineParameters<double> p{0.39, 0.22, 0.006, 0.068};
  for (const auto& q :
       {inverse_gamma_of(t_of(p)), inverse_gamma_of(gamma_of(p)), star_of(delta_phase_of(p))}) {
    EXPECT_NEAR(q.R_s, p.R_s, 1e-15);
    EXPECT_NEAR(q.R_r, p.R_r, 1e-15);
    EXPECT_NEAR(q.L_l, p.L_l, 1e-15);
    EXPECT_NEAR(q.L_m, p.L_m, 1e-15);
  }
}

TEST(ConvertTest, StandardExample) {
  // L_s = L_r = 0.046 H, L_m = 0.039 H, R_r = 0.78 ohm (Fang, Lin and Wang 2005): by hand.
  const auto p = inverse_gamma_of(TCircuit{0.56, 0.78, 0.007, 0.007, 0.039});
  EXPECT_NEAR(p.L_l, 0.046 - 0.039 * 0.039 / 0.046, 1e-15);
  EXPECT_NEAR(p.L_m, 0.039 * 0.039 / 0.046, 1e-15);
  EXPECT_NEAR(p.R_r, 0.78 * 0.039 * 0.039 / (0.046 * 0.046), 1e-15);
}

TEST(ConvertTest, ARatioThatNeedsNegativeLeakageIsRefused) {
  EXPECT_THROW(t_of({0.39, 0.22, 0.006, 0.068}, 1.2), Error);
}

}  // namespace
}  // namespace imrig::est
