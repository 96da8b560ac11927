#include "rig/base/rig_config.h"

#include <fmt/format.h>

#include <functional>

#include "rig/base/config_reader.h"
#include "rig/base/file.h"
#include "rig/base/toml_text.h"

namespace imrig {

namespace {

constexpr double kTiny = 1e-12;

// One description of the file serves reading and writing, so the two cannot drift apart.
class Reading {
 public:
  explicit Reading(ConfigReader table) : table_(std::move(table)) {}
  void value(const char* key, double& x, Range range) { x = table_.number_or(key, x, range); }
  void value(const char* key, int& x, Range range) { x = static_cast<int>(table_.integer_or(key, x, range)); }
  void value(const char* key, std::string& x) { x = table_.text_or(key, x); }

 private:
  ConfigReader table_;
};

class Writing {
 public:
  explicit Writing(std::string& text) : text_(text) {}
  void value(const char* key, double x, Range) { text_ += fmt::format("{} = {}\n", key, toml_number(x)); }
  void value(const char* key, int x, Range) { text_ += fmt::format("{} = {}\n", key, x); }
  void value(const char* key, const std::string& x) {
    text_ += fmt::format("{} = {}\n", key, toml_quoted(x));
  }

 private:
  std::string& text_;
};

template <class V, class C>
void visit_bus(V& v, C& c) {
  v.value("url", c.url);
  v.value("prefix", c.prefix);
}

template <class V, class C>
void visit_motor(V& v, C& c) {
  v.value("name", c.name);
  v.value("pole_pairs", c.pole_pairs, {1, 100});
  v.value("rated_voltage_V", c.rated_voltage_V, {1, 1e5});
  v.value("rated_frequency_Hz", c.rated_frequency_Hz, {1, 2000});
  v.value("rated_current_A", c.rated_current_A, {1e-3, 1e5});
  v.value("rated_speed_rpm", c.rated_speed_rpm, {1, 2e5});
  v.value("rated_power_W", c.rated_power_W, {1e-3, 1e8});
  v.value("R_s_ohm", c.R_s_ohm, {kTiny, 1e5});
  v.value("R_r_ohm", c.R_r_ohm, {kTiny, 1e5});
  v.value("L_l_H", c.L_l_H, {kTiny, 1e3});
  v.value("L_m_H", c.L_m_H, {kTiny, 1e4});
  v.value("friction_Nm", c.friction_Nm, {0, 1e6});
  v.value("J_kgm2", c.J_kgm2, {kTiny, 1e6});
}

template <class V, class C>
void visit_limits(V& v, C& c) {
  v.value("current_A", c.current_A, {1e-3, 1e6});
  v.value("voltage_V", c.voltage_V, {1e-3, 1e6});
  v.value("speed_rpm", c.speed_rpm, {1, 2e5});
  v.value("stator_C", c.stator_C, {-50, 400});
  v.value("link_silence_ms", c.link_silence_ms, {20, 60000});
  v.value("device_watchdog_ms", c.device_watchdog_ms, {20, 2000});
  v.value("lease_ms", c.lease_ms, {100, 60000});
  v.value("peer_silence_ms", c.peer_silence_ms, {100, 60000});
  v.value("max_lost_blocks", c.max_lost_blocks, {0, 1e9});
}

template <class V, class C>
void visit_bridge(V& v, C& c) {
  v.value("link", c.link);
  v.value("credit_blocks", c.credit_blocks, {2, 4096});
}

template <class V, class C>
void visit_dyno(V& v, C& c) {
  v.value("link", c.link);
  v.value("register_map", c.register_map);
  v.value("max_V", c.max_V, {0, 1e4});
  v.value("max_A", c.max_A, {0, 1e4});
  v.value("ramp_V_per_s", c.ramp_V_per_s, {1e-3, 1e6});
  v.value("ramp_A_per_s", c.ramp_A_per_s, {1e-3, 1e6});
  v.value("response_ms", c.response_ms, {1, 10000});
  v.value("poll_ms", c.poll_ms, {1, 10000});
}

template <class V, class C>
void visit_generator(V& v, C& c) {
  v.value("pole_pairs", c.pole_pairs, {1, 100});
  v.value("flux_per_field_A_Wb", c.flux_per_field_A_Wb, {kTiny, 1e4});
  v.value("L_s_H", c.L_s_H, {0, 1e3});
  v.value("R_a_ohm", c.R_a_ohm, {0, 1e5});
  v.value("R_load_ohm", c.R_load_ohm, {kTiny, 1e6});
  v.value("R_field_ohm", c.R_field_ohm, {kTiny, 1e6});
}

template <class V, class C>
void visit_accuracy(V& v, C& c) {
  v.value("current_gain", c.current_gain, {0, 0.5});
  v.value("voltage_gain", c.voltage_gain, {0, 0.5});
}

template <class Section, class Config>
void visit_all(Section section, Config& config) {
  section("bus", [](auto& v, auto& c) { visit_bus(v, c); }, config.bus);
  section("motor", [](auto& v, auto& c) { visit_motor(v, c); }, config.motor);
  section("limits", [](auto& v, auto& c) { visit_limits(v, c); }, config.limits);
  section("bridge", [](auto& v, auto& c) { visit_bridge(v, c); }, config.bridge);
  section("dyno", [](auto& v, auto& c) { visit_dyno(v, c); }, config.dyno);
  section("generator", [](auto& v, auto& c) { visit_generator(v, c); }, config.generator);
  section("accuracy", [](auto& v, auto& c) { visit_accuracy(v, c); }, config.accuracy);
}

}  // namespace

RigConfig parse_rig_config(const std::string& text, const std::string& name) {
  const ConfigReader file = ConfigReader::from_text(text, name);
  RigConfig config;
  file.integer("version", {1, 1});
  visit_all(
      [&](const char* table, auto visit, auto& part) {
        if (auto found = file.table_if(table)) {
          Reading reading(*found);
          visit(reading, part);
        }
      },
      config);
  file.finish();
  config.hash = fnv1a64(text);
  return config;
}

RigConfig load_rig_config(const std::string& path) { return parse_rig_config(read_text(path, 1u << 20), path); }

std::string to_toml(const RigConfig& config) {
  std::string text = "version = 1\n";
  visit_all(
      [&](const char* table, auto visit, const auto& part) {
        text += fmt::format("\n[{}]\n", table);
        Writing writing(text);
        visit(writing, part);
      },
      config);
  return text;
}

}  // namespace imrig
