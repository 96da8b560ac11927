#include <memory>

#include "plant/effects/inverter_dead_time.h"
#include "tests/plant/pictures/picture.h"
#include "tests/plant/spectrum.h"

namespace imrig::plant::pictures {
namespace {

using namespace bench;

Picture dead_time() {
  Picture p{"inverter_dead_time",
            "Phase current at 5 Hz: 3 us of dead time, 1 V and 0.02 ohm per device",
            "time, s",
            "i a, A",
            {{"without", {}, {}, true}, {"with", {}, {}}}};
  const Supply supply{5.0, 16.0};
  for (std::size_t k = 0; k < 2; ++k) {
    PlantConfig c = held_speed(135.0);
    if (k == 1)
      c.effects = {std::make_shared<InverterDeadTime>(InverterDeadTime::Config{3e-6, 1.0, 0.02, 0.2})};
    Plant plant(c);
    run(plant, supply, 3.0);
    const auto start = plant.index();
    while (plant.index() < start + 5000) {
      plant.step(supply.at(plant));
      const auto at = plant.index() - start;
      if (at % 25 == 0) p.series[k].add(static_cast<double>(at) * 60e-6, plant.state().i_s.real());
    }
  }
  return p;
}

Picture ripple() {
  Picture p{"switching_inverter",
            "Four cycles of 240 us at 50 Hz, sampled every 10 us",
            "time, ms",
            "i a, A",
            {{"averaged", {}, {}, true}, {"switching", {}, {}}}};
  const Supply supply{50.0, 150.0};
  for (std::size_t k = 0; k < 2; ++k) {
    PlantConfig c = held_speed(1440.0);
    c.sample_time_ns = 10'000;
    if (k == 1) c.inverter.kind = InverterConfig::Kind::kSwitching;
    Plant plant(c);
    while (plant.index() < 48000) plant.step(supply.at(plant));
    for (int n = 1; n <= 96; ++n) {
      plant.step(supply.at(plant));
      p.series[k].add(0.01 * n, plant.state().i_s.real());
    }
  }
  return p;
}

Picture link() {
  Picture p{"dc_link",
            "DC link over a start: 0.3 ohm, 1 mF, 8 V of ripple at 360 Hz",
            "time, s",
            "link voltage, V",
            {{"stiff", {}, {}, true}, {"with source and capacitor", {}, {}}}};
  for (std::size_t k = 0; k < 2; ++k) {
    PlantConfig c = config();
    c.integrator.kind = IntegratorConfig::Kind::kRk4;
    if (k == 1) c.inverter.source_ohm = 0.3, c.inverter.capacitor_F = 1e-3, c.inverter.ripple_V = 8.0;
    Plant plant(c);
    const Supply supply{60.0, 150.0};
    for (int n = 0; n < 1700; ++n) {
      plant.step(supply.at(plant));
      if (n % 5 == 0) p.series[k].add(n * 60e-6, plant.state().dc_link_V);
    }
  }
  return p;
}

}  // namespace

std::vector<Picture> inverter_pictures() { return {dead_time(), ripple(), link()}; }

}  // namespace imrig::plant::pictures
