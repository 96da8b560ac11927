#pragma once
// What an ideal identification would find of a plant: its parameters in the inverse-gamma circuit and in the
// T circuit it is built in, mechanics, friction, generator, what the inverter loses between command and
// terminals, and the errors of the sensor channels, those that this seed drew and those stated together.

#include <string>

namespace imrig::plant {

struct PlantConfig;
struct PointRequest;  // plant/operating_point.h

// Inverse-gamma circuit, per phase of the equivalent star.
struct InverseGamma {
  double R_s_ohm, R_r_ohm, L_l_H, L_m_H;
};

InverseGamma inverse_gamma_truth(const PlantConfig& config);

// {"version":1,"circuit":"inverse-gamma","pole_pairs":2,"parameters":{"R_s":{"value":0.39,"unit":"ohm"},"R_r":..,"L_l":..,"L_m":..},
//  "t_circuit":{..},"mechanics":{..},"effects":{"NAME":{..}},"generator":{..},"sensors":{"current_gain":[..],"voltage_gain":[..],
//  "current_offset_counts":[..],"voltage_offset_counts":[..],"current":{"gain_error":{"a":{..},"b":..,"c":..},"offset":{..},"lag":{..}},
//  "voltage":{the
//  same},..},"inverter":{"dead_time_voltage":{..},"device_drop":{..},"device_resistance":{..},..}}; fields
//  may be added.
// "current_gain" and "_offset_counts" are the drawn part alone.
// With a request also "operating_point", of plant/operating_point.h: conditions, phasors (d, q along and
// across the rotor's flux),
//  powers and losses by kind, temperatures, secant and incremental inductances in both circuits, R_r at its
//  slip frequency.
std::string truth_json(const PlantConfig& config);
std::string truth_json(const PlantConfig& config, const PointRequest& at);
// The same for people, one quantity a line.
std::string truth_text(const PlantConfig& config);
std::string truth_text(const PlantConfig& config, const PointRequest& at);

}  // namespace imrig::plant
