#pragma once
// Steady records of the synthetic motors with the torque that a shaft transducer would show, by the
// textbook's T circuit: T = (3/2) n_p R_r |i_r|^2 / w_slip.

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <string>
#include <utility>
#include <vector>

#include "estimators/model/effects/registry.h"
#include "tests/estimators/fit/synthetic.h"

namespace imrig::est::shaft_torque {

inline constexpr double kStep_s = 200e-6;

inline MachineParameters<double> truth(const synthetic::Motor& m) {
  const double L_s = m.L_ls + m.L_m, L_r = m.L_lr + m.L_m, k = m.L_m / L_r;
  return {m.R_s, m.R_r * k * k, L_s - m.L_m * k, m.L_m * k};
}

inline double textbook_torque_Nm(const synthetic::Motor& m, double v_peak_V, double f_Hz, double slip) {
  const double w = 2.0 * kPi * f_Hz;
  using Complex = std::complex<double>;
  const Complex stator(m.R_s, w * m.L_ls), magnetizing(0.0, w * m.L_m), rotor(m.R_r / slip, w * m.L_lr);
  const Complex i_s = v_peak_V / (stator + magnetizing * rotor / (magnetizing + rotor));
  const Complex i_r = i_s * magnetizing / (magnetizing + rotor);
  return 1.5 * m.pole_pairs * m.R_r * std::norm(i_r) / (slip * w);
}

struct Drive {
  double relative_f = 1.0, slip = 0.03, step = 0.0, filter_s = 0.0;
};

// Steady, with the torque that a transducer would show.
inline Record record_of(const synthetic::Motor& m, const Drive& d, double lost_Nm = 0.0) {
  auto c = synthetic::step_case(m, 0.9 * std::abs(d.relative_f), d.relative_f, d.slip, kStep_s, 1600);
  c.step = d.step, c.filter_s = d.filter_s;
  Record out;
  out.id = "steady";
  out.kind = RecordKind::kSteady;
  out.series = synthetic::record(m, c);
  out.series.voltage_filter_s = d.filter_s;
  const double torque_Nm = textbook_torque_Nm(m, c.v_peak_V, std::abs(c.f_Hz), d.slip) - lost_Nm;
  out.series.torque_Nm.assign(out.series.size(), d.relative_f > 0.0 ? torque_Nm : -torque_Nm);
  return out;
}

inline DataSet set_of(const synthetic::Motor& m, std::vector<Record> records) {
  DataSet data;
  data.name = m.name, data.pole_pairs = m.pole_pairs;
  data.noise = {1e-3, 1e-3, 1e-6, kMissing, kMissing};
  data.records = std::move(records);
  return data;
}

inline SharedVector<double> at(const MachineParameters<double>& p) {
  SharedVector<double> out{p.R_s, p.R_r, p.L_l, p.L_m};
  for (std::size_t e = kBase; e < kShared; ++e) out[e] = shared_parameter(e).neutral;
  return out;
}

inline std::size_t entry_of(const std::string& name) {
  for (std::size_t e = kBase; e < kShared; ++e) {
    if (shared_name(e) == name) return e;
  }
  ADD_FAILURE() << name;
  return 0;
}

}  // namespace imrig::est::shaft_torque
