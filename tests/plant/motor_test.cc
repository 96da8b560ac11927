// The motor against closed forms of the inverse-gamma circuit; the plant itself runs on the T circuit.

#include <gtest/gtest.h>

#include <array>

#include "tests/plant/bench.h"

namespace imrig::plant {
namespace {

using namespace bench;

// Equation (9) of Proca and Keyhani: Z = R_s + j X_l + (j X_m R_r/s)/(R_r/s + j X_m).
Complex impedance(double w, double slip) {
  const Complex j{0.0, 1.0};
  const Complex magnetizing = j * w * kLm;
  if (slip == 0.0) return kRs + j * w * kLl + magnetizing;
  const double rotor = kRr / slip;
  return kRs + j * w * kLl + magnetizing * rotor / (rotor + magnetizing);
}

// Torque of the same circuit: (3/2) |I_rotor|^2 (R_r/s) n_p / w.
double torque(double w, double slip, double V) {
  const Complex magnetizing{0.0, w * kLm};
  const double rotor = kRr / slip;
  const Complex i_rotor = V / impedance(w, slip) * magnetizing / (magnetizing + rotor);
  return 1.5 * std::norm(i_rotor) * rotor * kPolePairs / w;
}

// Mean over whole turns of a quantity that turns with the supply, in the supply's frame.
struct Phasors {
  Complex i;
  double torque = 0.0, w_mech = 0.0, load = 0.0, drag = 0.0;
};

Phasors phasors(Plant& plant, const Supply& supply, double turns) {
  Phasors mean;
  const double h = sample_s(plant);
  const auto n = std::llround(turns / supply.f_Hz / h);
  for (long long k = 0; k < n; ++k) {
    plant.step(supply.at(plant));
    const Observed& now = plant.state();
    mean.i += now.i_s * std::polar(1.0, -2.0 * kPi * supply.f_Hz * static_cast<double>(plant.index()) * h);
    mean.torque += now.torque_Nm, mean.w_mech += now.w_mech_rad_s, mean.load += now.load_Nm,
        mean.drag += now.drag_Nm;
  }
  const double scale = 1.0 / static_cast<double>(n);
  return {mean.i * scale, mean.torque * scale, mean.w_mech * scale, mean.load * scale, mean.drag * scale};
}

PlantConfig fine_config() {
  PlantConfig c = config();
  c.sample_time_ns = 10'000;  // so that the ripple of the held voltage does not hide the fundamental
  c.pwm_time_ns = 40'000;
  return c;
}

TEST(Motor, DrawsTheNoLoadCurrentOfThePhasorCircuit) {
  Plant plant(fine_config());
  const Supply supply{60.0, 179.6, 0.2};
  run(plant, supply, 6.0);
  const Phasors p = phasors(plant, supply, 6.0);
  const double w = 2.0 * kPi * 60.0;
  EXPECT_NEAR(p.w_mech * kPolePairs, w, 1e-6 * w);  // no friction here
  const Complex expected = supply.fundamental_V(plant) / impedance(w, 0.0);
  // Sampled at the ends of the held steps the current's ripple shows as V/(w L_l) x (w h/2)^2/3 = 0.1 mA.
  EXPECT_LT(std::abs(p.i - expected), 2e-5 * std::abs(expected)) << p.i << " instead of " << expected;
}

TEST(Motor, CarriesALoadAsThePhasorCircuitDoes) {
  for (const double excitation_A : {0.7, 1.1, 1.5}) {
    PlantConfig c = fine_config();
    c.mechanics.J_kgm2 = 0.02;  // settles sooner
    Plant plant(c);
    plant.set_excitation({60.0, excitation_A, true, 0.0, 0.0});
    const Supply supply{60.0, 179.6, 0.2};
    run(plant, supply, 5.0);
    const Phasors p = phasors(plant, supply, 6.0);
    const double w = 2.0 * kPi * 60.0, slip = 1.0 - p.w_mech * kPolePairs / w;
    const double V = supply.fundamental_V(plant);
    const Complex expected = V / impedance(w, slip);
    EXPECT_GT(slip, 0.004);
    EXPECT_LT(std::abs(p.i - expected), 2e-5 * std::abs(expected)) << p.i << " instead of " << expected;
    EXPECT_NEAR(p.torque, torque(w, slip, V), 5e-5 * p.torque);
    EXPECT_NEAR(p.torque, p.load + p.drag, 5e-5 * p.torque);
  }
}

TEST(Motor, PullsAtStandstillWithTheCircuitsTorque) {
  PlantConfig c = fine_config();
  c.mechanics.locked = true;
  Plant plant(c);
  const Supply supply{50.0, 60.0};
  run(plant, supply, 3.0);
  const Phasors p = phasors(plant, supply, 5.0);
  const double w = 2.0 * kPi * 50.0, V = supply.fundamental_V(plant);
  EXPECT_EQ(plant.state().w_mech_rad_s, 0.0);
  EXPECT_NEAR(p.torque, torque(w, 1.0, V), 1e-4 * p.torque);
  EXPECT_LT(std::abs(p.i - V / impedance(w, 1.0)), 1e-5 * std::abs(p.i));
}

// At standstill equation (2) is a 2x2 linear system with real, negative eigenvalues for each axis:
//   d/dt (i, psi) = M (i, psi) + (v/L_l, 0),  M = [-(R_s+R_r)/L_l, R_r/(L_l L_m); R_r, -R_r/L_m].
struct Standstill {
  double m11 = -(kRs + kRr) / kLl, m12 = kRr / (kLl * kLm), m21 = kRr, m22 = -kRr / kLm;
  double trace = m11 + m22, determinant = m11 * m22 - m12 * m21;
  double root = std::sqrt(trace * trace / 4.0 - determinant);
  double fast = trace / 2.0 - root, slow = trace / 2.0 + root;

