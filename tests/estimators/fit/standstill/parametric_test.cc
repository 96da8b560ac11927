#include "estimators/fit/standstill/parametric.h"

#include <gtest/gtest.h>

#include <complex>

namespace imrig::est {
namespace {

// The paper's motor: R_s 0.56, R_r 0.78, L_s = L_r = 0.046, L_m = 0.039.
const TCircuit kPaper{0.56, 0.78, 0.007, 0.007, 0.039};

TEST(StandstillParametric, ThePapersMotorHasTheVectorThatItsPrintedOneShouldHaveBeen) {
  const auto c = regression_of(kPaper, {});
  EXPECT_NEAR(c[0], 92.16, 0.005);
  EXPECT_NEAR(c[1], -14.85, 0.005);
  EXPECT_NEAR(c[2], 81.32, 0.005);
  EXPECT_NEAR(c[3], 15.08, 0.005);
}

TEST(StandstillParametric, ThereAndBackIsTheSame) {
  for (const StandstillFilters h : {StandstillFilters{40.0, 160.0}, StandstillFilters{10.0, 300.0}}) {
    const auto t = circuit_of(regression_of(kPaper, h), h);
    ASSERT_TRUE(t);
    EXPECT_NEAR(t->R_s, kPaper.R_s, 1e-11);
    EXPECT_NEAR(t->R_r, kPaper.R_r, 1e-11);
    EXPECT_NEAR(t->L_ls, kPaper.L_ls, 1e-12);
    EXPECT_NEAR(t->L_lr, kPaper.L_lr, 1e-12);
    EXPECT_NEAR(t->L_m, kPaper.L_m, 1e-12);
  }
}

// The regressors in the frequency domain: i = c . w must hold for the motor's own admittance.
TEST(StandstillParametric, TheRegressionHoldsForTheMotorsAdmittanceAtEveryFrequency) {
  using Complex = std::complex<double>;
  const StandstillFilters h;
  const auto c = regression_of(kPaper, h);
  for (const double w : {1.0, 12.0, 70.0, 1000.0}) {
    const Complex s(0.0, w), m = s * kPaper.L_m, rotor = kPaper.R_r + s * kPaper.L_lr;
    const Complex Z = kPaper.R_s + s * kPaper.L_ls + m * rotor / (m + rotor);
    const Complex u = Z, i = 1.0;
    const Complex predicted =
        c[0] * u / (s + h.h_1) + c[1] * u / (s + h.h_0) + c[2] * i / (s + h.h_1) + c[3] * i / (s + h.h_0);
    EXPECT_NEAR(std::abs(predicted - i), 0.0, 1e-12) << w;
  }
}

TEST(StandstillParametric, ThePrintedVectorIsNoMotor) {
  EXPECT_FALSE(circuit_of({66.0, -12.5, 305.0, 5.4}, {}));
}

}  // namespace
}  // namespace imrig::est
