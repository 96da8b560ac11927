// Eccentricity, torsion, sticking friction and interbar currents against their circuits and oscillators.

#include <gtest/gtest.h>

#include <cstdio>
#include <memory>
#include <vector>

#include "plant/effects/coupling_torsion.h"
#include "plant/effects/eccentricity.h"
#include "plant/effects/friction.h"
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
  const StickSlip bearing({1.0, 0.4, 2.0});
  const auto torque = [&](double w, Motion motion = Motion::kBySpeed) {
    Conditions at;
    at.w_mech = w, at.motion = motion;
    return bearing.drag_Nm(at, nullptr);
  };
  EXPECT_EQ(torque(0.0), 0.0);
  EXPECT_EQ(torque(0.0, Motion::kResting), 0.0);
  EXPECT_EQ(torque(0.0, Motion::kForward), 1.0);
  EXPECT_EQ(torque(0.0, Motion::kBackward), -1.0);
  EXPECT_NEAR(torque(2.0), 0.4 + 0.6 * std::exp(-1.0), 1e-12);
  EXPECT_NEAR(torque(-50.0), -0.4, 1e-12);
}

PlantConfig sticking(double break_away_Nm, double coulomb_Nm) {
  PlantConfig c = config();
  c.generator.coupled = false;
  c.effects = {std::make_shared<StickSlip>(StickSlip::Config{break_away_Nm, coulomb_Nm, 2.0})};
  return c;
}

void holds_below_break_away_and_lets_go_above(const std::shared_ptr<const Effect>& bearing) {
  ASSERT_EQ(bearing->break_away_Nm(), 1.0);
  for (const auto kind : {IntegratorConfig::Kind::kSundials, IntegratorConfig::Kind::kRk4}) {
    PlantConfig c = config();
    c.generator.coupled = false;
    c.effects = {bearing};
    c.integrator.kind = kind;
    Plant plant(c);
    const Supply low{10.0, 6.0, 0.5};
    while (plant.index() < 33333) {
      plant.step(low.at(plant));
      ASSERT_EQ(plant.state().w_mech_rad_s, 0.0);
      ASSERT_EQ(plant.state().angle_rad, 0.0);
      ASSERT_EQ(plant.state().drag_Nm, plant.state().torque_Nm);  // the friction holds the balance
    }
    ASSERT_GT(plant.state().torque_Nm, 0.1);
    Plant other(c);
    run(other, {10.0, 20.0, 0.5}, 2.0);
    EXPECT_GT(other.state().w_mech_rad_s, 20.0);
  }
}

TEST(StickSlip, HoldsTheShaftStillBelowBreakAwayAndLetsItGoAbove) {
  holds_below_break_away_and_lets_go_above(std::make_shared<StickSlip>(StickSlip::Config{1.0, 0.4, 2.0}));
}

TEST(Friction, HoldsTheShaftStillBelowItsCoulombTorqueAndLetsItGoAbove) {
  holds_below_break_away_and_lets_go_above(std::make_shared<Friction>(Friction::Config{1.0, 0.002}));
}

// A slow field pulls at the shaft with more than half of what its bearings hold; dead time takes 5 V of the second's.
TEST(Friction, LetsNoShippedPlantCreepAtStandstill) {
  for (const auto& [name, volts] : {std::pair("proca_5hp", 2.4), std::pair("proca_5hp_full", 7.6)}) {
    PlantConfig c = load_plant_config(std::string(IMRIG_SOURCE_DIR "/models/plants/") + name + ".toml");
    c.integrator.kind = IntegratorConfig::Kind::kRk4;
    Plant plant(c);
    const std::int32_t start = plant.step({}).encoder;
    double most_Nm = 0.0;
    for (int k = 0; k < 50000; ++k) {
      const RawSample raw = plant.step(command(std::polar(volts * std::min(1.0, k / 5000.0), 2.0 * kPi * 8.0 * k * sample_s(plant))));
      ASSERT_EQ(plant.state().w_mech_rad_s, 0.0) << name;
      ASSERT_EQ(raw.encoder, start) << name;
      most_Nm = std::max(most_Nm, plant.state().torque_Nm);
    }
    std::printf("%s: up to %.3f Nm\n", name, most_Nm);
    EXPECT_GT(most_Nm, 0.1) << name;
  }
}

// A sweep like the one that identifies a locked motor, with the shaft free: 5 to 120 Hz, either way round,
// at the volts that keep its torque below break-away.
TEST(StickSlip, LetsNoLockedLikeSweepMoveTheShaft) {
  PlantConfig c = sticking(1.0, 0.5);
  c.sensors.ideal = false;
  Plant plant(c);
  const double h = sample_s(plant);
  const std::int32_t start = plant.step({}).encoder;
  double phase = 0.0, most_A = 0.0, most_Nm = 0.0;
  for (double f = 5.0; f <= 120.0; f *= 1.5) {
    for (const double way : {1.0, -1.0}) {
      for (int k = 0; k < 12000; ++k) {
        phase += way * 2.0 * kPi * f * h;
        const double swell = std::sin(kPi * k / 12000.0);  // in and out
        const RawSample raw = plant.step(command(std::polar(swell * (2.0 + 0.18 * f), phase)));
        ASSERT_EQ(plant.state().w_mech_rad_s, 0.0) << f;
        ASSERT_EQ(plant.state().angle_rad, 0.0) << f;
        ASSERT_EQ(raw.encoder, start) << f;
        most_A = std::max(most_A, std::abs(plant.state().i_s));
        most_Nm = std::max(most_Nm, std::abs(plant.state().torque_Nm));
      }
    }
  }
  std::printf("locked-like sweep: up to %.2f A and %.3f Nm below 1 Nm of break-away\n", most_A, most_Nm);
  EXPECT_GT(most_A, 4.0);
  EXPECT_GT(most_Nm, 0.3);
}

