// The library of effects as a whole, and each law against what it must be.

#include <ceres/jet.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>
#include <string>

#include "estimators/model/effects/effect_machine.h"
#include "estimators/model/effects/registry.h"

namespace imrig::est {
namespace {

using Complex = std::complex<double>;

SharedVector<double> neutral() {
  SharedVector<double> p{0.39, 0.22, 0.006, 0.068};
  for (std::size_t e = kBase; e < kShared; ++e) p[e] = shared_parameter(e).neutral;
  return p;
}

std::size_t entry(const std::string& name) {
  for (std::size_t e = 0; e < kShared; ++e) {
    if (shared_name(e) == name) return e;
  }
  ADD_FAILURE() << name;
  return 0;
}

EffectState<double> state(Complex psi_s, Complex psi_r, Complex i_b = 0.0) {
  return {Cx<double>(psi_s), Cx<double>(psi_r), Cx<double>(i_b)};
}

Instant instant() {
  Instant at;
  at.w_k = 310.0;
  at.turn = std::polar(1.0, 0.7);
  at.rotor_turn = std::polar(1.0, -0.4);
  at.voltage_rate = {1000.0, 40000.0};
  at.stator_C = 61.0;
  return at;
}

TEST(Effects, NamesAreUniqueAndEveryOneExplainsItself) {
  std::set<std::string> names;
  for (const EffectInfo& info : kEffectInfos) {
    EXPECT_TRUE(names.insert(info.name).second) << info.name;
    EXPECT_GT(std::string(info.sentence).size(), 20u) << info.name;
    EXPECT_FALSE(std::string(info.equation).empty()) << info.name;
    EXPECT_FALSE(std::string(info.source).empty()) << info.name;
    EXPECT_FALSE(std::string(info.experiment).empty()) << info.name;
    EXPECT_FALSE(info.forms.empty()) << info.name;
    EXPECT_EQ(effect_number(info.name), names.size() - 1);
    for (const EffectForm& form : info.forms) {
      for (const std::size_t k : form.shared) EXPECT_LT(k, info.shared.size()) << info.name;
      EXPECT_TRUE(!form.local || !info.local.empty()) << info.name;
    }
  }
  EXPECT_EQ(kLibrary, 16u);
  EXPECT_EQ(names.size(), kLibrary + 1) << "and the torque sensor, a correction";
}

TEST(Effects, NeutralValuesLieInsideTheBoundsAndShapesAreScannedInsideThem) {
  for (std::size_t e = kBase; e < kShared; ++e) {
    const EffectParameter& p = shared_parameter(e);
    EXPECT_GT(p.scale, 0.0) << shared_name(e);
    const auto inside = [&](double x) { return p.low <= x && x <= p.high; };
    // A shape may be held outside, where it means nothing, until a form frees it.
    if (p.start != 0.0) {
      EXPECT_EQ(p.role, Role::kShape) << shared_name(e);
      EXPECT_TRUE(inside(p.start)) << shared_name(e);
      continue;
    }
    EXPECT_TRUE(inside(p.neutral)) << shared_name(e);
    for (const double x : p.scan) EXPECT_TRUE(inside(x)) << shared_name(e);
  }
}

TEST(Effects, WithoutAnyTheMachineIsTheBaseMachine) {
  const auto p = neutral();
  const EffectMachine<double> machine(p, neutral_local());
  const BaseMachine<double> base({p[0], p[1], p[2], p[3]});
  const auto x = state({0.41, -0.12}, {0.38, -0.15});
  const FluxState<double> y{x.psi_s, x.psi_r};
  const Complex v(120.0, 90.0);
  const auto d = machine.derivative(x, v, 290.0, instant());
  const auto e = base.derivative(y, v, 290.0, 310.0);
  EXPECT_NEAR(d.psi_s.re, e.psi_s.re, 1e-11 * std::abs(v));
  EXPECT_NEAR(d.psi_s.im, e.psi_s.im, 1e-11 * std::abs(v));
  EXPECT_NEAR(d.psi_r.re, e.psi_r.re, 1e-11 * std::abs(v));
  EXPECT_NEAR(d.psi_r.im, e.psi_r.im, 1e-11 * std::abs(v));
  EXPECT_EQ(d.i_b.re, 0.0);
  const Complex i = plain(machine.measured_current(machine.inside(x, v, 290.0, instant()), instant()));
  EXPECT_LT(std::abs(i - plain(base.current(y))), 1e-12 * std::abs(i));
}

// Every effect at once, nothing at a round value.
SharedVector<double> everything() {
  auto p = neutral();
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> part(0.5, 1.5);
  for (std::size_t e = kBase; e < kShared; ++e) {
    const EffectParameter& q = shared_parameter(e);
    if (q.role == Role::kAmplitude) p[e] = q.neutral + 3.0 * part(random) * q.scale;
    if (q.role == Role::kShape)
      p[e] = std::clamp((q.start != 0.0 ? q.start : q.neutral) * part(random) + 0.1 * part(random), q.low,
                        q.high);
  }
  return p;
}

TEST(Effects, DerivativesByEveryParameterAreThoseOfDifferences) {
  using Jet = ceres::Jet<double, 1>;
  const auto p = everything();
  auto q = neutral_local();
  for (std::size_t e = kStates; e < kLocal; ++e) q[e] = 0.02;
  const auto x = state({0.41, -0.12}, {0.38, -0.15}, {0.7, -0.3});
  const Complex v(120.0, 90.0);
  const auto flat = [&](const SharedVector<double>& at) {
    const EffectMachine<double> machine(at, q);
    const auto d = machine.derivative(x, v, 290.0, instant());
    const auto i = machine.measured_current(machine.inside(x, v, 290.0, instant()), instant());
    const auto t = machine.shaft_torque_Nm(machine.inside(x, v, 290.0, instant()), x, 2);
    return std::array<double, 9>{d.psi_s.re, d.psi_s.im, d.psi_r.re, d.psi_r.im, d.i_b.re,
                                 d.i_b.im,   i.re,       i.im,       t};
  };
  for (std::size_t e = 0; e < kShared; ++e) {
    SharedVector<Jet> seeded;
    LocalVector<Jet> local;
    for (std::size_t k = 0; k < kShared; ++k) seeded[k] = Jet(p[k]);
    for (std::size_t k = 0; k < kLocal; ++k) local[k] = Jet(q[k]);
    seeded[e].v[0] = 1.0;
    const EffectMachine<Jet> machine(seeded, local);
    const EffectState<Jet> y{{Jet(x.psi_s.re), Jet(x.psi_s.im)},
                             {Jet(x.psi_r.re), Jet(x.psi_r.im)},
                             {Jet(x.i_b.re), Jet(x.i_b.im)}};
    const auto d = machine.derivative(y, v, 290.0, instant());
    const auto i = machine.measured_current(machine.inside(y, v, 290.0, instant()), instant());
    const auto t = machine.shaft_torque_Nm(machine.inside(y, v, 290.0, instant()), y, 2);
    const std::array<double, 9> exact{d.psi_s.re.v[0], d.psi_s.im.v[0], d.psi_r.re.v[0],
                                      d.psi_r.im.v[0], d.i_b.re.v[0],   d.i_b.im.v[0],
                                      i.re.v[0],       i.im.v[0],       t.v[0]};
    const double h = 1e-6 * std::max(std::abs(p[e]), 1e-3 * (e < kBase ? 1.0 : shared_parameter(e).scale));
    auto up = p, down = p;
    up[e] += h;
    down[e] -= h;
    const auto high = flat(up), low = flat(down);
    for (std::size_t k = 0; k < exact.size(); ++k) {
      const double difference = (high[k] - low[k]) / (2.0 * h);
      // Rounding of values of some hundred leaves 1e-13 / h.
      EXPECT_NEAR(exact[k], difference, 1e-5 * std::abs(exact[k]) + 2e-12 / h)
          << shared_name(e) << " output " << k;
    }
  }
}

// Integral of Re(i* dpsi) along a closed path in both fluxes.
double round_trip_J(const SharedVector<double>& p) {
  const EffectMachine<double> machine(p, neutral_local());
  constexpr int kSteps = 20000;
  const auto at = [](int k) {
    const double t = 2.0 * 3.14159265358979323846 * k / kSteps;
    return std::pair{Complex(0.5 * std::cos(t) + 0.1, 0.3 * std::sin(2.0 * t)),
                     Complex(0.35 * std::sin(t), 0.4 * std::cos(t) - 0.1)};
  };
  double work = 0.0;
  for (int k = 0; k < kSteps; ++k) {
    const auto [s0, r0] = at(k);
    const auto [s1, r1] = at(k + 1);
    const auto x = state(0.5 * (s0 + s1), 0.5 * (r0 + r1));
    Instant still;
    const auto in = machine.inside(x, 0.0, 0.0, still);
    work += (std::conj(plain(in.i)) * (s1 - s0)).real() - (std::conj(plain(in.i_rotor)) * (r1 - r0)).real();
  }
  return work;
}

TEST(Effects, SaturatedFluxesGiveNoWorkOnARoundTrip) {
  for (const double place : {0.0, 0.3, 1.0}) {
    auto p = neutral();
    p[entry("magnetizing_saturation.extra")] = 0.8;
    p[entry("magnetizing_saturation.exponent")] = 5.0;
    p[entry("magnetizing_saturation.place")] = place;
    p[entry("magnetizing_saturation.bend")] = 0.5;
    p[entry("leakage_saturation.extra")] = 0.6;
    p[entry("leakage_saturation.rotor_share")] = place;
    // Of some 20 J that go in and out; the path's own steps leave less than 1e-6 of them.
    EXPECT_NEAR(round_trip_J(p), 0.0, 1e-4) << place;
  }
}

TEST(Effects, BothFluxesOfASaturatedMachineMakeTheSameTorque) {
  auto p = neutral();
  p[entry("magnetizing_saturation.extra")] = 0.8;
  p[entry("magnetizing_saturation.place")] = 0.4;
  p[entry("leakage_saturation.extra")] = 0.6;
  p[entry("leakage_saturation.rotor_share")] = 0.7;
  const EffectMachine<double> machine(p, neutral_local());
  const auto x = state({0.41, -0.12}, {0.33, -0.25});
  const auto in = machine.inside(x, {100.0, 20.0}, 300.0, instant());
  const double by_stator = airgap_torque_Nm(2, x.psi_s, in.i);
  EXPECT_NEAR(machine.shaft_torque_Nm(in, x, 2), by_stator, 1e-10 * std::abs(by_stator));
}

TEST(Effects, TheBarsTwoLayersAreRrAtRestAndRiseFarAboveTheCorner) {
  auto p = neutral();
  const double rise = 1.5, corner = 100.0;
  p[entry("rotor_skin_effect.rise")] = rise;
  p[entry("rotor_skin_effect.corner_rad_s")] = corner;
  const EffectMachine<double> machine(p, neutral_local());
  for (const double w : {0.0, 30.0, 100.0, 1000.0, 1e6}) {
    // The layer's steady current at slip frequency w, and the drop it leaves, in the rotor's frame.
    const auto y = state({0.2, 0.1}, {0.15, 0.12});
    Instant at;
    at.w_k = 0.0;
    const Complex i = plain(machine.inside(y, 0.0, 0.0, at).i_rotor);
    const Complex i_b = corner * rise * i / Complex(corner * (1.0 + rise), w);
    const auto d = machine.derivative(state({0.2, 0.1}, {0.15, 0.12}, i_b), 0.0, 0.0, at);
    EXPECT_LT(std::abs(plain(d.i_b) - Complex(0.0, w) * i_b), 1e-8 * (1.0 + std::abs(w * i_b))) << w;
    const Complex impedance = plain(d.psi_r) / i;
    // Two branches side by side: R_u and R_b + j w L_b, R_u = R_r (1 + rise), R_b = R_u / rise, L_b = R_b /
    // corner.
    const double R_u = p[1] * (1.0 + rise), R_b = R_u / rise;
    const Complex bottom(R_b, w * R_b / corner);
    const Complex both = R_u * bottom / (R_u + bottom);
    EXPECT_LT(std::abs(impedance - both), 1e-9) << w;
  }
}

// Resistances h times as large, the slot's leakage as it was: Z(w) of the warm bar is h Z(w / h) of the cold one.
TEST(Effects, AWarmBarsCornerRisesWithItsResistance) {
  const double rise = 1.5, corner = 100.0, h = 1.2, w = 150.0;
  const auto impedance = [&](double warmth, double slip_rad_s) {
    auto p = neutral();
    p[entry("rotor_skin_effect.rise")] = rise;
    p[entry("rotor_skin_effect.corner_rad_s")] = corner;
    auto local = neutral_local();
    local[kLocalPlace[*effect_number("rotor_heating")]] = warmth - 1.0;
    const EffectMachine<double> machine(p, local);
    Instant at;
    at.w_k = 0.0;
    const Complex i = plain(machine.inside(state({0.2, 0.1}, {0.15, 0.12}), 0.0, 0.0, at).i_rotor);
    // The layer's rate is linear in its current: its steady current follows from two of them.
    const auto rate = [&](Complex i_b) {
      return machine.derivative(state({0.2, 0.1}, {0.15, 0.12}, i_b), 0.0, 0.0, at);
    };
    const Complex slope = plain(rate(1.0).i_b) - plain(rate(0.0).i_b);
    const Complex i_b = plain(rate(0.0).i_b) / (Complex(0.0, slip_rad_s) - slope);
    return plain(rate(i_b).psi_r) / i;
  };
  EXPECT_LT(std::abs(impedance(h, w) - h * impedance(1.0, w / h)), 1e-12);
  EXPECT_GT(std::abs(impedance(h, w) - h * impedance(1.0, w)), 1e-3);
}

// A fit may push the rise to zero, and back.
TEST(Effects, WithACurrentDeepInTheBarsNothingJumpsWhereTheRiseReachesZero) {
  const auto slope = [](double rise) {
    auto p = neutral();
    p[entry("rotor_skin_effect.rise")] = rise;
    auto local = neutral_local();
    local[4] = 12.0, local[5] = -7.0;
    const EffectMachine<double> machine(p, local);
    return plain(machine.derivative(state({0.2, 0.1}, {0.15, 0.12}, {12.0, -7.0}), {20.0, 5.0}, 300.0, instant()).psi_r);
  };
  EXPECT_GT(std::abs(slope(0.2) - slope(0.0)), 0.1);
  EXPECT_LT(std::abs(slope(1e-9) - slope(0.0)), 1e-7);
}

TEST(Effects, IronAtTheStatorTakesItsConductanceTimesTheEmf) {
  auto p = neutral();
  const auto bare_i = plain(EffectMachine<double>(p, neutral_local())
                                .inside(state({0.4, 0.0}, {0.38, -0.02}), {20.0, 140.0}, 300.0, instant())
                                .i);
  p[entry("core_loss.eddy_S")] = 2e-3;
  p[entry("core_loss.hysteresis_S_rad_s")] = 0.5;
  p[entry("core_loss.place")] = 0.0;
  const EffectMachine<double> machine(p, neutral_local());
  const auto in = machine.inside(state({0.4, 0.0}, {0.38, -0.02}), {20.0, 140.0}, 300.0, instant());
  const double G = 2e-3 + 0.5 / 310.0;
  EXPECT_LT(std::abs(plain(in.i) - bare_i - G * plain(in.e_s)), 1e-12);
}

// What a voltage lag makes of one volt that turns at `w`.
Complex led(double lag_s, double filter_s, double w) {
  const double p[] = {lag_s, filter_s};
  Instant at;
  at.w_k = w;
  at.voltage_rate = Complex(0.0, w);
  Cx<double> v{1.0, 0.0};
  VoltageLag<double>(p, nullptr).voltage(v, {}, at);
  return {v.re, v.im};
}

TEST(Effects, AVoltageLagsSecondOrderIsThatOfAFilterOrOfADelay) {
  constexpr double kLag_s = 4e-5, kFilter_s = 1.6e-4;
  for (const double w : {125.0, 314.0, -377.0}) {
    const Complex j(0.0, 1.0), slower = 1.0 + j * w * (kFilter_s + kLag_s), known = 1.0 + j * w * kFilter_s;
    EXPECT_LT(std::abs(led(kLag_s, kFilter_s, w) - slower / known), kLag_s * kFilter_s * kFilter_s * 6e7)
        << w;
    EXPECT_GT(std::abs(led(kLag_s, 0.0, w) - slower / known), 0.9 * w * w * kLag_s * kFilter_s) << w;
    EXPECT_LT(std::abs(led(kLag_s, -0.5 * kLag_s, w) - std::polar(1.0, w * kLag_s)), 1e-6) << w;
    EXPECT_EQ(led(kLag_s, 0.0, w), Complex(1.0, w * kLag_s)) << "a filter that nobody declared";
  }
}

TEST(Effects, ASpeedOffsetAndHysteresisAtTheRotorFluxAreOneAndTheSame) {
  // The twin that no electrical measurement separates: G = k/w at the rotor flux is a slip that is off by R_r
  // k.
  auto iron = neutral(), speed = neutral();
  const double k = 0.4;
  iron[entry("core_loss.hysteresis_S_rad_s")] = k;
  iron[entry("core_loss.place")] = 1.0;
  speed[entry("speed_bias.offset_rad_s")] = -iron[1] * k;
  const auto x = state({0.4, 0.05}, {0.38, -0.02});
  Instant at = instant();
  const double w_r = at.w_k - 2.0;
  const auto a = EffectMachine<double>(iron, neutral_local()).derivative(x, {20.0, 140.0}, w_r, at);
  const auto b = EffectMachine<double>(speed, neutral_local()).derivative(x, {20.0, 140.0}, w_r, at);
  EXPECT_LT(std::abs(plain(a.psi_r) - plain(b.psi_r)),
            2e-3);  // of 8 Wb/s that the slip makes, to first order in R_r k / w
}

}  // namespace
}  // namespace imrig::est
