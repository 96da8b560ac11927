#include <fmt/format.h>

#include <memory>

#include "plant/effects/cross_saturation.h"
#include "plant/effects/interbar_current.h"
#include "plant/effects/iron_loss.h"
#include "plant/effects/leakage_saturation.h"
#include "plant/effects/magnetizing_saturation.h"
#include "plant/effects/rotor_skin_effect.h"
#include "plant/generator.h"
#include "plant/operating_point.h"
#include "tests/plant/pictures/picture.h"
#include "tests/plant/spectrum.h"

namespace imrig::plant::pictures {
namespace {

using namespace bench;
using EffectPtr = std::shared_ptr<const Effect>;

OperatingPoint at(const EffectPtr& effect, double f_Hz, double v_V, double slip) {
  PlantConfig c = config();
  if (effect) c.effects = {effect};
  return find_operating_point(c, {f_Hz, v_V, slip, {}, {}, {}});
}

Picture magnetizing() {
  Picture p{"magnetizing_saturation",
            "No-load current, 60 Hz (ratio 0.15, knee 0.52 Wb, softness 0.4)",
            "stator current, A peak",
            "voltage, V peak",
            {{"linear", {}, {}, true}, {"saturated", {}, {}}}};
  const auto bent = std::make_shared<MagnetizingSaturation>(SaturationLaw{0.15, 0.52, 0.4});
  for (const double v : {20.0, 240.0}) p.series[0].add(std::abs(at({}, 60.0, v, 0.0).i_s), v);
  for (double v = 20.0; v <= 240.0; v += 20.0) p.series[1].add(std::abs(at(bent, 60.0, v, 0.0).i_s), v);
  return p;
}

Picture leakage() {
  Picture p{"leakage_saturation",
            "Locked rotor, 60 Hz (ratios 0.5 and 0.45, knees 55 A and 50 A)",
            "stator current, A peak",
            "impedance, ohm",
            {{"linear", {}, {}, true}, {"saturated", {}, {}}}};
  const auto bent =
      std::make_shared<LeakageSaturation>(SaturationLaw{0.5, 55.0, 0.4}, SaturationLaw{0.45, 50.0, 0.4});
  for (double v = 5.0; v <= 260.0; v += 15.0) {
    const double i = std::abs(at(bent, 60.0, v, 1.0).i_s);
    p.series[1].add(i, v / i);
  }
  for (const double v : {5.0, 260.0}) {
    const double i = std::abs(at({}, 60.0, v, 1.0).i_s);
    p.series[0].add(i, v / i);
  }
  return p;
}

Picture cross() {
  Picture p{"cross_saturation",
            "Current along the air-gap flux, 180 V, 60 Hz, over slip 0 to 8 %",
            "air-gap flux, Wb peak",
            "magnetizing current, A peak",
            {{"main-flux curve alone", {}, {}, true}, {"teeth carry leakage flux too", {}, {}}}};
  const EffectPtr effects[] = {std::make_shared<CrossSaturation>(SaturationLaw{0.15, 0.52, 0.4}, 0.0),
                               std::make_shared<CrossSaturation>(SaturationLaw{0.15, 0.52, 0.4}, 0.8)};
  for (double slip = 0.0; slip <= 0.0801; slip += 0.02) {
    for (std::size_t k = 0; k < 2; ++k) {
      const OperatingPoint o = at(effects[k], 60.0, 180.0, slip);
      p.series[k].add(std::abs(o.psi_m), ((o.i_s + o.i_r) * std::conj(o.psi_m)).real() / std::abs(o.psi_m));
    }
  }
  return p;
}

Picture iron() {
  Picture p{"iron_loss",
            "Iron loss at constant flux, 105 W at 60 Hz",
            "frequency, Hz",
            "loss, W",
            {{"hysteresis 60 W, eddy 45 W", {}, {}}, {"hysteresis alone", {}, {}, true}}};
  IronLoss::Config both;
  both.hysteresis_W = 60.0, both.eddy_W = 45.0;
  IronLoss::Config one = both;
  one.eddy_W = 0.0;
  for (double f = 10.0; f <= 100.0; f += 15.0) {
    p.series[0].add(f, at(std::make_shared<IronLoss>(both), f, 2.85 * f, 0.0).losses.iron_W);
    p.series[1].add(f, at(std::make_shared<IronLoss>(one), f, 2.85 * f, 0.0).losses.iron_W);
  }
  return p;
}

Picture rotor_answer(const char* name, const char* title, const EffectPtr& effect) {
  Picture p{name,
            title,
            "slip frequency, Hz",
            "share of its value at zero slip",
            {{"rotor resistance", {}, {}}, {"rotor leakage", {}, {}}}};
  const double leak_H = kL - kM;
  for (double f = 2.0; f <= 200.0; f += f < 20.0 ? 6.0 : 18.0) {
    const OperatingPoint o = at(effect, f, 2.0 + 0.2 * f, 1.0);
    p.series[0].add(f, o.R_r_ohm / kRrT);
    p.series[1].add(f, (o.L_lr_H + o.L_x_H) / leak_H);
  }
  return p;
}

Picture open_circuit() {
  Picture p{"generator",
            "Generator, open circuit (ratio 0.1, knee 0.3 Wb)",
            "field current, A",
            "flux linkage of the air gap, Wb",
            {{"air-gap line", {}, {}, true}, {"characteristic", {}, {}}}};
  GeneratorConfig straight, bent;
  bent.saturated_ratio = 0.1, bent.knee_Wb = 0.3;
  for (double psi = 0.0; psi <= 0.4601; psi += 0.02) {
    const double i = Generator(bent).open_circuit_field_A(psi);
    p.series[1].add(i, psi);
    p.series[0].add(Generator(straight).open_circuit_field_A(psi), psi);
  }
  return p;
}

}  // namespace

std::vector<Picture> magnetic_pictures() {
  return {magnetizing(),
          leakage(),
          cross(),
          iron(),
          rotor_answer("rotor_skin_effect", "Deep bar, 18 mm of aluminium, 80 % of the rotor's resistance",
                       std::make_shared<RotorSkinEffect>(RotorSkinEffect::Config{0.018, 2.83e-8, 0.8})),
          rotor_answer("interbar_current", "Interbar currents across 1.5 mH of skew leakage, 0.6 ohm",
                       std::make_shared<InterbarCurrent>(InterbarCurrent::Config{0.0015, 0.6})),
          open_circuit()};
}

}  // namespace imrig::plant::pictures