// Uniform deceleration, then rest: the speed hits zero at w J/T_c and stays there to the last bit.
TEST(StickSlip, StopsACoastingShaftInTheTimeOfItsCoulombTorqueAndHoldsIt) {
  for (const auto kind : {IntegratorConfig::Kind::kSundials, IntegratorConfig::Kind::kRk4}) {
    PlantConfig c = sticking(2.0, 2.0);
    c.integrator.kind = kind;
    Plant plant(c);
    run(plant, {20.0, 60.0, 0.2}, 1.0);
    hold(plant, {}, 0.01);
    const double w = plant.state().w_mech_rad_s, stop_s = w * 0.047 / 2.0;
    const auto start = plant.index();
    ASSERT_GT(w, 40.0);
    hold(plant, {}, 0.5);
    EXPECT_NEAR(plant.state().w_mech_rad_s, w - 2.0 / 0.047 * std::llround(0.5 / 60e-6) * 60e-6, 1e-4);
    while (plant.state().w_mech_rad_s > 0.0) plant.step({});
    EXPECT_EQ(plant.state().w_mech_rad_s, 0.0);
    EXPECT_NEAR(static_cast<double>(plant.index() - start) * 60e-6, stop_s, 1.5 * 60e-6 + 1e-6 * stop_s);
    const double angle = plant.state().angle_rad;
    const auto turns = plant.state().turns;
    for (int k = 0; k < 10000; ++k) {
      plant.step({});
      ASSERT_EQ(plant.state().w_mech_rad_s, 0.0);
    }
    EXPECT_EQ(plant.state().angle_rad, angle);
    EXPECT_EQ(plant.state().turns, turns);
  }
}

// A torque well above break-away drags the shaft through zero without a rest: one change of sign.
TEST(StickSlip, LetsAReversalPassThroughRestOnce) {
  Plant plant(sticking(0.5, 0.4));
  run(plant, {20.0, 60.0, 0.2}, 1.0);
  const auto reverse = [&] {
    const double t = (static_cast<double>(plant.index()) + 0.5) * sample_s(plant);
    return command(std::polar(60.0, -2.0 * kPi * 20.0 * t));
  };
  int changes = 0, resting = 0;
  double last = plant.state().w_mech_rad_s;
  ASSERT_GT(last, 50.0);
  for (int k = 0; k < 15000; ++k) {
    plant.step(reverse());
    const double w = plant.state().w_mech_rad_s;
    changes += w * last < 0.0;
    resting += w == 0.0;
    last = w;
  }
  EXPECT_LT(last, -50.0);
  EXPECT_EQ(changes, 1);
  EXPECT_EQ(resting, 0);
}

// A field that turns to and fro pulls about as hard as the bearing holds: the shaft rests and slips in turns.
// It never starts below break-away, never rests above it, and how often it changes does not grow with the
// number of samples, as chatter would.
TEST(StickSlip, SticksAndSlipsWithoutChatter) {
  const auto changes = [](std::int64_t sample_ns) {
    PlantConfig c = sticking(1.0, 0.8);
    c.mechanics.J_kgm2 = 0.02;
    c.sample_time_ns = sample_ns;
    Plant plant(c);
    const double h = sample_s(plant);
    const int n = static_cast<int>(1.2 / h);
    int count = 0, still = 0;
    bool moved = false;
    for (int k = 0; k < n; ++k) {
      const double phase = 15.0 * std::sin(2.0 * kPi * 2.0 * (k + 0.5) * h);
      plant.step(command(std::polar(7.0, phase)));
      const double T = std::abs(plant.state().torque_Nm);
      const bool moves = plant.state().w_mech_rad_s != 0.0;
      if (moves && !moved) {
        EXPECT_GT(T, 1.0 - 1e-9);
      }
      if (!moves) {
        EXPECT_LT(T, 1.0 + 2000.0 * h);  // as much as the torque grows in one sample
      }
      count += moves != moved;
      still += !moves;
      moved = moves;
    }
    std::printf("to and fro, samples of %2.0f us: still %2.0f %% of the time, %d changes\n", 1e6 * h,
                100.0 * still / n, count);
    EXPECT_GT(still, n / 5);
    EXPECT_LT(still, 4 * n / 5);
    return count;
  };
  const int coarse = changes(60'000), fine = changes(10'000);
  EXPECT_GT(coarse, 20);
  EXPECT_LE(std::abs(coarse - fine), 6);
}

TEST(StickSlip, ChangesNothingThatMattersAtATighterTolerance) {
  const auto run_down = [](double rtol, IntegratorConfig::Kind kind) {
    PlantConfig c = sticking(1.0, 0.4);
    c.integrator.rtol = rtol, c.integrator.kind = kind;
    Plant plant(c);
    run(plant, {10.0, 14.0, 1.0}, 1.5);
    run(plant, {10.0, 14.0}, 0.5);
    return plant.state();
  };
  using Kind = IntegratorConfig::Kind;
  const Observed coarse = run_down(1e-8, Kind::kSundials), fine = run_down(5e-9, Kind::kSundials);
  const Observed fixed = run_down(1e-8, Kind::kRk4);
  EXPECT_GT(fine.w_mech_rad_s, 5.0);
  EXPECT_NEAR(coarse.w_mech_rad_s, fine.w_mech_rad_s, 1e-6);
  EXPECT_NEAR(fixed.w_mech_rad_s, fine.w_mech_rad_s, 1e-3);
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
