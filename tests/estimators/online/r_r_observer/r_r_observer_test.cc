#include "estimators/online/r_r_observer/r_r_observer.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "rig/base/error.h"
#include "tests/estimators/online/r_r_observer/phasor_motor.h"

namespace imrig::est {
namespace {

constexpr double kSample_s = 60e-6;

RotorObserverConfig config() {
  RotorObserverConfig c;
  c.voltage_filter_s = 160e-6;
  c.circuit = {0.39, 0.068, 0.0, 0.22};
  return c;
}

std::vector<RotorEstimate> run(RotorObserver& observer, phasor::Source& source, const phasor::Point& point,
                               double seconds, double from_s = 0.0) {
  std::vector<RotorEstimate> out;
  const auto n = std::llround(seconds / kSample_s);
  for (long long k = 0; k < n; ++k) {
    const auto s = source.at(point, from_s + static_cast<double>(k) * kSample_s);
    if (const auto e = observer.take(s.v, s.i, s.speed_rad_s)) out.push_back(*e);
  }
  return out;
}

TEST(RotorObserver, FindsTheCircuitsResistanceAtEverySlipFrequencyAndPhaseOrder) {
  double worst = 0.0, worst_f = 0.0;
  for (const double f : {10.0, 30.0, 50.0, 60.0, 80.0}) {
    for (const double slip : {0.025, 0.05, 0.1, -0.04}) {
      for (const bool reversed : {false, true}) {
        const double corner = 0.22 / (2.0 * M_PI * f * 0.068);
        if (std::abs(slip) < 1.3 * corner && std::abs(slip) > 0.75 * corner) continue;
        phasor::Source source({}, {}, 1);
        RotorObserver observer(config());
        const auto all = run(observer, source, {f, slip, 2.5 * f, reversed}, 1.6);
        ASSERT_GE(all.size(), 4u);
        ASSERT_EQ(all.back().status, RotorResistanceStatus::kValid) << f << " " << slip;
        EXPECT_EQ(all.back().frequency_Hz > 0.0, !reversed);
        worst = std::max(worst, std::abs(all.back().R_r_ohm / 0.22 - 1.0));
        worst_f = std::max(worst_f, std::abs(std::abs(all.back().frequency_Hz) / f - 1.0));
        EXPECT_EQ(all[0].status, RotorResistanceStatus::kNotSteady);
      }
    }
  }
  fmt::print("without noise: R_r {:.1e}, frequency {:.1e} (relative)\n", worst, worst_f);
  EXPECT_LT(worst, 5e-4);
  EXPECT_LT(worst_f, 2e-5);
}

TEST(RotorObserver, HoldsUnderTheRigsNoiseAndZeros) {
  for (const double slip : {0.025, 0.04, 0.08}) {
    double sum = 0.0, square = 0.0;
    int n = 0;
    phasor::Source source({}, {160e-6, 0.3, 0.03, 0.05, 0.02}, 7);
    RotorObserver observer(config());
    for (const auto& e : run(observer, source, {60.0, slip, 150.0, false}, 20.0)) {
      if (e.status != RotorResistanceStatus::kValid) continue;
      const double error = e.R_r_ohm / 0.22 - 1.0;
      sum += error;
      square += error * error;
      ++n;
    }
    ASSERT_GT(n, 80) << slip;
    const double mean = sum / n, spread = std::sqrt(square / n - mean * mean);
    fmt::print("slip {:.1f} %: bias {:+.3f} %, spread of single windows {:.3f} %, {} of about 97 valid\n",
               100 * slip, 100 * mean, 100 * spread, n);
    EXPECT_LT(std::abs(mean), 0.001);
    EXPECT_LT(spread, 0.001);
  }
}

TEST(RotorObserver, FollowsTheCageAsItWarmsAndPredictsAnotherSlip) {
  constexpr double k_6 = 0.0007;
  RotorObserverConfig c = config();
  c.k_6_ohm_s = k_6;
  RotorObserver observer(c);
  phasor::Source source({}, {160e-6, 0.3, 0.03, 0.0, 0.0}, 3);
  const double slip = 0.04, w_s = 0.04 * 2.0 * M_PI * 60.0;
  double worst = 0.0;
  for (int minute = 0; minute < 6; ++minute) {
    const double R_1 = 0.20 * (1.0 + 0.05 * minute);
    source.motor().R_r = R_1 + k_6 * w_s;
    run(observer, source, {60.0, slip, 150.0, false}, 1.2, 10.0 * minute);
    worst = std::max(worst, std::abs(*observer.tracker().R_1_ohm() / R_1 - 1.0));
    worst = std::max(worst, std::abs(*observer.tracker().R_r_ohm(200.0) / (R_1 + k_6 * 200.0) - 1.0));
  }
  fmt::print("R_1 over 25 % of warming, and R_r at w_s = 200 rad/s from it: worst {:.2f} %\n", 100 * worst);
  EXPECT_LT(worst, 0.002);
}

TEST(RotorObserver, GivesNothingBelowTheLeastSlipWhileMovingOrWithoutSpeed) {
  phasor::Source source({}, {}, 1);
  RotorObserver slow(config());
  EXPECT_EQ(run(slow, source, {60.0, 0.015, 150.0, false}, 1.2).back().status,
            RotorResistanceStatus::kSlipTooSmall);
  EXPECT_FALSE(slow.tracker().R_1_ohm());

  RotorObserver moving(config());
  for (int k = 0; k < 40000; ++k) {
    const double t = k * kSample_s;
    const auto s = source.at({60.0, 0.03 + 0.01 * t, 150.0, false}, t);
    const auto e = moving.take(s.v, s.i, s.speed_rad_s);
    if (e) {
      EXPECT_EQ(e->status, RotorResistanceStatus::kNotSteady);
    }
  }

  RotorObserver blind(config());
  std::optional<RotorEstimate> last;
  for (int k = 0; k < 20000; ++k) {
    const auto s = source.at({}, k * kSample_s);
    if (const auto e = blind.take(s.v, s.i, std::nan(""))) last = e;
  }
  ASSERT_TRUE(last);
  EXPECT_EQ(last->status, RotorResistanceStatus::kNoSpeed);
}

TEST(RotorObserver, AModelThatCannotBeTrueIsToldAndLeavesR1Alone) {
  RotorObserverConfig c = config();
  RotorObserver right(c);
  phasor::Source source({}, {}, 1);
  run(right, source, {}, 1.2);
  EXPECT_TRUE(right.tracker().R_1_ohm());
  c.circuit.L_m_H = 0.008;
  RotorObserver wrong(c);
  const auto all = run(wrong, source, {}, 1.2);
  EXPECT_EQ(all.back().status, RotorResistanceStatus::kNotReal);
  EXPECT_TRUE(std::isnan(all.back().R_r_ohm));
  EXPECT_FALSE(wrong.tracker().R_1_ohm());
}

TEST(RotorObserver, AnInterruptionStartsTheWindowAndTheSteadinessAnew) {
  phasor::Source source({}, {}, 1);
  RotorObserver observer(config());
  run(observer, source, {}, 1.2);
  const double before = *observer.tracker().R_1_ohm();
  observer.interrupt(50000);
  const auto after = run(observer, source, {}, 0.5, 3.0);
  ASSERT_FALSE(after.empty());
  EXPECT_GE(after[0].first_index, 50000);
  EXPECT_EQ(after[0].status, RotorResistanceStatus::kNotSteady);
  EXPECT_EQ(*observer.tracker().R_1_ohm(), before);
}

TEST(RotorObserver, ConfigurationsOutOfRangeAreRefused) {
  auto c = config();
  c.circuit.R_s_ohm = 0.0;
  EXPECT_THROW(RotorObserver{c}, Error);
  c = config();
  c.window_s = 5.0;
  EXPECT_THROW(RotorObserver{c}, Error);
}

}  // namespace
}  // namespace imrig::est
