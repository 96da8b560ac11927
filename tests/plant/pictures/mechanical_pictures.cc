#include <memory>

#include "plant/effects/coupling_torsion.h"
#include "plant/effects/friction.h"
#include "plant/effects/stick_slip.h"
#include "plant/effects/stray_load_loss.h"
#include "plant/effects/thermal.h"
#include "plant/effects/windage.h"
#include "tests/plant/pictures/picture.h"
#include "tests/plant/spectrum.h"

namespace imrig::plant::pictures {
namespace {

using namespace bench;

PlantConfig fixed_step() {
  PlantConfig c = config();
  c.integrator.kind = IntegratorConfig::Kind::kRk4;
  return c;
}

double drag(const Effect& effect, const Conditions& at) { return effect.drag_Nm(at, nullptr); }

Conditions turning(double w) {
  Conditions at;
  at.w_mech = w;
  return at;
}

Picture friction() {
  Picture p{"friction",
            "Bearings: 0.25 Nm, 0.0015 Nm s; smooth with a width of 0.5 rad/s",
            "speed, rad/s",
            "drag, Nm",
            {{"jump", {}, {}}, {"smooth", {}, {}, true}}};
  const Friction jump({0.25, 0.0015}), smooth({0.25, 0.0015, 0.5});
  for (int k = -500; k <= 500; ++k) {
    const double w = 0.02 * k;
    p.series[0].add(w, drag(jump, turning(w))), p.series[1].add(w, drag(smooth, turning(w)));
  }
  return p;
}

Picture windage() {
  Picture p{"windage",
            "Fan 3e-6 Nm s2, rotor surface 2e-8 Nm s3",
            "speed, rpm",
            "power, W",
            {{"both", {}, {}}, {"fan alone", {}, {}, true}}};
  const Windage both({3e-6, 2e-8}), fan({3e-6, 0.0});
  for (double rpm = 0.0; rpm <= 3600.0; rpm += 100.0) {
    const double w = rad_s_of_rpm(rpm);
    p.series[0].add(rpm, w * drag(both, turning(w))), p.series[1].add(rpm, w * drag(fan, turning(w)));
  }
  return p;
}

Picture stray() {
  Picture p{"stray_load_loss",
            "Stray load loss, 85 W at 18 A peak and 1750 rpm, exponent 1.5",
            "stator current, A peak",
            "loss, W",
            {{"1750 rpm", {}, {}}, {"875 rpm", {}, {}, true}}};
  StrayLoadLoss::Config config;
  config.loss_W = 85.0, config.rated_A = 18.0, config.exponent = 1.5;
  const StrayLoadLoss loss(config);
  for (double i = 0.0; i <= 30.0; i += 1.0) {
    for (std::size_t k = 0; k < 2; ++k) {
      Conditions at = turning(rad_s_of_rpm(k == 0 ? 1750.0 : 875.0));
      at.i.s = i;
      p.series[k].add(i, at.w_mech * drag(loss, at));
    }
  }
  return p;
}

// One field that turns to and fro, a bearing that creeps and one that sticks.
Picture sticking() {
  Picture p{"stick_slip",
            "A field that swings to and fro: break-away 1 Nm, Coulomb 0.8 Nm",
            "time, s",
            "speed, rad/s",
            {{"sticks", {}, {}}, {"smooth friction of 0.8 Nm", {}, {}, true}}};
  PlantConfig a = fixed_step();
  a.generator.coupled = false;
  PlantConfig b = a;
  a.effects = {std::make_shared<StickSlip>(StickSlip::Config{1.0, 0.8, 2.0})};
  b.effects = {std::make_shared<Friction>(Friction::Config{0.8, 0.0, 0.2})};
  Plant one(a), other(b);
  for (int k = 0; k < 6000; ++k) {
    const double t = k * 60e-6;
    const InverterCommand v = command(std::polar(7.0, 15.0 * std::sin(2.0 * kPi * 2.0 * t)));
    one.step(v), other.step(v);
    if (k % 20 != 0) continue;
    p.series[0].add(t, one.state().w_mech_rad_s), p.series[1].add(t, other.state().w_mech_rad_s);
  }
  return p;
}

Picture torsion() {
  Picture p{"coupling_torsion",
            "Shaft of 800 Nm/rad and 0.1 Nm s, voltage switched on",
            "time, s",
            "torque on the generator, Nm",
            {{"twists", {}, {}}, {"rigid", {}, {}, true}}};
  PlantConfig a = fixed_step(), b = a;
  a.mechanics.J_kgm2 = 0.027;
  a.effects = {std::make_shared<CouplingTorsion>(CouplingTorsion::Config{800.0, 0.1, 0.02})};
  Plant one(a), other(b);
  const Supply supply{50.0, 100.0};
  double before = 0.0;
  for (int k = 0; k < 5000; ++k) {
    one.step(supply.at(one)), other.step(supply.at(other));
    const double now = other.state().w_mech_rad_s, rate = (now - before) / 60e-6;
    before = now;
    if (k % 16 != 0) continue;
    p.series[0].add(k * 60e-6, one.state().transducer_Nm);
    p.series[1].add(k * 60e-6, 0.02 * rate);  // the generator's share of the inertia
  }
  return p;
}

// Eighty minutes in sixteen seconds: all heat capacities divided by the same number.
Picture heat_run() {
  Picture p{"thermal",
            "Heat run at 1745 rpm, 180 V, 60 Hz; voltage off after an hour",
            "time, min",
            "temperature, C",
            {{"winding", {}, {}}, {"cage", {}, {}}, {"iron and frame", {}, {}}}};
  const double faster = 300.0;
  PlantConfig c = held_speed(1745.0);
  Thermal::Config t;
  t.stator_J_per_K = 1000.0, t.rotor_J_per_K = 1500.0, t.iron_J_per_K = 9000.0;
  t.stator_iron_W_per_K = 25.0, t.rotor_iron_W_per_K = 10.0, t.iron_ambient_W_per_K = 5.0;
  t.fan = 1.2, t.speedup = faster;
  c.effects = {std::make_shared<Thermal>(t)};
  Plant plant(c);
  const Supply supply{60.0, 180.0, 0.1};
  for (int k = 0; k < 266'000; ++k) {
    const double time_s = k * 60e-6;
    plant.step(time_s < 12.0 ? supply.at(plant) : InverterCommand{});
    if (k % 2800 != 0) continue;
    const double minutes = time_s * faster / 60.0;
    p.series[0].add(minutes, plant.state().stator_C), p.series[1].add(minutes, plant.state().rotor_C);
    p.series[2].add(minutes, plant.state().iron_C);
  }
  return p;
}

}  // namespace

std::vector<Picture> mechanical_pictures() {
  return {friction(), windage(), stray(), sticking(), torsion(), heat_run()};
}

}  // namespace imrig::plant::pictures
