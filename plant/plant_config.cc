#include "plant/plant_config.h"

#include <algorithm>
#include <cmath>

#include "plant/effects/registry.h"
#include "rig/base/config_reader.h"
#include "rig/base/error.h"

namespace imrig::plant {
namespace {

constexpr Range kOhm{0.0, 1e4};
constexpr Range kHenry{1e-6, 1e3};

MachineConfig read_motor(const ConfigReader& table) {
  const auto name = table.text_or("name", "motor");
  const int pole_pairs = static_cast<int>(table.integer("pole_pairs", {1, 50}));
  const double R_s = table.number("R_s_ohm", {1e-4, 1e4}), R_r = table.number("R_r_ohm", {1e-4, 1e4});
  MachineConfig machine;
  if (table.choice("circuit", {"inverse-gamma", "t"}) == "t") {
    machine = {name,
               pole_pairs,
               R_s,
               R_r,
               table.number("L_s_H", kHenry),
               table.number("L_r_H", kHenry),
               table.number("L_m_H", kHenry)};
  } else {
    machine = machine_of_inverse_gamma(R_s, R_r, table.number("L_l_H", kHenry), table.number("L_m_H", kHenry),
                                       pole_pairs);
    machine.name = name;
  }
  return machine;
}

MechanicsConfig read_mechanics(const ConfigReader& table) {
  MechanicsConfig mechanics;
  mechanics.J_kgm2 = table.number_or("J_kgm2", mechanics.J_kgm2, {1e-6, 1e4});
  mechanics.locked = table.boolean_or("locked", mechanics.locked);
  if (table.has("held_speed_rpm")) {
    if (mechanics.locked) table.fail("held_speed_rpm", "the shaft is locked already", "give one of both");
    mechanics.held_speed_rpm = table.number("held_speed_rpm", {-1e5, 1e5});
  }
  return mechanics;
}

InverterConfig read_inverter(const ConfigReader& table) {
  InverterConfig v;
  v.dc_link_V = table.number("dc_link_V", {1.0, 1e5});
  v.kind = table.choice_or("kind", {"averaged", "switching"}, "averaged") == "switching"
               ? InverterConfig::Kind::kSwitching
               : InverterConfig::Kind::kAveraged;
  v.limit = table.choice_or("limit", {"circle", "hexagon"}, "circle") == "hexagon"
                ? InverterConfig::Limit::kHexagon
                : InverterConfig::Limit::kCircle;
  v.carrier_ns = table.integer_or("carrier_ns", v.carrier_ns, {0.0, 1e8});
  v.link_compensated = table.boolean_or("link_compensated", v.link_compensated);
  v.source_ohm = table.number_or("source_ohm", v.source_ohm, {0.0, 1e3});
  v.capacitor_F = table.number_or("capacitor_F", v.capacitor_F, {0.0, 10.0});
  v.ripple_V = table.number_or("ripple_V", v.ripple_V, {0.0, 1e4});
  v.ripple_Hz = table.number_or("ripple_Hz", v.ripple_Hz, {0.0, 1e5});
  v.brake_V = table.number_or("brake_V", v.brake_V, {0.0, 1e6});
  return v;
}

GeneratorConfig read_generator(const ConfigReader& table) {
  GeneratorConfig g;
  g.coupled = table.boolean_or("coupled", g.coupled);
  g.pole_pairs = static_cast<int>(table.integer_or("pole_pairs", g.pole_pairs, {1, 50}));
  g.flux_per_field_A_Wb = table.number_or("flux_per_field_A_Wb", g.flux_per_field_A_Wb, {1e-6, 1e3});
  g.L_s_H = table.number_or("L_s_H", g.L_s_H, kHenry);
  g.R_a_ohm = table.number_or("R_a_ohm", g.R_a_ohm, kOhm);
  if (table.has("box_steps_ohm")) {  // a resistor box with switches: the step that is in
    if (table.has("R_load_ohm")) table.fail("R_load_ohm", "stands beside box_steps_ohm", "one of the two");
    const auto steps = table.numbers("box_steps_ohm", 1, 64, kOhm);
    const auto step = table.integer_or("box_step", 1, {1.0, static_cast<double>(steps.size())});
    g.R_load_ohm = steps[static_cast<std::size_t>(step - 1)];
  }
  g.R_load_ohm = table.number_or("R_load_ohm", g.R_load_ohm, kOhm);
  g.R_field_ohm = table.number_or("R_field_ohm", g.R_field_ohm, {1e-3, 1e5});
  g.L_field_H = table.number_or("L_field_H", g.L_field_H, {1e-6, 1e5});
  g.L_leakage_H = table.number_or("L_leakage_H", 0.1 * g.L_s_H, {1e-7, 1e3});
  g.saturated_ratio = table.number_or("saturated_ratio", g.saturated_ratio, {0.02, 1.0});
  g.knee_Wb = table.number_or("knee_Wb", g.knee_Wb, {1e-6, 1e3});
  g.softness = table.number_or("softness", g.softness, {0.05, 0.95});
  g.core_loss_W = table.number_or("core_loss_W", g.core_loss_W, {0.0, 1e6});
  g.core_psi_Wb = table.number_or("core_psi_Wb", g.core_psi_Wb, {1e-6, 1e3});
  g.core_rpm = table.number_or("core_rpm", g.core_rpm, {1.0, 1e5});
  g.core_eddy_share = table.number_or("core_eddy_share", g.core_eddy_share, {0.0, 1.0});
  g.friction_Nm = table.number_or("friction_Nm", g.friction_Nm, {0.0, 1e3});
  g.windage_Nms2 = table.number_or("windage_Nms2", g.windage_Nms2, {0.0, 10.0});
  return g;
}

SupplyConfig read_supply(const ConfigReader& table) {
  SupplyConfig s;
  s.max_V = table.number_or("max_V", s.max_V, {0.0, 1e4});
  s.max_A = table.number_or("max_A", s.max_A, {0.0, 1e4});
  s.slew_V_per_s = table.number_or("slew_V_per_s", s.slew_V_per_s, {1e-3, 1e9});
  s.kp_V_per_A = table.number_or("kp_V_per_A", s.kp_V_per_A, {0.0, 1e6});
  s.ki_V_per_As = table.number_or("ki_V_per_As", s.ki_V_per_As, {0.0, 1e9});
  return s;
}

SensorsConfig read_sensors(const ConfigReader& table) {
  SensorsConfig s;
  s.ideal = table.boolean_or("ideal", s.ideal);
  s.adc_bits = static_cast<int>(table.integer_or("adc_bits", s.adc_bits, {4, 16}));
  s.current_range_A = table.number_or("current_range_A", s.current_range_A, {1e-3, 1e6});
  s.voltage_range_V = table.number_or("voltage_range_V", s.voltage_range_V, {1e-3, 1e6});
  s.current_noise_A = table.number_or("current_noise_A", s.current_noise_A, {0.0, 1e4});
  s.voltage_noise_V = table.number_or("voltage_noise_V", s.voltage_noise_V, {0.0, 1e4});
  s.gain_sigma = table.number_or("gain_sigma", s.gain_sigma, {0.0, 0.2});
  s.offset_sigma_counts = table.number_or("offset_sigma_counts", s.offset_sigma_counts, {0.0, 1e4});
  s.voltage_filter_s = table.number_or("voltage_filter_s", s.voltage_filter_s, {0.0, 1.0});
  s.encoder_counts_per_rev =
      static_cast<int>(table.integer_or("encoder_counts_per_rev", s.encoder_counts_per_rev, {1, 1 << 24}));
  s.stator_C = table.number_or("stator_C", s.stator_C, {-60.0, 400.0});
  s.encoder_loss = table.number_or("encoder_loss", s.encoder_loss, {0.0, 1.0});
  s.clock_ppm = table.number_or("clock_ppm", s.clock_ppm, {-1e4, 1e4});
  s.clock_jitter_s = table.number_or("clock_jitter_s", s.clock_jitter_s, {0.0, 1e-4});
  s.torque_gain = table.number_or("torque_gain", s.torque_gain, {0.1, 10.0});
  s.torque_offset_Nm = table.number_or("torque_offset_Nm", s.torque_offset_Nm, {-1e4, 1e4});
  return s;
}

IntegratorConfig read_integrator(const ConfigReader& root) {
  IntegratorConfig i;
  i.kind = root.choice_or("integrator", {"sundials", "rk4"}, "sundials") == "rk4"
               ? IntegratorConfig::Kind::kRk4
               : IntegratorConfig::Kind::kSundials;
  i.rtol = root.number_or("rtol", i.rtol, {1e-13, 1e-2});
  i.atol = root.number_or("atol", i.atol, {1e-15, 1e-2});
  return i;
}

void read_effects(const ConfigReader& root, PlantConfig& config) {
  const auto effects = root.table_if("effects");
  if (!effects) return;
  for (const auto& entry : effect_registry()) {
    if (const auto table = effects->table_if(entry.name)) config.effects.push_back(entry.read(*table));
  }
}

PlantConfig read(const ConfigReader& root) {
  root.integer("version", {1, 1});
  PlantConfig c;
  c.name = root.text_or("name", c.name);
  c.seed = static_cast<std::uint64_t>(root.integer_or("seed", 1, {0, 9e15}));
  c.sample_time_ns = root.integer_or("sample_time_ns", c.sample_time_ns, {1000, 1e7});
  c.pwm_time_ns = root.integer_or("pwm_time_ns", c.pwm_time_ns, {1000, 1e8});
  c.integrator = read_integrator(root);
  c.machine = read_motor(root.table("motor"));
  if (const auto table = root.table_if("mechanics")) c.mechanics = read_mechanics(*table);
  if (const auto table = root.table_if("inverter")) c.inverter = read_inverter(*table);
  if (const auto table = root.table_if("generator")) c.generator = read_generator(*table);
  if (const auto table = root.table_if("supply")) c.supply = read_supply(*table);
  if (const auto table = root.table_if("sensors")) c.sensors = read_sensors(*table);
  read_effects(root, c);
  root.finish();
  try {
    validate(c);
  } catch (const Error& error) {
    throw Error(root.file(), error.what());
  }
  return c;
}

// The fastest decay of the circuit, bounded from above, times the sample time: what a fixed step of that
// length still integrates well.
void check_rate(const PlantConfig& c, const std::string& part, double rate) {
  const double times = rate * static_cast<double>(c.sample_time_ns) * 1e-9;
  if (!(times <= 1.0)) {
    throw Error(part, "its circuit settles faster than the sample time",
                "raise its inductance or lower its resistance; rate x sample time is " +
                    std::to_string(times) + " and may be 1");
  }
}

// The saturated generator's leakages, and how fast it settles with the iron saturated all through.
void validate_bent(const PlantConfig& c) {
  const GeneratorConfig& g = c.generator;
  const bool bent = g.saturated_ratio != 1.0;
  if (!bent && g.core_loss_W == 0.0) return;
  const double L_m = g.L_s_H - g.L_leakage_H, M = g.flux_per_field_A_Wb;
  const double field_leakage_H = g.L_field_H - 1.5 * M * M / L_m;
  if (!(g.L_leakage_H > 0.0 && L_m > 0.0 && field_leakage_H > 0.0)) {
    throw Error("generator", "its field winding has no leakage beside L_leakage_H of the armature",
                "L_leakage_H below L_s_H - 1.5 flux_per_field_A_Wb^2 / L_field_H");
  }
  if (!bent) return;
  const double along = 1.0 / (g.saturated_ratio * L_m) + 1.5 * M * M / (L_m * L_m * field_leakage_H);
  check_rate(c, "generator, saturated",
             (g.R_a_ohm + g.R_load_ohm) / (g.L_leakage_H + 1.0 / along) + g.R_field_ohm / field_leakage_H);
}

}  // namespace

MachineConfig machine_of_inverse_gamma(double R_s_ohm, double R_r_ohm, double L_l_H, double L_m_H,
                                       int pole_pairs) {
  const double L = L_l_H + L_m_H;
  return {"motor", pole_pairs, R_s_ohm, R_r_ohm * L / L_m_H, L, L, std::sqrt(L_m_H * L)};
}

PlantConfig load_plant_config(const std::string& path) { return read(ConfigReader::from_file(path)); }

PlantConfig parse_plant_config(const std::string& text, const std::string& name) {
  return read(ConfigReader::from_text(text, name));
}

void validate(const PlantConfig& c) {
  const MachineConfig& m = c.machine;
  const double D = m.L_s_H * m.L_r_H - m.L_m_H * m.L_m_H;
  if (!(m.pole_pairs >= 1))
    throw Error("motor", "pole_pairs is " + std::to_string(m.pole_pairs), "it must be 1 or more");
  if (!(m.R_s_ohm > 0.0 && m.R_r_ohm > 0.0 && m.L_m_H > 0.0 && D > 0.0)) {
    throw Error("motor", "these resistances and inductances are no motor",
                "all positive, and L_m^2 < L_s L_r in the T circuit");
  }
  check_rate(c, "motor", (m.R_s_ohm * m.L_r_H + m.R_r_ohm * m.L_s_H) / D);
  if (!(c.mechanics.J_kgm2 > 0.0)) throw Error("mechanics", "the inertia is not positive");
  const GeneratorConfig& g = c.generator;
  const double G = g.L_s_H * g.L_field_H - 1.5 * g.flux_per_field_A_Wb * g.flux_per_field_A_Wb;
  if (!(g.R_field_ohm > 0.0 && G > 0.0)) {
    throw Error("generator", "field and armature are coupled more than fully",
                "L_field_H must exceed 1.5 flux_per_field_A_Wb^2 / L_s_H");
  }
  check_rate(c, "generator", ((g.R_a_ohm + g.R_load_ohm) * g.L_field_H + g.R_field_ohm * g.L_s_H) / G);
  validate_bent(c);
  if (c.sample_time_ns <= 0 || c.pwm_time_ns < c.sample_time_ns || c.pwm_time_ns % c.sample_time_ns != 0) {
    throw Error("pwm_time_ns", "is no whole multiple of sample_time_ns");
  }
  const InverterConfig& v = c.inverter;
  if (v.carrier_ns != 0 && v.carrier_ns < 1000) throw Error("inverter", "carrier_ns is below a microsecond");
  if (!(v.ripple_V < 0.9 * v.dc_link_V)) throw Error("inverter", "ripple_V leaves no DC link voltage");
  if (v.brake_V != 0.0 && !(v.brake_V > v.dc_link_V)) {
    throw Error("inverter", "brake_V is not above dc_link_V", "0 for no brake chopper");
  }
  const SensorsConfig& s = c.sensors;
  if (!(s.voltage_filter_s >= 0.0 && s.current_range_A > 0.0 && s.voltage_range_V > 0.0)) {
    throw Error("sensors", "ranges must be positive and the filter's time constant not negative");
  }
  if (s.adc_bits < 4 || s.adc_bits > 16 || s.encoder_counts_per_rev < 1) {
    throw Error("sensors", "adc_bits must lie in 4..16 and encoder_counts_per_rev be 1 or more");
  }
}

}  // namespace imrig::plant