  // Free motion from (i, psi) after t.
  std::array<double, 2> free(double i, double psi, double t) const {
    const auto part = [&](double a, double b, double x, double y, double lambda_other, double e) {
      return std::array<double, 2>{(a * x + b * y - lambda_other * x) * e, 0.0};
    };
    const double ef = std::exp(fast * t) / (fast - slow), es = std::exp(slow * t) / (slow - fast);
    return {part(m11, m12, i, psi, slow, ef)[0] + part(m11, m12, i, psi, fast, es)[0],
            part(m22, m21, psi, i, slow, ef)[0] + part(m22, m21, psi, i, fast, es)[0]};
  }
  // From rest, constant v: towards i = v/R_s, psi = L_m i.
  double current_after_step(double v, double t) const {
    return v / kRs + free(-v / kRs, -kLm * v / kRs, t)[0];
  }
};

TEST(Motor, AnswersAVoltageStepAtStandstillWithItsTwoTimeConstants) {
  PlantConfig c = config();
  c.mechanics.locked = true;
  Plant plant(c);
  const double v = 6.0;
  const InverterCommand step = command({v * std::cos(0.4), v * std::sin(0.4)});
  double worst = 0.0;
  for (int k = 1; k <= 50000; ++k) {
    plant.step(step);
    const Complex expected = std::polar(Standstill().current_after_step(v, k * 60e-6), 0.4);
    worst = std::max(worst, std::abs(plant.state().i_s - expected));
  }
  EXPECT_NEAR(std::abs(plant.state().i_s), v / kRs, 0.02 * v / kRs);
  EXPECT_LT(worst, 1e-7);
}

TEST(Motor, RisesFirstWithVoltageOverLeakage) {
  PlantConfig c = config();
  c.mechanics.locked = true;
  Plant plant(c);
  plant.step(command(100.0));
  EXPECT_NEAR(plant.state().i_s.real() / (100.0 / kLl * 60e-6), 1.0,
              0.004);  // (R_s+R_r)/L_l x 60 us / 2 = 0.3 %
}

TEST(Motor, LetsADirectCurrentDecayThroughTheShortedTerminals) {
  PlantConfig c = config();
  c.mechanics.locked = true;
  Plant plant(c);
  hold(plant, command(4.0), 8.0);
  const double i_0 = plant.state().i_s.real();
  EXPECT_NEAR(i_0, 4.0 / kRs, 1e-3);
  const double psi_0 = kLm * i_0;
  for (int k = 1; k <= 5000; ++k) {
    plant.step(command(0.0));
    ASSERT_NEAR(plant.state().i_s.real(), Standstill().free(i_0, psi_0, k * 60e-6)[0], 1e-5 * i_0) << k;
  }
}

TEST(Motor, TurnsTheOtherWayWithTheOtherPhaseOrder) {
  Plant forward(config()), backward(config());
  for (int k = 0; k < 20000; ++k) {
    const double t = (k + 0.5) * 60e-6;
    const Complex v = std::polar(100.0 * std::min(1.0, t), 2.0 * kPi * 30.0 * t);
    forward.step(command(v));
    backward.step(command(std::conj(v)));
  }
  EXPECT_GT(forward.state().speed_rpm, 800.0);
  EXPECT_NEAR(forward.state().speed_rpm, -backward.state().speed_rpm, 1e-6);
}

TEST(Inverter, ShortensAVectorBeyondTheCircleOfTheLink) {
  PlantConfig c = config();
  c.mechanics.locked = true;
  Plant plant(c);
  plant.step(command(std::polar(300.0, 1.0)));
  EXPECT_NEAR(std::abs(plant.state().v_s - std::polar(400.0 / std::sqrt(3.0), 1.0)), 0.0, 1e-9);
  // A part common to all phases is without effect.
  plant.step({{50.0 + 20.0, -25.0 + 20.0, -25.0 + 20.0}, true});
  EXPECT_NEAR(std::abs(plant.state().v_s - Complex{50.0, 0.0}), 0.0, 1e-12);
}

TEST(Inverter, OpensItsGatesOnACommandThatIsNoNumber) {
  Plant plant(config());
  plant.step({{NAN, 0.0, 0.0}, true});
  EXPECT_EQ(plant.state().i_s, Complex(0.0));
  EXPECT_EQ(plant.state().v_s, Complex(0.0));
}

}  // namespace
}  // namespace imrig::plant
