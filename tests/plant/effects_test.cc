// The hooks: an effect that does nothing leaves every bit as it is, one that does something is felt where it
// should be.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <set>
#include <vector>

#include "plant/effects/friction.h"
#include "plant/effects/registry.h"
#include "plant/powers.h"
#include "tests/plant/bench.h"

namespace imrig::plant {
namespace {

using namespace bench;

class Nothing : public Effect {
 public:
  std::string name() const override { return "nothing"; }
  unsigned hooks() const override {
    return kCurrents | kResistances | kAppliedVoltage | kDrag | kStates | kMeasured;
  }
  std::vector<Parameter> parameters() const override { return {}; }
};

std::vector<double> trace(const std::vector<std::shared_ptr<const Effect>>& effects,
                          IntegratorConfig::Kind kind) {
  PlantConfig c = config();
  c.integrator.kind = kind;
  c.effects = effects;
  Plant plant(c);
  plant.set_excitation({60.0, 1.0, true, 0.0, 0.0});
  std::vector<double> values;
  for (int k = 0; k < 8000; ++k) {
    const RawSample raw = plant.step(Supply{60.0, 150.0}.at(plant));
    const Observed& now = plant.state();
    values.insert(values.end(), {now.i_s.real(), now.i_s.imag(), now.psi_r.real(), now.speed_rpm,
                                 now.torque_Nm, now.load_Nm, static_cast<double>(raw.i[0]),
                                 static_cast<double>(raw.v[1]), static_cast<double>(raw.encoder)});
  }
  return values;
}

TEST(Effects, LeaveTheBaseMachineBitForBitWhenNeutral) {
  for (const auto kind : {IntegratorConfig::Kind::kSundials, IntegratorConfig::Kind::kRk4}) {
    const auto base = trace({}, kind);
    EXPECT_EQ(base, trace({std::make_shared<Nothing>()}, kind));
    EXPECT_EQ(base, trace({std::make_shared<Friction>(Friction::Config{})}, kind));
  }
}

// A winding that warms with its own losses and grows in resistance: one state, one hook.
class WarmWinding : public Nothing {
 public:
  std::string name() const override { return "warm_winding"; }
  unsigned hooks() const override { return kStates | kResistances | kMeasured; }
  std::size_t states() const override { return 1; }
  void initial(double* own) const override { own[0] = 20.0; }
  void resistances(const Conditions&, const double* own, Resistances& R) const override {
    R.R_s *= 1.0 + 0.0039 * (own[0] - 20.0);
  }
  void derivatives(const Conditions& at, const double*, double* d_own) const override {
    d_own[0] = 1.5 * at.R.R_s * std::norm(at.i.s) / kHeatCapacity;
  }
  void measured(const Conditions&, const double* own, Measured& values) const override {
    values.stator_C = own[0];
  }
  static constexpr double kHeatCapacity = 50.0;  // J/K, small on purpose
};

TEST(Effects, CarryTheirOwnStatesThroughTheIntegrator) {
  for (const auto kind : {IntegratorConfig::Kind::kSundials, IntegratorConfig::Kind::kRk4}) {
    PlantConfig c = config();
    c.integrator.kind = kind;
    c.mechanics.locked = true;
    c.effects = {std::make_shared<WarmWinding>()};
    Plant plant(c);
    const double h = sample_s(plant);
    double heat_J = 0.0, last_W = 0.0;
    RawSample raw{};
    for (int k = 0; k < 40000; ++k) {
      raw = plant.step(command(4.0));
      const double now_W = plant.powers().stator_copper_W;
      heat_J += 0.5 * h * (now_W + last_W);
      last_W = now_W;
    }
    EXPECT_GT(raw.stator_C, 22.0f);
    EXPECT_NEAR(raw.stator_C, 20.0 + heat_J / WarmWinding::kHeatCapacity, 1e-4);
    const double R_s = kRs * (1.0 + 0.0039 * (static_cast<double>(raw.stator_C) - 20.0));
    EXPECT_NEAR(plant.state().i_s.real(), 4.0 / R_s, 0.01 * 4.0 / R_s);
  }
}

class Iron : public Nothing {
 public:
  std::string name() const override { return "iron"; }
  unsigned hooks() const override { return kResistances; }
  void resistances(const Conditions&, const double*, Resistances& R) const override {
    R.G_iron = 1.0 / 300.0;
  }
};

TEST(Effects, BurnIronLossAcrossTheRotorsFlux) {
  PlantConfig c = config();
  c.generator.coupled = false;
  c.effects = {std::make_shared<Iron>()};
  Plant plant(c);
  run(plant, {60.0, 179.6, 0.2}, 4.0);
  const Powers p = plant.powers();
  const double e = 2.0 * kPi * 60.0 * std::abs(plant.state().psi_r);
  EXPECT_NEAR(p.iron_W, 1.5 * e * e / 300.0, 0.002 * p.iron_W);
  EXPECT_GT(p.iron_W, 100.0);
  EXPECT_NEAR(plant.state().speed_rpm, 1800.0, 0.01);  // it brakes nothing
  // The held voltage and the mean current of a step give the power that flows in.
  const Complex before = plant.state().i_s;
  plant.step(Supply{60.0, 179.6}.at(plant));
  const double in_W = power_W(plant.state().v_s, 0.5 * (before + plant.state().i_s));
  EXPECT_NEAR(in_W, p.iron_W + p.stator_copper_W, 0.002 * in_W);
}

class Droop : public Nothing {
 public:
  std::string name() const override { return "droop"; }
  unsigned hooks() const override { return kAppliedVoltage; }
  void applied_voltage(const Conditions& at, const double*, Complex& v) const override { v -= 0.5 * at.i.s; }
};

TEST(Effects, ChangeTheVoltageThatTheInverterGivesAndTheSensorsSee) {
  PlantConfig c = config();
  c.mechanics.locked = true;
  c.effects = {std::make_shared<Droop>()};
  Plant plant(c);
  hold(plant, command(8.0), 3.0);
  const double i = 8.0 / (kRs + 0.5);
  EXPECT_NEAR(plant.state().i_s.real(), i, 1e-3);
  EXPECT_NEAR(plant.step(command(8.0)).v[0] * plant.scale().voltage_V_per_count, 8.0 - 0.5 * i, 0.01);
}

// A leakage that is not linear: the stator's current grows faster than its flux. Gates off must still end at
// zero current exactly.
class Saturating : public Nothing {
 public:
  std::string name() const override { return "saturating"; }
  unsigned hooks() const override { return kCurrents; }
  void currents(const Conditions&, const double*, Currents& i) const override {
    i.s += 0.0005 * std::norm(i.s) * i.s;
  }
};

TEST(Effects, MayBendTheCurrentsAndTheDiodesStillFollow) {
  PlantConfig c = config();
  c.effects = {std::make_shared<Saturating>()};
  Plant plant(c);
  run(plant, {60.0, 150.0, 0.1}, 1.0);
  ASSERT_GT(std::abs(plant.state().i_s), 3.0);
  hold(plant, {}, 0.05);
  EXPECT_EQ(plant.state().i_s, Complex(0.0));
  const double emf = std::abs(plant.state().v_s), psi = std::abs(plant.state().psi_s);
  const double w = kPolePairs * plant.state().w_mech_rad_s;
  EXPECT_NEAR(emf, psi * std::hypot(w, kRr / kLm), 1e-3 * emf);
}

TEST(Effects, AreRegisteredOnceWithTheNameTheyCarry) {
  std::set<std::string> names;
  for (const auto& entry : effect_registry()) {
    EXPECT_TRUE(names.insert(entry.name).second) << entry.name;
    EXPECT_FALSE(entry.physics.empty());
    const PlantConfig c = parse_plant_config(
        "version = 1\n[motor]\ncircuit = \"inverse-gamma\"\npole_pairs = 2\nR_s_ohm = 0.39\nR_r_ohm = "
        "0.22\nL_l_H = 0.006\nL_m_H = "
        "0.068\n[effects." +
            entry.name + "]\n",
        "plant.toml");
    ASSERT_EQ(c.effects.size(), 1u);
    EXPECT_EQ(c.effects[0]->name(), entry.name);
  }
}

TEST(Friction, BrakesBothDirectionsAndVanishesAtRest) {
  const auto torque = [&](double w, double width_rad_s) {
    Conditions at;
    at.w_mech = w;
    return Friction({0.3, 0.002, width_rad_s}).drag_Nm(at, nullptr);
  };
  for (const double width_rad_s : {0.0, 0.2}) {
    EXPECT_EQ(torque(0.0, width_rad_s), 0.0);
    EXPECT_NEAR(torque(180.0, width_rad_s), 0.3 + 0.36, 1e-6);
    EXPECT_NEAR(torque(-180.0, width_rad_s), -0.3 - 0.36, 1e-6);
  }
  EXPECT_NEAR(torque(0.01, 0.0), 0.3, 1e-4);
  EXPECT_NEAR(torque(0.01, 0.2), 0.3 * 0.01 / 0.2, 1e-4);
}

TEST(Friction, LetsTheShaftCoastDownAsItsEquationSays) {
  PlantConfig c = config();
  c.effects = {std::make_shared<Friction>(Friction::Config{0.0, 0.01, 0.2})};
  Plant plant(c);
  run(plant, {60.0, 150.0, 0.1}, 1.5);
  hold(plant, {}, 3.0);  // until the rotor's flux is gone
  const double w_0 = plant.state().w_mech_rad_s;
  ASSERT_GT(w_0, 50.0);
  hold(plant, {}, 2.0);
  EXPECT_NEAR(plant.state().w_mech_rad_s / w_0, std::exp(-std::llround(2.0 / 60e-6) * 60e-6 * 0.01 / 0.047),
              1e-5);
}

}  // namespace
}  // namespace imrig::plant
