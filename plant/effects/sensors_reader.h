#pragma once
// [effects.current_sensors], [effects.voltage_sensors], [effects.encoder_eccentricity],
// [effects.thermocouple]

#include <memory>

#include "plant/effects/current_sensors.h"
#include "plant/effects/encoder_eccentricity.h"
#include "plant/effects/thermocouple.h"
#include "plant/effects/voltage_sensors.h"
#include "rig/base/config_reader.h"

namespace imrig::plant {

inline ChannelErrors read_channel_errors(const ConfigReader& table, double range) {
  ChannelErrors e;
  const char* phase[] = {"a", "b", "c"};
  for (std::size_t k = 0; k < 3; ++k) {
    e.gain[k] = table.number_or(std::string("gain_") + phase[k], 0.0, {-0.5, 0.5});
    e.offset[k] = table.number_or(std::string("offset_") + phase[k], 0.0, {-1e4, 1e4});
  }
  e.crosstalk = table.number_or("crosstalk", 0.0, {-0.2, 0.2});
  e.cubic = table.number_or("cubic", 0.0, {-0.2, 0.2});
  e.range = table.number_or("range", range, {1e-3, 1e6});
  return e;
}

inline std::shared_ptr<const Effect> read_current_sensors(const ConfigReader& table) {
  CurrentSensors::Config c;
  c.errors = read_channel_errors(table, 40.0);
  c.lag_s = table.number_or("lag_s", 0.0, {0.0, 0.1});
  c.delay_s = table.number_or("delay_s", 0.0, {0.0, 0.01});
  return std::make_shared<CurrentSensors>(c);
}

inline std::shared_ptr<const Effect> read_voltage_sensors(const ConfigReader& table) {
  return std::make_shared<VoltageSensors>(read_channel_errors(table, 400.0));
}

inline std::shared_ptr<const Effect> read_encoder_eccentricity(const ConfigReader& table) {
  EncoderEccentricity::Config c;
  c.once_rad = table.number_or("once_rad", 0.0, {-0.1, 0.1});
  c.once_phase_rad = table.number_or("once_phase_rad", 0.0, {-7.0, 7.0});
  c.twice_rad = table.number_or("twice_rad", 0.0, {-0.1, 0.1});
  c.twice_phase_rad = table.number_or("twice_phase_rad", 0.0, {-7.0, 7.0});
  return std::make_shared<EncoderEccentricity>(c);
}

inline std::shared_ptr<const Effect> read_thermocouple(const ConfigReader& table) {
  Thermocouple::Config c;
  c.lag_s = table.number_or("lag_s", 0.0, {0.0, 1e4});
  if (c.lag_s > 0.0 && c.lag_s < 1e-3) table.fail("lag_s", "is below a millisecond", "0 for none");
  c.gain = table.number_or("gain", 0.0, {-0.5, 0.5});
  c.offset_C = table.number_or("offset_C", 0.0, {-100.0, 100.0});
  return std::make_shared<Thermocouple>(c);
}

}  // namespace imrig::plant
