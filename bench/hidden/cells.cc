#include "bench/hidden/cells.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "rig/base/error.h"

namespace imrig::bench {
namespace {

constexpr double kMu0 = 1.25663706212e-6, kAluminium_ohm_m = 2.83e-8, kBarShare = 0.6;
constexpr double kCornerOfBars_rad_s = 120.0;

double of(Strength strength, std::array<double, 3> values) {
  return values[static_cast<std::size_t>(strength)];
}

// The bar's height whose slot leakage is this share of the rotor's: rho tau / mu_0 = h^2.
double bar_height_m(const Machine& m, double share) {
  const double tau_s = 3.0 * share * m.rotor_leakage_H / (kBarShare * m.rotor_R);
  return std::sqrt(kAluminium_ohm_m * tau_s / kMu0);
}

std::string heat(double stator_C, double rotor_C, bool in_stator) {
  return fmt::format(
      "[effects.thermal]\nstator_J_per_K = 1e6\nrotor_J_per_K = 1e6\niron_J_per_K = 1e6\nspeedup = 0.0\n"
      "stator_C = {}\nrotor_C = {}\n{} = 1e12\n",
      stator_C, rotor_C, in_stator ? "rotor_k_C" : "stator_k_C");
}

}  // namespace

const char* word(Strength strength) {
  const char* words[] = {"weak", "medium", "strong"};
  return words[static_cast<std::size_t>(strength)];
}

const std::vector<Kind>& kinds() {
  static const std::vector<Kind> all{{"magnetizing_saturation", "magnetizing_saturation"},
                                     {"leakage_saturation", "leakage_saturation"},
                                     {"rotor_skin_effect", "rotor_skin_effect"},
                                     {"iron_loss", "core_loss"},
                                     {"rotor_heating", "rotor_heating"},
                                     {"stator_heating", "stator_heating"},
                                     {"inverter_dead_time", "inverter_dead_time", true},
                                     {"voltage_gain", "supply_unbalance"},
                                     {"current_gain", "current_gain"},
                                     {"current_offset", "current_offset", false, "", true},
                                     {"stator_unbalance", "stator_unbalance"},
                                     {"broken_bar", "broken_bar"},
                                     {"voltage_lag", "voltage_lag", false, "", true},
                                     {"speed_bias", "speed_bias", false, "", true},
                                     {"friction", "friction_windage", false, "", true, true},
                                     {"stray_load_loss", "stray_load_loss", false, "", true, true},
                                     {"interbar_current", "", false, "rotor_skin_effect"},
                                     {"dc_link_ripple", "", true},
                                     {"clock_jitter", ""},
                                     {"adc_clipping", ""},
                                     {"eccentricity", ""}};
  return all;
}

const Kind& kind(const std::string& name) {
  for (const Kind& k : kinds()) {
    if (k.name == name) return k;
  }
  throw Error("hidden", "nothing called \"" + name + "\" can be hidden");
}

const std::vector<Cell>& cells() {
  static const std::vector<Cell> all = [] {
    std::vector<Cell> list{{"nothing"}, {"nothing_commanded"}};
    for (const Kind& k : kinds()) list.push_back({k.name, {k.name}});
    for (const auto& [a, b] :
         {std::pair{"magnetizing_saturation", "leakage_saturation"},
          std::pair{"rotor_skin_effect", "rotor_heating"}, std::pair{"iron_loss", "magnetizing_saturation"},
          std::pair{"friction", "iron_loss"}})
      list.push_back({fmt::format("{}+{}", a, b), {a, b}});
    list.push_back({"triple", {}, 3});
    list.push_back({.name = "nothing_torque", .torque = true});
    for (const NoiseFlavour& n : noise_flavours()) list.push_back({"nothing_" + n.name, {}, 0, false, n});
    for (const Kind& k : kinds()) {
      // Core loss and a speed error are one and the same to every measurement at the terminals.
      const bool gauge = k.truth == "core_loss" || k.truth == "speed_bias";
      if (!k.truth.empty() && !gauge) list.push_back({k.name + "_removed", {k.name}, 0, true});
    }
    for (const char* other : {"permanent_magnet", "reluctance"}) list.push_back({other, {}, 0, false, {}, other});
    return list;
  }();
  return all;
}

std::vector<std::string> hidden_in(const Cell& cell, std::uint64_t seed) {
  // Without twins: each of them can be told from all the others.
  std::vector<std::string> pool{"magnetizing_saturation", "leakage_saturation", "rotor_skin_effect", "iron_loss",
                                "rotor_heating",          "current_gain",       "voltage_lag",
                                "stator_unbalance",       "broken_bar"};
  std::vector<std::string> out = cell.hidden;
  std::mt19937_64 bits(seed * 0xa0761d6478bd642full + 3);
  for (int n = 0; n < cell.drawn; ++n) {
    const auto at = static_cast<std::ptrdiff_t>(bits() % pool.size());
    out.push_back(pool[static_cast<std::size_t>(at)]);
    pool.erase(pool.begin() + at);
  }
  return out;
}

const Cell& cell(const std::string& name) {
  for (const Cell& c : cells()) {
    if (c.name == name) return c;
  }
  throw Error("hidden", "there is no cell called \"" + name + "\"");
}

void add_flaw(const Machine& m, const std::string& name, Strength strength, double warmth, Flaw& flaw) {
  const auto size = [&](double weak, double medium, double strong) {
    return of(strength, {weak, medium, strong});
  };
  std::string& e = flaw.effects;
  if (name == "magnetizing_saturation") {
    e += fmt::format("[effects.{}]\nsaturated_ratio = 0.25\nknee_Wb = {}\n", name,
                     size(1.15, 0.95, 0.75) * m.psi_Wb);
  } else if (name == "leakage_saturation") {
    const double knee_A = size(2.4, 1.6, 1.0) * m.i_A;
    e += fmt::format(
        "[effects.{0}]\nstator_saturated_ratio = 0.5\nstator_knee_A = {1}\nrotor_saturated_ratio = 0.5\n"
        "rotor_knee_A = {1}\n",
        name, knee_A);
  } else if (name == "rotor_skin_effect") {
    e += fmt::format("[effects.{}]\nbar_height_m = {}\nbar_fraction = {}\n", name,
                     bar_height_m(m, size(0.12, 0.3, 0.6)), kBarShare);
  } else if (name == "iron_loss") {
    const double half_W = 0.5 * size(0.01, 0.025, 0.05) * m.power_W;
    e += fmt::format("[effects.{}]\nhysteresis_W = {}\neddy_W = {}\nrated_psi_Wb = {}\nrated_f_Hz = {}\n",
                     name, half_W, half_W, 0.95 * m.psi_Wb, m.f_Hz);
  } else if (name == "rotor_heating" || name == "stator_heating") {
    const double rise_K = size(12.0, 35.0, 80.0) * warmth;
    e += heat(25.0 + rise_K, 25.0 + 1.2 * rise_K, name == "stator_heating");
  } else if (name == "inverter_dead_time") {
    e += fmt::format("[effects.{}]\ndrop_V = {}\nwidth_A = {}\n", name, size(0.003, 0.009, 0.025) * m.v_V,
                     0.01 * m.i_A);
  } else if (name == "voltage_gain") {
    e += fmt::format("[effects.voltage_sensors]\ngain_a = {}\n", size(0.006, 0.015, 0.04));
  } else if (name == "current_gain") {
    e += fmt::format("[effects.current_sensors]\ngain_a = {}\n", size(0.006, 0.015, 0.04));
  } else if (name == "current_offset") {
    e += fmt::format("[effects.current_sensors]\noffset_a = {}\n", size(0.004, 0.012, 0.04) * m.i_A);
  } else if (name == "stator_unbalance") {
    e += fmt::format("[effects.{}]\nextra_a = {}\n", name, size(0.03, 0.08, 0.2));
  } else if (name == "broken_bar") {
    e += fmt::format("[effects.{}]\nbars = 28\nbroken = {}\n", name, size(0.25, 1.0, 2.0));
  } else if (name == "voltage_lag") {
    flaw.extra_lag_s = size(15e-6, 40e-6, 100e-6);
  } else if (name == "speed_bias") {
    flaw.speed_gain = size(5e-4, 2e-3, 6e-3);
  } else if (name == "friction") {
    const double half_Nm = 0.5 * size(0.004, 0.012, 0.03) * m.torque_Nm();
    e += fmt::format("[effects.{}]\ncoulomb_Nm = {}\nviscous_Nms = {}\n", name, half_Nm,
                     half_Nm / m.speed_rad_s());
  } else if (name == "stray_load_loss") {
    e += fmt::format("[effects.{}]\nloss_W = {}\nrated_A = {}\nrated_rpm = {}\n", name,
                     size(0.006, 0.015, 0.03) * m.power_W, m.i_A, rpm_of_rad_s(m.speed_rad_s()));
  } else if (name == "interbar_current") {
    const double L_x = size(0.12, 0.3, 0.6) * m.rotor_leakage_H;
    e += fmt::format("[effects.{}]\ninductance_H = {}\nresistance_ohm = {}\n", name, L_x,
                     L_x * kCornerOfBars_rad_s);
  } else if (name == "dc_link_ripple") {
    flaw.inverter +=
        fmt::format("ripple_V = {}\nripple_Hz = {}\n", size(0.01, 0.03, 0.08) * 2.3 * m.v_V, 6.0 * m.f_Hz);
  } else if (name == "clock_jitter") {
    flaw.sensors += fmt::format("clock_jitter_s = {}\n", size(2e-6, 5e-6, 12e-6));
  } else if (name == "adc_clipping") {
    flaw.current_range = size(2.4, 1.7, 1.2) * m.i_A / m.current_range_A;
  } else if (name == "eccentricity") {
    e += fmt::format("[effects.{0}]\nstatic_share = {1}\ndynamic_share = {1}\n", name, size(0.12, 0.25, 0.4));
  } else {
    throw Error("hidden", "nothing called \"" + name + "\" can be hidden");
  }
}

}  // namespace imrig::bench
