// The truth at an operating point: an ideal identification's parameters must give the plant's own terminal
// current back, through equation (9) written here anew, whatever effects the plant has.

#include "plant/operating_point.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "plant/effects/cross_saturation.h"
#include "plant/effects/friction.h"
#include "plant/effects/leakage_saturation.h"
#include "plant/effects/magnetizing_saturation.h"
#include "plant/effects/shorted_turns.h"
#include "rig/base/error.h"
#include "tests/plant/bench.h"

namespace imrig::plant {
namespace {

using namespace bench;

// Z = R_s + j X_l + (j X_m || R_c || R_r/s), inverse-gamma, with R_c across the rotor's flux.
Complex impedance(const OperatingPoint& p) {
  const Complex j{0.0, 1.0};
  const double w = 2.0 * kPi * p.f_Hz;
  const InverseGamma& g = p.secant;
  Complex across = 1.0 / (j * w * g.L_m_H) + p.slip / g.R_r_ohm;
  if (p.R_c_ohm) across += 1.0 / *p.R_c_ohm;
  return g.R_s_ohm + j * w * g.L_l_H + 1.0 / across;
}

void expect_its_own_current(const OperatingPoint& p, double relative) {
  const Complex expected = p.v_s / impedance(p);
  EXPECT_LT(std::abs(expected - p.i_s), relative * std::abs(p.i_s))
      << p.slip << ": " << expected << " " << p.i_s;
}

std::vector<std::shared_ptr<const Effect>> saturation() {
  return {std::make_shared<MagnetizingSaturation>(SaturationLaw{0.15, 0.52, 0.4}),
          std::make_shared<LeakageSaturation>(SaturationLaw{0.5, 40.0, 0.3}, SaturationLaw{0.45, 40.0, 0.3})};
}

TEST(OperatingPoint, IsTheBaseMachineWhereThereIsNoEffect) {
  for (const double slip : {-0.02, 0.0, 0.03, 1.0}) {
    const OperatingPoint p = find_operating_point(config(), {60.0, 180.0, slip, {}, {}, {}});
    EXPECT_NEAR(p.secant.R_s_ohm, kRs, 1e-9);
    EXPECT_NEAR(p.secant.R_r_ohm, kRr, 1e-6 * kRr) << slip;
    EXPECT_NEAR(p.secant.L_l_H, kLl, 5e-6 * kLl) << slip;
    EXPECT_NEAR(p.secant.L_m_H, kLm, 1e-6 * kLm) << slip;
    EXPECT_NEAR(p.L_m_incremental.dd, kLm, 1e-9);
    EXPECT_NEAR(p.L_l_incremental.qq, kLl, 1e-9);
    EXPECT_FALSE(p.R_c_ohm);
    expect_its_own_current(p, 1e-6);
  }
}

// The healthy winding's parameters, whatever circulates beside it; the terminals show the more.
TEST(OperatingPoint, TellsTheWindingApartFromShortedTurnsBesideIt) {
  PlantConfig c = config();
  c.effects = {std::make_shared<ShortedTurns>(ShortedTurns::Config{{0.05, 0.0, 0.0}, 0.01})};
  const PointRequest at{60.0, 180.0, 0.03, {}, {}, {}};
  const OperatingPoint p = find_operating_point(c, at), healthy = find_operating_point(config(), at);
  EXPECT_NEAR(p.secant.R_r_ohm, kRr, 1e-5 * kRr);
  EXPECT_NEAR(p.secant.L_l_H, kLl, 1e-4 * kLl);
  EXPECT_NEAR(p.secant.L_m_H, kLm, 1e-5 * kLm);
  EXPECT_GT(std::abs(p.i_s), std::abs(healthy.i_s) + 0.5);
  EXPECT_GT(p.losses.stator_copper_W, 1.5 * healthy.losses.stator_copper_W);
}

// Iron across the rotor's flux, a cage and a winding that follow temperature, a rotor whose answer to its
// slip frequency is a resistance and an inductance more: one first-order ladder, R_1 parallel to L_1.
class Ladder : public Effect {
 public:
  static constexpr double kR1 = 0.2, kL1 = 0.0006;
  std::string name() const override { return "ladder"; }
  unsigned hooks() const override { return kStates | kRotorDrop | kResistances; }
  std::vector<Parameter> parameters() const override { return {}; }
  std::size_t states() const override { return 2; }
  void initial(double* own) const override { own[0] = own[1] = 0.0; }
  void resistances(const Conditions& at, const double*, Resistances& R) const override {
    R.R_s *= (235.0 + at.temperature.stator_C) / 260.0;
    R.R_r *= (225.0 + at.temperature.rotor_C) / 250.0;
  }
  void rotor_drop(const Conditions&, const double* own, RotorDrop& drop) const override {
    drop.R += kR1, drop.v_0 -= kR1 * Complex(own[0], own[1]);
  }
  void derivatives(const Conditions& at, const double* own, double* d_own) const override {
    const Complex i{own[0], own[1]};
    const Complex rate = kR1 * (at.i_bar - i) / kL1 + Complex(0.0, kPolePairs * at.w_mech) * i;
    d_own[0] = rate.real(), d_own[1] = rate.imag();
  }
};

TEST(OperatingPoint, FindsTheRotorsResistanceAtItsSlipFrequencyAndTemperatureWithoutKnowingTheEffect) {
  PlantConfig c = config();
  c.effects = {std::make_shared<Ladder>()};
  for (const double slip : {0.0, 0.03, 0.3, 1.0}) {
    const OperatingPoint p = find_operating_point(c, {60.0, 60.0, slip, {}, 80.0, 120.0});
    // Without rotor current it is asked close by.
    const Complex jw{0.0, std::max(slip, 5e-3) * 2.0 * kPi * 60.0};
    const Complex Z =
        c.machine.R_r_ohm * 345.0 / 250.0 + Ladder::kR1 * jw * Ladder::kL1 / (Ladder::kR1 + jw * Ladder::kL1);
    EXPECT_NEAR(p.R_r_ohm, Z.real(), 1e-5 * Z.real()) << slip;
    EXPECT_NEAR(p.L_x_H, Z.imag() / jw.imag(), 1e-4 * Ladder::kL1) << slip;
    EXPECT_NEAR(p.R_s_ohm, kRs * 315.0 / 260.0, 1e-9);
    EXPECT_EQ(p.temperature.rotor_C, 120.0);
    expect_its_own_current(p, 1e-6);
  }
}

class Iron : public Effect {
 public:
  std::string name() const override { return "iron"; }
  unsigned hooks() const override { return kResistances; }
  std::vector<Parameter> parameters() const override { return {}; }
  void resistances(const Conditions&, const double*, Resistances& R) const override {
    R.G_iron = 1.0 / 200.0;
  }
};

TEST(OperatingPoint, GivesTheSaturatedIronMotorsOwnCurrentBackFromSecantParameters) {
  PlantConfig c = config();
  c.effects = saturation();
  c.effects.push_back(std::make_shared<Iron>());
  double no_load_L = 0.0;
  for (const double slip : {0.0, 0.02, 0.05, 1.0}) {
    const OperatingPoint p = find_operating_point(c, {60.0, 180.0, slip, {}, {}, {}});
    expect_its_own_current(p, 2e-6);
    ASSERT_TRUE(p.R_c_ohm);
    EXPECT_NEAR(p.losses.iron_W, 1.5 * std::norm(2.0 * kPi * 60.0 * p.psi_r) / 200.0, 1e-4 * p.losses.iron_W);
    const double shaft_W = p.torque_Nm * 2.0 * kPi * 60.0 * (1.0 - slip) / kPolePairs;
    EXPECT_NEAR(p.in_W, shaft_W + p.losses.stator_copper_W + p.losses.rotor_copper_W + p.losses.iron_W,
                1e-5 * p.in_W);
    if (slip == 0.0) no_load_L = p.L_m_H;
    if (slip > 0.0 && slip < 0.1) {
      EXPECT_NEAR(p.L_m_H, no_load_L, 0.2 * no_load_L);  // it falls little
    }
    if (slip == 1.0) {
      EXPECT_LT(p.secant.L_l_H, 0.85 * kLl);  // the leakages at seven times rated current
    }
  }
}

// Incremental against a finite change of the voltage without load.
TEST(OperatingPoint, TellsTheIncrementalInductanceThatASmallChangeShows) {
  PlantConfig c = config();
  c.effects = saturation();
  const auto at = [&](double V) { return find_operating_point(c, {60.0, V, 0.0, {}, {}, {}}); };
  const OperatingPoint low = at(179.0), middle = at(180.0), high = at(181.0);
  const double slope =
      (std::abs(high.psi_s) - std::abs(low.psi_s)) / (std::abs(high.i_s) - std::abs(low.i_s));
  EXPECT_NEAR(middle.L_l_incremental.dd + middle.L_m_incremental.dd, slope, 2e-3 * slope);
  EXPECT_LT(middle.L_m_incremental.dd, 0.6 * middle.secant.L_m_H);
  // Across the flux a change only turns it: the secant.
  EXPECT_NEAR(middle.L_m_incremental.qq + middle.L_l_incremental.qq,
              middle.secant.L_m_H + middle.secant.L_l_H, 1e-4 * kLm);
}

TEST(OperatingPoint, CouplesTheAxesWhereTheTeethAreShared) {
  PlantConfig c = config();
  const auto dq = [&] {
    return find_operating_point(c, {60.0, 180.0, 0.05, {}, {}, {}}).L_mT_incremental.dq;
  };
  EXPECT_EQ(dq(), 0.0);
  c.effects = {std::make_shared<CrossSaturation>(SaturationLaw{0.2, 0.5, 0.3}, 0.8)};
  EXPECT_GT(std::abs(dq()), 0.001);
}

TEST(OperatingPoint, AgreesWithTheWholePlantRunningUnderItsFriction) {
  PlantConfig c = config();
  c.generator.coupled = false;
  c.effects = saturation();
  c.effects.push_back(std::make_shared<Friction>(Friction::Config{0.5, 0.05, 0.2}));
  c.sample_time_ns = 10'000, c.pwm_time_ns = 40'000;
  Plant plant(c);
  const Supply supply{50.0, 150.0, 0.2};
  run(plant, supply, 3.0);
  const OperatingPoint p = find_operating_point(c, {50.0, supply.fundamental_V(plant), {}, 0.0, {}, {}});
  EXPECT_NEAR(p.speed_rpm, plant.state().speed_rpm, 1e-3);
  EXPECT_NEAR(std::abs(p.i_s), std::abs(plant.state().i_s), 2e-3 * std::abs(p.i_s));
  EXPECT_NEAR(p.shaft_Nm, 0.0, 1e-5);
  const double w_M = p.speed_rpm * kPi / 30.0;
  EXPECT_NEAR(p.losses.friction_W, 0.5 * w_M + 0.05 * w_M * w_M, 1e-3);
}

TEST(OperatingPoint, FindsTheSlipOfALoadAndSaysWhenThereIsNone) {
  const OperatingPoint p = find_operating_point(config(), {60.0, 180.0, {}, 20.4, {}, {}});
  EXPECT_NEAR(p.shaft_Nm, 20.4, 1e-4);
  EXPECT_NEAR(p.speed_rpm, 1757.0, 2.0);  // as measured on the running plant (docs/plant.md)
  EXPECT_THROW(find_operating_point(config(), {60.0, 180.0, {}, 500.0, {}, {}}), Error);
}

TEST(OperatingPoint, ReadsItsRequestStrictly) {
  const PointRequest r = parse_point_request("f_Hz=60,v_V=180,load_Nm=-5,stator_C=80");
  EXPECT_EQ(r.f_Hz, 60.0);
  EXPECT_EQ(*r.load_Nm, -5.0);
  EXPECT_EQ(*r.stator_C, 80.0);
  for (const char* bad :
       {"", "f_Hz=60", "f_Hz=60,v_V=180", "f_Hz=60,v_V=180,slip=0.1,load_Nm=3", "f_Hz=60,v_V=180,slip=x",
        "f_Hz=60,v_V=180,slip=0.1,", "f_Hz=60,v_V=180,slip=nan", "f_Hz=0,v_V=180,slip=0.1",
        "f_Hz=60,v_V=180,slip=0.1,cold=1", "f_Hz=60 ,v_V=180,slip=0.1"}) {
    EXPECT_THROW(parse_point_request(bad), Error) << bad;
  }
}

TEST(Truth, PrintsTheOperatingPointWithUnits) {
  PlantConfig c = config();
  c.effects = saturation();
  const auto point = nlohmann::json::parse(truth_json(c, {60.0, 180.0, 0.03, {}, {}, {}}))["operating_point"];
  EXPECT_EQ(point["conditions"]["slip"]["value"], 0.03);
  EXPECT_EQ(point["parameters"]["L_m"]["unit"], "H");
  EXPECT_LT(point["parameters"]["L_m"]["value"], 0.06);
  EXPECT_GT(point["losses"]["stator_copper"]["value"], 10.0);
  EXPECT_TRUE(point["parameters"]["R_c"].is_null());
  EXPECT_THAT(truth_text(c, {60.0, 180.0, 0.03, {}, {}, {}}),
              testing::HasSubstr("operating_point.currents.I_d_e"));
}

}  // namespace
}  // namespace imrig::plant
