#include <memory>

#include "plant/effects/current_sensors.h"
#include "plant/effects/encoder_eccentricity.h"
#include "plant/effects/thermal.h"
#include "plant/effects/thermocouple.h"
#include "plant/effects/voltage_sensors.h"
#include "tests/plant/pictures/picture.h"
#include "tests/plant/spectrum.h"

namespace imrig::plant::pictures {
namespace {

using namespace bench;

const Supply kLine{50.0, 150.0};

// What phase a's reading is off by, against the true value, over one period.
Picture current() {
  Picture p{"current_sensors",
            "Phase a: gain +1 %, offset 0.1 A, cubic -2 % at 40 A",
            "current, A",
            "reading less current, A",
            {{"without lag", {}, {}}, {"lag 100 us", {}, {}}}};
  for (std::size_t k = 0; k < 2; ++k) {
    CurrentSensors::Config sensors;
    sensors.errors.gain[0] = 0.01, sensors.errors.offset[0] = 0.1, sensors.errors.cubic = -0.02;
    sensors.lag_s = k == 1 ? 100e-6 : 0.0;
    PlantConfig c = held_speed(1400.0);
    c.effects = {std::make_shared<CurrentSensors>(sensors)};
    Plant plant(c);
    run(plant, kLine, 2.0);
    for (int n = 0; n < 335; ++n) {
      const RawSample raw = plant.step(kLine.at(plant));
      const double i = plant.state().i_s.real();
      p.series[k].add(i, raw.i[0] * plant.scale().current_A_per_count - i);
    }
  }
  return p;
}

Picture voltage() {
  Picture p{"voltage_sensors",
            "Phase a behind its filter: gain +1 %, offset 1 V, cross-talk 0.5 %",
            "voltage, V",
            "reading less voltage, V",
            {{"", {}, {}}}};
  ChannelErrors errors;
  errors.gain[0] = 0.01, errors.offset[0] = 1.0, errors.crosstalk = 0.005, errors.range = 400.0;
  PlantConfig a = held_speed(1400.0), b = a;
  a.sensors.voltage_filter_s = b.sensors.voltage_filter_s = 160e-6;
  a.effects = {std::make_shared<VoltageSensors>(errors)};
  Plant plant(a), without(b);
  run(plant, kLine, 0.1), run(without, kLine, 0.1);
  for (int n = 0; n < 335; ++n) {
    const double per_count = plant.scale().voltage_V_per_count;
    const double read = plant.step(kLine.at(plant)).v[0] * per_count;
    const double exact = without.step(kLine.at(without)).v[0] * per_count;
    p.series[0].add(exact, read - exact);
  }
  return p;
}

Picture encoder() {
  Picture p{"encoder_eccentricity",
            "Encoder: 10 mrad once, 5 mrad twice per turn",
            "angle, rad",
            "reading less angle, mrad",
            {{"", {}, {}}}};
  PlantConfig c = held_speed(60.0);
  c.sensors.encoder_counts_per_rev = 1 << 20;
  c.effects = {std::make_shared<EncoderEccentricity>(EncoderEccentricity::Config{0.01, 0.0, 0.005, 0.0})};
  Plant plant(c);
  const double rad = 2.0 * kPi / (1 << 20);
  for (int n = 0; n < 16600; ++n) {
    const RawSample raw = plant.step({});
    const double angle = plant.state().angle_rad;
    if (n % 80 == 79) p.series[0].add(angle, 1e3 * (raw.encoder * rad - angle));
  }
  return p;
}

Picture thermocouple() {
  Picture p{"thermocouple",
            "Direct current on and off; thermocouple lags 30 s, reads 1.5 K more",
            "time, s",
            "temperature, C",
            {{"winding", {}, {}, true}, {"reading", {}, {}}}};
  const double faster = 50.0;  // heat capacities and lag alike
  Thermal::Config heat;
  heat.stator_J_per_K = 1000.0, heat.rotor_J_per_K = 1500.0, heat.iron_J_per_K = 9000.0;
  heat.stator_iron_W_per_K = 25.0, heat.rotor_iron_W_per_K = 10.0, heat.iron_ambient_W_per_K = 5.0;
  heat.speedup = faster;
  for (std::size_t k = 0; k < 2; ++k) {
    PlantConfig c = held_speed(0.0);
    c.effects = {std::make_shared<Thermal>(heat)};
    if (k == 1)
      c.effects.push_back(std::make_shared<Thermocouple>(Thermocouple::Config{30.0 / faster, 0.0, 1.5}));
    Plant plant(c);
    for (int n = 0; n < 100'000; ++n) {
      plant.step(command(n < 50'000 ? 12.0 : 0.0));
      if (n % 1000 == 0) p.series[k].add(n * 60e-6 * faster, plant.state().stator_C);
    }
  }
  return p;
}

}  // namespace

std::vector<Picture> sensor_pictures() { return {current(), voltage(), encoder(), thermocouple()}; }

}  // namespace imrig::plant::pictures
