// Eccentricity, torsion, sticking friction and interbar currents against their circuits and oscillators.

#include <gtest/gtest.h>

#include <cstdio>
#include <memory>
#include <vector>

#include "plant/effects/coupling_torsion.h"
#include "plant/effects/eccentricity.h"
#include "plant/effects/interbar_current.h"
#include "plant/effects/stick_slip.h"
#include "plant/powers.h"
#include "tests/plant/spectrum.h"

namespace imrig::plant {
namespace {

using namespace bench;

// What of the energy that came in is neither heat nor stored after a start-up, as a share of it.
double left_over(const std::shared_ptr<const Effect>& effect) {
  PlantConfig c = config();
  c.integrator.kind = IntegratorConfig::Kind::kRk4;
  c.sample_time_ns = 10'000, c.pwm_time_ns = 240'000;
  c.effects = {effect};
  Plant plant(c);
  plant.set_excitation({60.0, 1.0, true, 0.0, 0.0});
  const Supply supply{60.0, 179.6, 0.05};
  const double h = sample_s(plant);
  double in_J = 0.0, heat_J = 0.0;
  const auto heat_W = [](const Powers& p) {
    return p.stator_copper_W + p.rotor_copper_W + p.drag_W + p.coupling_W + p.field_copper_W + p.armature_W +
           p.load_W;
  };
  Powers last = plant.powers();
  Observed before = plant.state();
  while (plant.index() < 100000) {
    plant.step(supply.at(plant));
    const Observed& now = plant.state();
    in_J += h * (power_W(now.v_s, 0.5 * (now.i_s + before.i_s)) +
                 now.field_V * 0.5 * (now.field_A + before.field_A));
    const Powers p = plant.powers();
    heat_J += 0.5 * h * (heat_W(p) + heat_W(last));
    last = p, before = now;
  }
  EXPECT_GT(last.kinetic_J, 300.0);
  return (in_J - heat_J - last.magnetic_J - last.kinetic_J - last.generator_J) / in_J;
}

struct Sidebands {
  double base, below, above;
};

Sidebands sidebands(const Eccentricity::Config& config) {
  PlantConfig c = held_speed(1440.0);  // f_r = 24 Hz
  c.effects = {std::make_shared<Eccentricity>(config)};
  Plant plant(c);
  const Supply supply{50.0, 150.0};
  run(plant, supply, 4.0);
  const int n = 16667;
  Line base(50.0, 60e-6, n), below(26.0, 60e-6, n), above(74.0, 60e-6, n);
  for (int k = 0; k < n; ++k) {
    plant.step(supply.at(plant));
    const Complex i = plant.state().i_s;
    base.add(i), below.add(i), above.add(i);
  }
  return {base.amplitude(), below.amplitude(), above.amplitude()};
}

TEST(Eccentricity, ShowsLinesAtTheShaftsDistanceWhenStaticAndDynamicMeetOnly) {
  for (const Eccentricity::Config& one : {Eccentricity::Config{0.2, 0.0}, Eccentricity::Config{0.0, 0.2}}) {
    const Sidebands s = sidebands(one);
    EXPECT_LT(s.below, 1e-5 * s.base);
    EXPECT_LT(s.above, 1e-5 * s.base);
  }
  // Both: to first order a current q_1/2 psi enters at w +- w_r, and the short-circuited motor answers.
  const double e_s = 0.1, e_d = 0.05;
  const Sidebands s = sidebands({e_s, e_d});
  const double w = 2.0 * kPi * 50.0, w_r = 2.0 * kPi * 24.0, q_1 = e_s * e_d / kM;
  const Complex I_s = 150.0 / motor_impedance(kRs, w, 0.04);
  const Complex I_r = -kJ * 0.04 * w * kM * I_s / (kRrT + kJ * 0.04 * w * kL);
  const Complex gap = 0.5 * (kL + kM) * (I_s + I_r);
  for (const double sign : {-1.0, 1.0}) {
    const double v = w + sign * w_r, v_2 = v - kPolePairs * w_r;
    const Complex enters = 0.25 * q_1 * gap;  // into stator and rotor alike
    // psi = L (i - enters) in both windings; R i + j v psi = 0.
    const Complex a = kRs + kJ * v * kL, b = kJ * v * kM, x = kJ * v_2 * kM, y = kRrT + kJ * v_2 * kL;
    const Complex r_1 = kJ * v * (kL + kM) * enters, r_2 = kJ * v_2 * (kL + kM) * enters;
    const double expected = std::abs((r_1 * y - b * r_2) / (a * y - b * x));
    const double found = sign < 0.0 ? s.below : s.above;
    EXPECT_NEAR(found, expected, 0.03 * expected) << sign;
    EXPECT_GT(found, 1e-4 * s.base);
  }
  std::printf("eccentricity 0.1 static, 0.05 dynamic: f - f_r %.2e, f + f_r %.2e of the fundamental\n",
              s.below / s.base, s.above / s.base);
}

TEST(Eccentricity, MakesNoEnergy) {
  const double rest = left_over(std::make_shared<Eccentricity>(Eccentricity::Config{0.4, 0.3}));
  std::printf("eccentric start-up: %.1e of the energy left over\n", rest);
  EXPECT_NEAR(rest, 0.0, 3e-5);
}

constexpr CouplingTorsion::Config kShaft{800.0, 0.1, 0.02};

TEST(CouplingTorsion, RingsAgainstAHeldMotorAsItsOscillatorSays) {
  PlantConfig c = held_speed(100.0);
  c.effects = {std::make_shared<CouplingTorsion>(kShaft)};
  Plant plant(c);
  const double k = kShaft.stiffness_Nm, d = kShaft.damping_Nms, J = kShaft.generator_J_kgm2;
  const double w_0 = std::sqrt(k / J), sigma = 0.5 * d / J, w_d = std::sqrt(w_0 * w_0 - sigma * sigma);
  const double speed = rad_s_of_rpm(100.0);
  for (int n = 1; n <= 5000; ++n) {
    plant.step({});
    const double t = n * 60e-6, decay = speed * std::exp(-sigma * t);
    const double twist = decay / w_d * std::sin(w_d * t);
    const double rate = decay * (std::cos(w_d * t) - sigma / w_d * std::sin(w_d * t));
    ASSERT_NEAR(plant.state().transducer_Nm, k * twist + d * rate, 1e-3) << n;
  }
}

TEST(CouplingTorsion, RingsFreelyAtTheFrequencyAndDampingOfTheTwoMasses) {
  PlantConfig c = config();
  c.integrator.kind = IntegratorConfig::Kind::kRk4;
  c.generator.coupled = false;
  c.mechanics.J_kgm2 = 0.027;
  c.effects = {std::make_shared<CouplingTorsion>(kShaft)};
  Plant plant(c);
  run(plant, {50.0, 150.0}, 0.05);
  hold(plant, {}, 0.01);  // until the stator's current is gone: no torque from here on
  std::vector<double> torque;
  for (int n = 0; n < 1000; ++n) plant.step({}), torque.push_back(plant.state().transducer_Nm);
  const double inverse_J = 1.0 / 0.027 + 1.0 / 0.02, sigma = 0.5 * kShaft.damping_Nms * inverse_J;
  const double w_d = std::sqrt(kShaft.stiffness_Nm * inverse_J - sigma * sigma);
  // A sampled damped oscillation: x_(n+1) = 2 exp(-sigma h) cos(w_d h) x_n - exp(-2 sigma h) x_(n-1).
  const int stride = 50;
  const double h = stride * 60e-6, a = 2.0 * std::exp(-sigma * h) * std::cos(w_d * h),
               b = std::exp(-2.0 * sigma * h);
  double most = 0.0, worst = 0.0;
  for (std::size_t n = stride; n + stride < torque.size(); ++n) {
    most = std::max(most, std::abs(torque[n]));
    worst = std::max(worst, std::abs(torque[n + stride] - a * torque[n] + b * torque[n - stride]));
  }
  std::printf("free shaft rings at %.2f Hz, off its oscillation by %.1e\n", w_d / (2.0 * kPi), worst / most);
  EXPECT_GT(most, 1.0);
  EXPECT_LT(worst, 1e-4 * most);
}

TEST(CouplingTorsion, IsTheRigidShaftWhereItIsStiff) {
  const auto speed = [](bool torsion) {
    PlantConfig c = config();
    c.integrator.kind = IntegratorConfig::Kind::kRk4;
    c.mechanics.J_kgm2 = torsion ? 0.027 : 0.047;
    if (torsion) c.effects = {std::make_shared<CouplingTorsion>(CouplingTorsion::Config{2e5, 10.0, 0.02})};
    Plant plant(c);
    plant.set_excitation({60.0, 1.0, true, 0.0, 0.0});
    run(plant, {60.0, 170.0, 0.1}, 1.5);
    return plant.state().speed_rpm;
  };
  const double rigid = speed(false);
  EXPECT_GT(rigid, 1500.0);
  EXPECT_NEAR(speed(true), rigid, 0.01);
}

TEST(CouplingTorsion, MakesNoEnergyAndItsDampingIsHeatOfTheBalance) {
  for (const double damping : {0.0, 0.1, 5.0}) {
    const double rest =
        left_over(std::make_shared<CouplingTorsion>(CouplingTorsion::Config{800.0, damping, 0.02}));
    std::printf("start-up with a torsional shaft, damping %g Nm s: %.1e of the energy left over\n", damping,
                rest);
    EXPECT_NEAR(rest, 0.0, 3e-5) << damping;
  }
}

// Twisted and let go with the motor held: all that the spring and the load's inertia held becomes its heat.
TEST(CouplingTorsion, TurnsASwingIntoHeatOfItsDamping) {
  PlantConfig c = held_speed(100.0);
  c.effects = {std::make_shared<CouplingTorsion>(CouplingTorsion::Config{800.0, 2.0, 0.02})};
  Plant plant(c);
  const double w = rad_s_of_rpm(100.0);
  double heat_J = 0.0, last_W = plant.powers().coupling_W;
  EXPECT_NEAR(last_W, 2.0 * w * w, 1e-9);
  for (int k = 0; k < 20000; ++k) {
    plant.step({});
    const Powers p = plant.powers();
    EXPECT_EQ(p.coupling_W, p.friction_W);
    heat_J += 0.5 * sample_s(plant) * (p.coupling_W + last_W);
    last_W = p.coupling_W;
  }
  EXPECT_NEAR(heat_J, 0.5 * 0.02 * w * w, 1e-3 * heat_J);  // seen from the turning motor
}

TEST(StickSlip, FallsFromBreakAwayToCoulomb) {
  const StickSlip bearing({1.0, 0.4, 2.0, 0.02});
  const auto torque = [&](double w) {
    Conditions at;
    at.w_mech = w;
    double T = 0.0;
    bearing.drag(at, nullptr, T);
    return T;
  };
  EXPECT_EQ(torque(0.0), 0.0);
  EXPECT_NEAR(torque(0.2), 0.4 + 0.6 * std::exp(-0.01), 0.006);
  EXPECT_NEAR(torque(2.0), 0.4 + 0.6 * std::exp(-1.0), 1e-4);
  EXPECT_NEAR(torque(-50.0), -0.4, 1e-6);
}

TEST(StickSlip, HoldsTheShaftBelowBreakAwayAndLetsItGoAbove) {
  const auto turned = [](double volts) {
    PlantConfig c = config();
    c.generator.coupled = false;
    c.effects = {std::make_shared<StickSlip>(StickSlip::Config{1.0, 0.4, 2.0, 0.02})};
    Plant plant(c);
    run(plant, {10.0, volts, 0.5}, 2.0);
    return plant.state();
  };
  const Observed held = turned(6.0);
  ASSERT_GT(held.torque_Nm, 0.1);
  ASSERT_LT(held.torque_Nm, 0.9);
  EXPECT_NEAR(held.w_mech_rad_s, 0.02 * held.torque_Nm / std::sqrt(1.0 - held.torque_Nm * held.torque_Nm),
              0.02 * held.w_mech_rad_s);
  EXPECT_GT(turned(20.0).w_mech_rad_s, 20.0);
}

TEST(StickSlip, StopsACoastingShaftInTheTimeOfItsCoulombTorque) {
  PlantConfig c = config();
  c.generator.coupled = false;
  c.effects = {std::make_shared<StickSlip>(StickSlip::Config{2.0, 2.0, 2.0, 0.02})};
  Plant plant(c);
  run(plant, {20.0, 60.0, 0.2}, 1.0);
  hold(plant, {}, 0.01);
  const double w = plant.state().w_mech_rad_s;
  ASSERT_GT(w, 40.0);
  hold(plant, {}, 0.5);
  EXPECT_NEAR(plant.state().w_mech_rad_s, w - 2.0 / 0.047 * std::llround(0.5 / 60e-6) * 60e-6, 1e-4);
  hold(plant, {}, 2.0);
  EXPECT_LT(std::abs(plant.state().w_mech_rad_s), 1e-6);
}

TEST(InterbarCurrent, AddsTheImpedanceOfItsShuntedLeakage) {
  const double L_x = 0.0015, R_x = 0.6;
  for (const double slip : {1.0, 0.4, 0.04}) {
    PlantConfig c = held_speed(1500.0 * (1.0 - slip));
    c.effects = {std::make_shared<InterbarCurrent>(InterbarCurrent::Config{L_x, R_x})};
    Plant plant(c);
    const Supply supply{50.0, 60.0};
    run(plant, supply, 3.0);
    Line current(50.0, 60e-6, 16667);
    double heat_W = 0.0;
    for (int k = 0; k < 16667; ++k) {
      plant.step(supply.at(plant));
      current.add(plant.state().i_s);
      heat_W += plant.powers().rotor_copper_W / 16667;
    }
    const double w = 2.0 * kPi * 50.0, w_s = slip * w;
    const Complex Z_x = kJ * w_s * L_x * R_x / (R_x + kJ * w_s * L_x);
    const Complex rotor = kRrT + Z_x + kJ * w_s * (kL - L_x);
    const Complex Z = kRs + kJ * w * kL + slip * w * w * kM * kM / rotor;
    const Complex I_s = supply.fundamental_V(plant) / Z, I_r = -kJ * w_s * kM * I_s / rotor;
    EXPECT_NEAR(current.amplitude(), std::abs(I_s), 3e-4 * std::abs(I_s)) << slip;
    const double expected_W = 1.5 * std::norm(I_r) * (kRrT + Z_x.real());
    EXPECT_NEAR(heat_W, expected_W, 1e-3 * expected_W) << slip;
  }
}

TEST(InterbarCurrent, MakesNoEnergy) {
  const double rest = left_over(std::make_shared<InterbarCurrent>(InterbarCurrent::Config{0.0015, 0.6}));
  std::printf("start-up with interbar currents: %.1e of the energy left over\n", rest);
  EXPECT_NEAR(rest, 0.0, 3e-5);
}

}  // namespace
}  // namespace imrig::plant
