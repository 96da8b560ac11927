#include "estimators/model/export.h"

#include <cmath>
#include <complex>
#include <optional>

#include "estimators/model/convert_model.h"
#include "estimators/model/magnetic_tables.h"
#include "estimators/model/steady_state.h"

namespace imrig::est {

namespace {

constexpr int kRows = 26;
constexpr double kMostFlux = 1.3;        // of the rated
constexpr double kMostCurrent = 2.0;     // of the rated torque current
constexpr double kUnratedFlux_Wb = 0.5;  // where the ratings tell nothing
constexpr double kUnratedCurrent_A = 20.0;

void add_circuit(const Model& model, Circuit circuit, const std::string& prefix, const std::string& title,
                 ExportedModel& out) {
  for (const CircuitParameter& one : parameters_in(model, circuit)) {
    const Parameter& p = one.parameter;
    if (prefix.empty() || one.name != "R_s")
      out.numbers.push_back(
          {prefix + one.name + "_" + p.unit, p.value, p.ci95_low, p.ci95_high, title + ": " + one.meaning + (is_start(p) ? ", a " + p.found : "")});
  }
}

struct Rated {
  double psi_r_Wb, i_d_A, i_q_A, torque_Nm;
};

std::optional<Rated> rated_point(const Model& model) {
  const Ratings& r = model.ratings;
  if (!(r.voltage_V > 0.0 && r.frequency_Hz > 0.0 && r.speed_rpm > 0.0)) return std::nullopt;
  const double w_e = 2.0 * kPi * r.frequency_Hz;
  const double v_peak = r.voltage_V * std::sqrt(2.0) / kSqrt3;
  const double w_r = model.pole_pairs * r.speed_rpm * 2.0 * kPi / 60.0;
  const auto s = steady_state(model.machine(), model.pole_pairs, v_peak, w_e, w_r);
  const std::complex<double> psi = plain(s.psi_r), i = plain(s.i_s);
  const double flux = std::abs(psi);
  if (!(flux > 0.0) || !(s.torque_Nm > 0.0)) return std::nullopt;
  const auto no_load = magnetizing_table(model, flux, 1);
  return Rated{flux, no_load.back().i_d_A, std::imag(i * std::conj(psi)) / flux, s.torque_Nm};
}

void add_drive(const Model& model, const std::optional<Rated>& rated, ExportedModel& out) {
  const MachineParameters<double> p = model.machine();
  const auto add = [&](const char* name, double value, const char* meaning) {
    out.numbers.push_back({name, value, kMissing, kMissing, meaning});
  };
  add("rotor_time_constant_s", p.L_m / p.R_r,
      "L_m/R_r; slip frequency w_s = i_q/(tau i_d) in rotor-flux orientation");
  add("sigma", p.L_l / (p.L_l + p.L_m), "total leakage factor; sigma L_s = L_l of the inverse-gamma circuit");
  add("current_loop_R_ohm", p.R_s + p.R_r, "resistance that a fast current loop sees, beside L_l");
  add("torque_per_psi_r_i_q", 1.5 * model.pole_pairs, "N m per (Wb A): T = this * psi_r * i_q");
  if (!rated) return;
  add("rated_psi_r_Wb", rated->psi_r_Wb, "rotor flux at rated voltage, frequency and speed, peak");
  add("rated_i_d_A", rated->i_d_A, "flux current at that flux, peak");
  add("rated_i_q_A", rated->i_q_A, "torque current there, peak");
  add("rated_torque_Nm", rated->torque_Nm, "air-gap torque there");
}

void add_tables(const Model& model, const std::optional<Rated>& rated, ExportedModel& out) {
  const double flux = rated ? rated->psi_r_Wb : kUnratedFlux_Wb;
  ExportedTable magnetizing{"magnetizing",
                            "no load, against the rotor flux",
                            {"psi_r_Wb", "i_d_A", "L_m_H", "L_m_incremental_H"},
                            {}};
  for (const MagnetizingRow& row : magnetizing_table(model, kMostFlux * flux, kRows))
    magnetizing.rows.push_back({row.psi_r_Wb, row.i_d_A, row.L_m_H, row.L_m_incremental_H});
  ExportedTable leakage{
      "leakage", "at the rated rotor flux, against the torque current", {"i_q_A", "i_s_A", "L_l_H"}, {}};
  for (const LeakageRow& row :
       leakage_table(model, flux, rated ? kMostCurrent * rated->i_q_A : kUnratedCurrent_A, kRows))
    leakage.rows.push_back({row.i_q_A, row.i_s_A, row.L_l_H});
  out.tables = {magnetizing, leakage};
}

}  // namespace

ExportedModel exported(const Model& model) {
  ExportedModel out;
  out.name = model.name;
  out.pole_pairs = model.pole_pairs;
  out.delta = model.delta;
  add_circuit(model, Circuit::kInverseGammaCircuit, "", "inverse-gamma circuit", out);
  add_circuit(model, Circuit::kTCircuit, "T_", "T circuit, L_s = L_r", out);
  add_circuit(model, Circuit::kGammaCircuit, "G_", "gamma circuit", out);
  const auto rated = rated_point(model);
  add_drive(model, rated, out);
  add_tables(model, rated, out);
  for (const ActiveEffect& effect : model.effects) {
    for (const auto& [name, p] : effect.parameters)
      out.numbers.push_back({effect.name + "_" + name, p.value, p.ci95_low, p.ci95_high,
                             "effect " + effect.name + (p.unit.empty() ? "" : ", " + p.unit)});
  }
  return out;
}

}  // namespace imrig::est
