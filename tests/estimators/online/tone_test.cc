#include "estimators/online/tone.h"

#include <gtest/gtest.h>

#include <vector>

namespace imrig::est {
namespace {

using Complex = std::complex<double>;

// Phasors at the middle of the samples, as fit_tone states them.
std::vector<Complex> tone(double w, std::size_t n, Complex positive, Complex negative, Complex zero) {
  std::vector<Complex> x;
  for (std::size_t k = 0; k < n; ++k) {
    const double angle = w * (static_cast<double>(k) - 0.5 * (static_cast<double>(n) - 1.0));
    x.push_back(positive * std::polar(1.0, angle) + negative * std::polar(1.0, -angle) + zero);
  }
  return x;
}

TEST(Tone, UnbalanceAndZeroDoNotBiasTheFundamentalWhateverTheLength) {
  const Complex positive(120.0, -30.0), negative(4.0, 9.0), zero(-7.0, 3.0);
  for (const std::size_t n : {400u, 431u, 977u, 5000u}) {
    for (const double w : {0.0171, -0.0171, 0.3}) {
      const Tone fit = fit_tone(tone(w, n, positive, negative, zero), w);
      EXPECT_LT(std::abs(fit.positive - positive), 1e-8);
      EXPECT_LT(std::abs(fit.negative - negative), 1e-8);
      EXPECT_LT(std::abs(fit.zero - zero), 1e-8);
      EXPECT_LT(fit.residual_rms, 1e-6 * std::abs(positive));  // a difference of energies: half the digits
    }
  }
}

TEST(Tone, TheResidualIsWhatTheFitDoesNotHold) {
  std::vector<Complex> x = tone(0.02, 2000, {100.0, 0.0}, {}, {});
  for (std::size_t k = 0; k < x.size(); ++k)
    x[k] += 3.0 * std::polar(1.0, -5 * 0.02 * static_cast<double>(k));
  EXPECT_NEAR(fit_tone(x, 0.02).residual_rms, 3.0, 0.02);
}

TEST(CrossingFrequency, IsSignedAndNearWithoutNoise) {
  for (const double w : {0.02, -0.02, 0.0004, 0.2, -0.2}) {
    const std::size_t n = static_cast<std::size_t>(3.3 * 2.0 * 3.14159265 / std::abs(w));
    const auto found = crossing_frequency(tone(w, n, {10.0, 5.0}, {}, {}), std::abs(Complex(10.0, 5.0)));
    ASSERT_TRUE(found) << w;
    EXPECT_NEAR(*found, w, 2e-3 * std::abs(w));
  }
}

TEST(CrossingFrequency, LessThanAPeriodGivesNothing) {
  EXPECT_FALSE(crossing_frequency(tone(0.01, 500, {1.0, 0.0}, {}, {}), 1.0));
  EXPECT_FALSE(crossing_frequency(tone(0.0, 5000, {1.0, 0.0}, {}, {}), 1.0));
}

TEST(PhaseSlope, FindsTheFrequencyToRoundingFromAStartThatIsOffByAPercent) {
  for (const double w : {0.02, -0.02, 0.15}) {
    const auto found = phase_slope_frequency(tone(w, 3333, {150.0, 10.0}, {1.0, 2.0}, {3.0, 0.0}), 1.003 * w);
    ASSERT_TRUE(found);
    EXPECT_NEAR(*found, w, 1e-11);
  }
}

}  // namespace
}  // namespace imrig::est
