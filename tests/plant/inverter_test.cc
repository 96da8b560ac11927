// Averaged and switching inverter, dead time and DC link against their sums and against each other.

#include <gtest/gtest.h>

#include <cstdio>
#include <memory>
#include <vector>

#include "plant/dc_link.h"
#include "plant/effects/inverter_dead_time.h"
#include "plant/switching_inverter.h"
#include "tests/plant/spectrum.h"

namespace imrig::plant {
namespace {

using namespace bench;

std::shared_ptr<InverterDeadTime> dead(double dead_time_s, double drop_V, double drop_ohm, double width_A) {
  return std::make_shared<InverterDeadTime>(InverterDeadTime::Config{dead_time_s, drop_V, drop_ohm, width_A});
}

TEST(DeadTime, GivesASinusoidalCurrentTheHarmonicsOfSquareWaves) {
  const auto effect = dead(4e-6, 1.2, 0.0, 1e-4);
  const double step_V = 400.0 * 4e-6 / 240e-6 + 1.2;
  const int n = 60000;
  std::vector<Line> lines;
  const int orders[] = {1, -5, 7, -11, 13, 5, -7, 3};
  for (const int order : orders) lines.emplace_back(order, 1.0 / n, n);
  Conditions at;
  at.dc_link_V = 400.0, at.cycle_s = 240e-6;
  for (int k = 0; k < n; ++k) {
    at.i.s = std::polar(10.0, 2.0 * kPi * (k + 0.25) / n);
    Complex v = 0.0;
    effect->applied_voltage(at, nullptr, v);
    for (Line& line : lines) line.add(v);
  }
  for (const std::size_t k : {0u, 1u, 2u, 3u, 4u}) {
    const double expected = 4.0 / kPi * step_V / std::abs(orders[k]);
    EXPECT_NEAR(lines[k].amplitude(), expected, 2e-3 * expected) << orders[k];
  }
  for (const std::size_t k : {5u, 6u, 7u}) EXPECT_LT(lines[k].amplitude(), 1e-3) << orders[k];
}

TEST(DeadTime, TakesFourThirdsOfAStepAndTheResistanceUnderDirectCurrent) {
  PlantConfig c = held_speed(0.0);
  c.effects = {dead(3e-6, 1.0, 0.05, 0.05)};
  Plant plant(c);
  hold(plant, command(16.0), 8.0);
  const double i = (16.0 - 4.0 / 3.0 * (5.0 + 1.0)) / (kRs + 0.05);
  EXPECT_NEAR(plant.state().i_s.real(), i, 1e-3);
}

TEST(Modulator, ReachesTheCircleUnclippedAndTheHexagonsNearestPointBeyond) {
  for (double angle = 0.0; angle < 6.3; angle += 0.05) {
    const Complex inside = std::polar(230.0, angle);
    const auto d = duties(inside, 400.0);
    EXPECT_NEAR(std::abs(400.0 * space_vector(d[0], d[1], d[2]) - inside), 0.0, 1e-12);
  }
  EXPECT_EQ(within_hexagon({100.0, 20.0}, 400.0), Complex(100.0, 20.0));
  // Straight on a corner: 2/3 V_dc; straight on a side: the circle's radius.
  EXPECT_NEAR(std::abs(within_hexagon(500.0, 400.0) - 800.0 / 3.0), 0.0, 1e-12);
  EXPECT_NEAR(
      std::abs(within_hexagon(std::polar(500.0, kPi / 6.0), 400.0) - std::polar(400.0 / kSqrt3, kPi / 6.0)),
      0.0, 1e-12);
  // Beside the side's middle the nearest point is the foot of the perpendicular.
  const Complex along = std::polar(1.0, kPi / 6.0), aside = 30.0 * kJ * along;
  EXPECT_NEAR(std::abs(within_hexagon(300.0 * along + aside, 400.0) - (400.0 / kSqrt3 * along + aside)), 0.0,
              1e-12);
}

TEST(DcLink, ChargesThroughItsResistanceAndBlocksAboveTheSource) {
  InverterConfig c;
  c.source_ohm = 0.5, c.capacitor_F = 1e-3;
  DcLink link(c);
  // A constant power from a charged link: the source gives i = (e - v)/R in the end.
  for (int k = 0; k < 20000; ++k) link.step(k * 60e-6, 60e-6, 2000.0);
  EXPECT_NEAR(link.voltage_V(), 0.5 * (400.0 + std::sqrt(160000.0 - 4.0 * 0.5 * 2000.0)), 1e-6);
  // Power that comes back meets a blocked rectifier: C v^2/2 grows by it.
  double start_J = -1.0;
  int n = 0;
  for (int k = 0; k < 2000; ++k) {
    link.step(0.0, 60e-6, -500.0);
    if (start_J < 0.0 && link.voltage_V() > 400.0)
      start_J = 0.5e-3 * link.voltage_V() * link.voltage_V();
    else if (start_J >= 0.0)
      ++n;
  }
  EXPECT_NEAR(0.5e-3 * link.voltage_V() * link.voltage_V() - start_J, 500.0 * n * 60e-6, 0.02);
  EXPECT_GT(n, 1500);
}

TEST(DcLink, SagsRipplesAndIsBraked) {
  InverterConfig c;
  c.source_ohm = 2.0, c.ripple_V = 10.0, c.ripple_Hz = 300.0;
  DcLink link(c);
  link.step(0.0, 60e-6, 3000.0);
  const double v = link.voltage_V();
  EXPECT_NEAR(v, 410.0 - 2.0 * 3000.0 / v, 1e-9);
  link.step(1.0 / 600.0, 60e-6, 0.0);
  EXPECT_NEAR(link.voltage_V(), 390.0, 1e-9);
  c.brake_V = 420.0;
  DcLink braked(c);
  braked.step(0.0, 60e-6, -1e5);
  EXPECT_EQ(braked.voltage_V(), 420.0);
}

TEST(DcLink, IsFeltInTheVoltageUnlessTheDutiesFollowIt) {
  for (const bool compensated : {false, true}) {
    PlantConfig c = held_speed(0.0);
    c.inverter.ripple_V = 20.0, c.inverter.ripple_Hz = 250.0, c.inverter.link_compensated = compensated;
    Plant plant(c);
    double least = 1e9, most = 0.0;
    for (int k = 0; k < 2000; ++k) {
      plant.step(command(100.0));
      least = std::min(least, plant.state().v_mean.real()),
      most = std::max(most, plant.state().v_mean.real());
    }
    EXPECT_NEAR(most, compensated ? 100.0 : 105.0, 1e-3);
    EXPECT_NEAR(least, compensated ? 100.0 : 95.0, 0.01);
  }
}

struct Trace {
  std::vector<Complex> i, v;  // at the ends of cycles; mean over the cycle
  std::vector<double> rpm;
};

Trace start(InverterConfig::Kind kind, std::int64_t carrier_ns,
            const std::vector<std::shared_ptr<const Effect>>& effects,
            IntegratorConfig::Kind integrator = IntegratorConfig::Kind::kRk4) {
  PlantConfig c = config();
  c.integrator.kind = integrator;
  c.inverter.kind = kind, c.inverter.carrier_ns = carrier_ns;
  c.inverter.limit = InverterConfig::Limit::kHexagon;
  c.effects = effects;
  Plant plant(c);
  plant.set_excitation({60.0, 1.0, true, 0.0, 0.0});
  Trace trace;
  InverterCommand held;
  Complex v = 0.0;
  for (int k = 0; k < 12000; ++k) {
    const double t = (k + 2) * 60e-6;
    if (k % 4 == 0) held = command(std::polar(179.6 * std::min(1.0, t / 0.1), 2.0 * kPi * 60.0 * t));
    plant.step(held);
    v += 0.25 * plant.state().v_mean;
    if (k % 4 != 3) continue;
    trace.i.push_back(plant.state().i_s), trace.v.push_back(v), trace.rpm.push_back(plant.state().speed_rpm);
    v = 0.0;
  }
  return trace;
}

struct Apart {
  double rms_A = 0.0, most_V = 0.0, most_rpm = 0.0;
};

Apart apart(const Trace& a, const Trace& b) {
  Apart d;
  for (std::size_t k = 0; k < a.i.size(); ++k) {
    d.rms_A += std::norm(a.i[k] - b.i[k]) / static_cast<double>(a.i.size());
    d.most_V = std::max(d.most_V, std::abs(a.v[k] - b.v[k]));
    d.most_rpm = std::max(d.most_rpm, std::abs(a.rpm[k] - b.rpm[k]));
  }
  d.rms_A = std::sqrt(d.rms_A);
  return d;
}

TEST(SwitchingInverter, HasTheAveragedInverterAsItsMean) {
  const Trace averaged = start(InverterConfig::Kind::kAveraged, 0, {});
  const Apart d = apart(start(InverterConfig::Kind::kSwitching, 0, {}), averaged);
  std::printf("switching from averaged at the cycles' ends: %.4f A rms, %.1e V, %.3f rpm\n", d.rms_A,
              d.most_V, d.most_rpm);
  EXPECT_GT(averaged.rpm.back(), 1500.0);
  EXPECT_LT(d.most_V, 1e-9);
  EXPECT_LT(d.rms_A, 0.05);
  EXPECT_LT(d.most_rpm, 0.5);
  // What is left is the ripple's doing: it goes with the square of the cycle.
  const Apart fast = apart(start(InverterConfig::Kind::kSwitching, 60'000, {}), averaged);
  EXPECT_LT(fast.rms_A, 0.2 * d.rms_A);
  EXPECT_LT(fast.most_rpm, 0.2 * d.most_rpm);
}

TEST(SwitchingInverter, LosesToDeadTimeWhatTheAverageSays) {
  const double width_A = 0.5;  // about the ripple
  const Trace ideal = start(InverterConfig::Kind::kSwitching, 0, {});
  const Trace averaged = start(InverterConfig::Kind::kAveraged, 0, {dead(4e-6, 0.0, 0.0, width_A)});
  const Trace switching = start(InverterConfig::Kind::kSwitching, 0, {dead(4e-6, 0.0, 0.0, width_A)});
  const Apart without = apart(ideal, averaged), with = apart(switching, averaged);
  std::printf("dead time 4 us: ideal from averaged %.3f A rms, switching from averaged %.3f A rms\n",
              without.rms_A, with.rms_A);
  EXPECT_GT(without.rms_A, 1.0);
  EXPECT_LT(with.rms_A, 0.1 * without.rms_A);
}

TEST(SwitchingInverter, DoesNotDependOnTheIntegrator) {
  const auto effect = dead(4e-6, 1.0, 0.02, 0.5);
  const Apart d =
      apart(start(InverterConfig::Kind::kSwitching, 0, {effect}),
            start(InverterConfig::Kind::kSwitching, 0, {effect}, IntegratorConfig::Kind::kSundials));
  std::printf("switching, RK4 from ERKStep: %.1e A rms, %.1e rpm\n", d.rms_A, d.most_rpm);
  EXPECT_LT(d.rms_A, 1e-3);
  EXPECT_LT(d.most_rpm, 0.01);
}

// At standstill with a small direct voltage u along a the legs are high for T (1 +- 3u/(2 V))/2 ... : the
// vector is (2/3) V for the share 3u/(2V) of the cycle, in two equal parts, and zero otherwise. Over each
// zero part of length T (1 - 3u/(2V))/2 the current falls by u/L_l times its length.
TEST(SwitchingInverter, LetsTheCurrentRippleAsTheLeakageSaysAndTheConvertersSeeIt) {
  for (const std::int64_t carrier_ns : {240'000, 50'000}) {
    PlantConfig c = held_speed(0.0);
    c.sample_time_ns = 10'000, c.pwm_time_ns = 240'000 / 24 * 24;
    c.inverter.kind = InverterConfig::Kind::kSwitching, c.inverter.carrier_ns = carrier_ns;
    c.sensors.current_range_A = 100.0;
    Plant plant(c);
    const double u = 20.0, T = static_cast<double>(carrier_ns) * 1e-9;
    hold(plant, command(u), 6.0);
    double least = 1e9, most = 0.0;
    for (int k = 0; k < 3000; ++k) {
      const RawSample raw = plant.step(command(u));
      const double i = raw.i[0] * plant.scale().current_A_per_count;
      least = std::min(least, i), most = std::max(most, i);
    }
    // Two ripples a cycle. Sampled every 10 us, the peaks are missed by less than the slope over 10 us.
    const double zero_s = 0.5 * T * (1.0 - 1.5 * u / 400.0), swing = u / kLl * zero_s;
    EXPECT_NEAR(0.5 * (least + most), u / kRs, 0.15 * swing);
    if (carrier_ns == 240'000) {
      EXPECT_NEAR(most - least, swing, 0.35 * swing);
    } else {
      EXPECT_LT(most - least, 1.05 * swing);
      EXPECT_GT(most - least, 0.5 * swing);
    }
  }
}

// The converters sample in the middle of the zero vectors at the cycle's start and middle: there the current
// is the mean one.
TEST(SwitchingInverter, ShowsTheMeanCurrentAtTheCyclesStartAndMiddle) {
  PlantConfig c = held_speed(0.0);
  c.inverter.kind = InverterConfig::Kind::kSwitching;
  Plant plant(c);
  hold(plant, command(40.0), 6.0);
  double sample[4] = {};
  for (int k = 0; k < 4; ++k) {
    plant.step(command(40.0));
    sample[k] = plant.state().i_s.real();  // at 60, 120, 180, 240 us
  }
  EXPECT_NEAR(sample[1], 40.0 / kRs, 2e-3);
  EXPECT_NEAR(sample[3], 40.0 / kRs, 2e-3);
}

TEST(SwitchingInverter, GoesOffAndOnWithinACycle) {
  PlantConfig c = config();
  c.inverter.kind = InverterConfig::Kind::kSwitching;
  c.effects = {dead(4e-6, 1.0, 0.01, 0.2)};
  c.sensors.clock_jitter_s = 2e-6, c.sensors.clock_ppm = 50.0;
  Plant plant(c);
  for (int k = 0; k < 20000; ++k) {
    plant.step(k % 1003 < 700 ? Supply{60.0, 150.0}.at(plant) : InverterCommand{});
    ASSERT_TRUE(std::isfinite(plant.state().speed_rpm));
    ASSERT_LT(std::abs(plant.state().v_s), 700.0);
    ASSERT_LT(std::abs(plant.state().i_s), 200.0);
  }
  EXPECT_GT(plant.state().speed_rpm, 500.0);
}

}  // namespace
}  // namespace imrig::plant
