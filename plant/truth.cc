#include "plant/truth.h"

#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>

#include "plant/effects/effect.h"
#include "plant/operating_point.h"
#include "plant/plant_config.h"
#include "plant/sensors.h"

namespace imrig::plant {
namespace {

using Json = nlohmann::ordered_json;

Json quantity(double value, const char* unit) { return {{"value", value}, {"unit", unit}}; }

Json generator_json(const GeneratorConfig& g) {
  return {{"coupled", g.coupled},
          {"pole_pairs", g.pole_pairs},
          {"flux_per_field", quantity(g.flux_per_field_A_Wb, "Wb/A")},
          {"L_s", quantity(g.L_s_H, "H")},
          {"R_a", quantity(g.R_a_ohm, "ohm")},
          {"R_load", quantity(g.R_load_ohm, "ohm")},
          {"R_field", quantity(g.R_field_ohm, "ohm")},
          {"L_field", quantity(g.L_field_H, "H")},
          {"saturated_ratio", quantity(g.saturated_ratio, "1")},
          {"knee", quantity(g.knee_Wb, "Wb")},
          {"core_loss", quantity(g.core_loss_W, "W")},
          {"friction", quantity(g.friction_Nm, "Nm")},
          {"windage", quantity(g.windage_Nms2, "Nm s^2/rad^2")}};
}

double effect_parameter(const PlantConfig& config, const std::string& effect, const std::string& parameter) {
  for (const auto& e : config.effects) {
    if (e->name() != effect) continue;
    for (const auto& p : e->parameters()) {
      if (p.name == parameter) return p.value;
    }
  }
  return 0.0;
}

// What a fit with the commanded voltages finds between command and terminals, per phase against its current.
Json inverter_json(const PlantConfig& c) {
  const InverterConfig& v = c.inverter;
  const auto part = [&](const char* name) { return effect_parameter(c, "inverter_dead_time", name); };
  const bool switching = v.kind == InverterConfig::Kind::kSwitching;
  const double cycle_s =
      1e-9 * static_cast<double>(switching && v.carrier_ns > 0 ? v.carrier_ns : c.pwm_time_ns);
  return {{"kind", switching ? "switching" : "averaged"},
          {"dc_link", quantity(v.dc_link_V, "V")},
          {"cycle", quantity(cycle_s, "s")},
          {"dead_time_voltage", quantity(v.dc_link_V * part("dead_time_s") / cycle_s, "V")},
          {"device_drop", quantity(part("drop_V"), "V")},
          {"device_resistance", quantity(part("drop_ohm"), "ohm")},
          {"source_resistance", quantity(v.source_ohm, "ohm")}};
}

// The three channels from the physical value to the reading, drawn and stated errors together: reading =
// (1 + gain_error) x + offset for values that sum to zero, where cross-talk is a gain.
Json channels_json(const PlantConfig& c, const std::string& effect, const std::array<double, 3>& drawn_gain,
                   const std::array<double, 3>& drawn_offset_counts, double per_count, const char* unit) {
  Json gains = Json::object(), offsets = Json::object();
  const double crosstalk = effect_parameter(c, effect, "crosstalk");
  for (std::size_t k = 0; k < 3; ++k) {
    const std::string phase(1, "abc"[k]);
    const double gain = (1.0 + effect_parameter(c, effect, "gain_" + phase)) * (1.0 - crosstalk);
    const double offset = effect_parameter(c, effect, "offset_" + phase);
    gains[phase] = quantity((1.0 + drawn_gain[k]) * gain - 1.0, "1");
    offsets[phase] = quantity((1.0 + drawn_gain[k]) * offset + drawn_offset_counts[k] * per_count, unit);
  }
  return {{"gain_error", gains}, {"offset", offsets}};
}

Json sensors_json(const PlantConfig& config) {
  const SensorErrors errors = draw_sensor_errors(config.sensors, config.seed);
  const SensorScale scale = sensor_scale(config.sensors);
  const bool ideal = config.sensors.ideal;
  Json gain_i = Json::array(), gain_v = Json::array();
  for (std::size_t k = 0; k < 3; ++k) {
    gain_i.push_back(1.0 + errors.current_gain[k]);
    gain_v.push_back(1.0 + errors.voltage_gain[k]);
  }
  Json current = channels_json(config, "current_sensors", errors.current_gain, errors.current_offset_counts,
                               scale.current_A_per_count, "A");
  current["lag"] = quantity(effect_parameter(config, "current_sensors", "lag_s") +
                                effect_parameter(config, "current_sensors", "delay_s"),
                            "s");
  Json voltage = channels_json(config, "voltage_sensors", errors.voltage_gain, errors.voltage_offset_counts,
                               scale.voltage_V_per_count, "V");
  voltage["lag"] = quantity(config.sensors.voltage_filter_s, "s");
  return {{"seed", config.seed},
          {"ideal", ideal},
          {"current_gain", gain_i},
          {"voltage_gain", gain_v},
          {"current_offset_counts", errors.current_offset_counts},
          {"voltage_offset_counts", errors.voltage_offset_counts},
          {"current_noise", quantity(ideal ? 0.0 : config.sensors.current_noise_A, "A")},
          {"voltage_noise", quantity(ideal ? 0.0 : config.sensors.voltage_noise_V, "V")},
          {"voltage_filter", quantity(config.sensors.voltage_filter_s, "s")},
          {"current", current},
          {"voltage", voltage},
          {"clock_error", quantity(1e-6 * config.sensors.clock_ppm, "1")},
          {"torque_gain", quantity(config.sensors.torque_gain, "1")},
          {"torque_offset", quantity(config.sensors.torque_offset_Nm, "Nm")},
          {"adc_bits", ideal ? 16 : config.sensors.adc_bits},
          {"encoder_counts_per_rev", config.sensors.encoder_counts_per_rev}};
}

Json effects_json(const PlantConfig& config) {
  Json effects = Json::object();
  for (const auto& effect : config.effects) {
    Json& parameters = effects[effect->name()] = Json::object();
    for (const auto& p : effect->parameters()) parameters[p.name] = quantity(p.value, p.unit.c_str());
  }
  return effects;
}

Json truth(const PlantConfig& config) {
  const MachineConfig& m = config.machine;
  const InverseGamma g = inverse_gamma_truth(config);
  return {{"version", 1},
          {"plant", config.name},
          {"circuit", "inverse-gamma"},
          {"pole_pairs", m.pole_pairs},
          {"parameters",
           {{"R_s", quantity(g.R_s_ohm, "ohm")},
            {"R_r", quantity(g.R_r_ohm, "ohm")},
            {"L_l", quantity(g.L_l_H, "H")},
            {"L_m", quantity(g.L_m_H, "H")}}},
          {"t_circuit",
           {{"R_s", quantity(m.R_s_ohm, "ohm")},
            {"R_r", quantity(m.R_r_ohm, "ohm")},
            {"L_s", quantity(m.L_s_H, "H")},
            {"L_r", quantity(m.L_r_H, "H")},
            {"L_m", quantity(m.L_m_H, "H")}}},
          {"mechanics", {{"J", quantity(config.mechanics.J_kgm2, "kg m^2")}}},
          {"effects", effects_json(config)},
          {"generator", generator_json(config.generator)},
          {"inverter", inverter_json(config)},
          {"sensors", sensors_json(config)}};
}

Json vector(std::complex<double> x, const char* unit) {
  return {{"d", quantity(x.real(), unit)}, {"q", quantity(x.imag(), unit)}};
}

Json inductance(const IncrementalInductance& L) {
  return {{"dd", quantity(L.dd, "H")}, {"dq", quantity(L.dq, "H")}, {"qq", quantity(L.qq, "H")}};
}

Json point_parameters(const OperatingPoint& p) {
  Json gamma{{"R_s", quantity(p.secant.R_s_ohm, "ohm")},
             {"R_r", quantity(p.secant.R_r_ohm, "ohm")},
             {"L_l", quantity(p.secant.L_l_H, "H")},
             {"L_m", quantity(p.secant.L_m_H, "H")},
             {"L_l_incremental", inductance(p.L_l_incremental)},
             {"L_m_incremental", inductance(p.L_m_incremental)}};
  gamma["R_c"] = p.R_c_ohm ? quantity(*p.R_c_ohm, "ohm") : Json(nullptr);
  return gamma;
}

Json t_parameters(const OperatingPoint& p) {
  return {{"R_s", quantity(p.R_s_ohm, "ohm")},
          {"R_r", quantity(p.R_r_ohm, "ohm")},
          {"L_m", quantity(p.L_m_H, "H")},
          {"L_ls", quantity(p.L_ls_H, "H")},
          {"L_lr", quantity(p.L_lr_H, "H")},
          {"L_lr_skin", quantity(p.L_x_H, "H")},
          {"L_m_incremental", inductance(p.L_mT_incremental)}};
}

Json point_json(const OperatingPoint& p) {
  return {{"conditions",
           {{"f", quantity(p.f_Hz, "Hz")},
            {"v", quantity(p.v_V, "V")},
            {"slip", quantity(p.slip, "1")},
            {"w_s", quantity(p.w_slip_rad_s, "rad/s")},
            {"speed", quantity(p.speed_rpm, "rpm")}}},
          {"parameters", point_parameters(p)},
          {"t_circuit", t_parameters(p)},
          {"currents",
           {{"I_d_e", quantity(p.i_s.real(), "A")},
            {"I_q_e", quantity(p.i_s.imag(), "A")},
            {"stator", quantity(std::abs(p.i_s), "A")},
            {"magnetizing", quantity(std::abs(p.i_s + p.i_r), "A")},
            {"rotor", vector(p.i_r, "A")}}},
          {"fluxes",
           {{"stator", vector(p.psi_s, "Wb")},
            {"air_gap", vector(p.psi_m, "Wb")},
            {"rotor", quantity(p.psi_r.real(), "Wb")}}},
          {"powers",
           {{"electrical", quantity(p.in_W, "W")},
            {"power_factor", quantity(p.power_factor, "1")},
            {"torque", quantity(p.torque_Nm, "Nm")},
            {"shaft_torque", quantity(p.shaft_Nm, "Nm")}}},
          {"losses",
           {{"stator_copper", quantity(p.losses.stator_copper_W, "W")},
            {"rotor_copper", quantity(p.losses.rotor_copper_W, "W")},
            {"iron", quantity(p.losses.iron_W, "W")},
            {"stray", quantity(p.losses.stray_W, "W")},
            {"friction", quantity(p.losses.friction_W, "W")}}},
          {"temperatures",
           {{"stator", quantity(p.temperature.stator_C, "C")},
            {"rotor", quantity(p.temperature.rotor_C, "C")},
            {"iron", quantity(p.temperature.iron_C, "C")},
            {"ambient", quantity(p.temperature.ambient_C, "C")}}}};
}

Json truth(const PlantConfig& config, const PointRequest& at) {
  Json all = truth(config);
  all["operating_point"] = point_json(find_operating_point(config, at));
  return all;
}

void list(const Json& node, const std::string& path, std::string& out) {
  if (node.is_object() && node.contains("value")) {
    out +=
        fmt::format("{:<36} {:.6g} {}\n", path, node["value"].get<double>(), node["unit"].get<std::string>());
  } else if (node.is_object()) {
    for (const auto& [key, value] : node.items()) list(value, path.empty() ? key : path + "." + key, out);
  } else {
    out += fmt::format("{:<36} {}\n", path, node.is_string() ? node.get<std::string>() : node.dump());
  }
}

}  // namespace

InverseGamma inverse_gamma_truth(const PlantConfig& config) {
  const MachineConfig& m = config.machine;
  const double k = m.L_m_H / m.L_r_H;
  return {m.R_s_ohm, m.R_r_ohm * k * k, m.L_s_H - m.L_m_H * k, m.L_m_H * k};
}

std::string truth_json(const PlantConfig& config) { return truth(config).dump(2) + "\n"; }

std::string truth_json(const PlantConfig& config, const PointRequest& at) {
  return truth(config, at).dump(2) + "\n";
}

std::string truth_text(const PlantConfig& config) {
  std::string out;
  list(truth(config), "", out);
  return out;
}

std::string truth_text(const PlantConfig& config, const PointRequest& at) {
  std::string out;
  list(truth(config, at), "", out);
  return out;
}

}  // namespace imrig::plant
