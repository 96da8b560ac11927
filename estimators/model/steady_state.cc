#include "estimators/model/steady_state.h"

#include <complex>

namespace imrig::est {

namespace {

// The stator and the magnetizing branch as seen from R_r/s.
struct Thevenin {
  double K = 0.0;  // (3/2) n_p |V_t|^2 / w_e
  double R = 0.0;
  double Z = 0.0;  // |Z_t|
};

Thevenin thevenin(const MachineParameters<double>& p, int pole_pairs, double v_peak_V, double w_e) {
  using Complex = std::complex<double>;
  const Complex X_m(0.0, w_e * p.L_m);
  const Complex stator(p.R_s, w_e * p.L_l);
  const Complex share = X_m / (stator + X_m);
  const Complex Z = share * stator;
  return {1.5 * pole_pairs * std::norm(v_peak_V * share) / w_e, Z.real(), std::abs(Z)};
}

}  // namespace

PullOut pull_out(const MachineParameters<double>& p, int pole_pairs, double v_peak_V, double w_e) {
  const Thevenin t = thevenin(p, pole_pairs, v_peak_V, w_e);
  return {p.R_r / t.Z, t.K / (2.0 * (t.R + t.Z))};
}

std::optional<double> slip_for_torque(const MachineParameters<double>& p, int pole_pairs, double v_peak_V,
                                      double w_e, double torque_Nm) {
  if (torque_Nm == 0.0) return 0.0;
  // x^2 - b x + |Z_t|^2 = 0 with b = K/T - 2 R_t; the stable root is the one with the larger |x|.
  const Thevenin t = thevenin(p, pole_pairs, v_peak_V, w_e);
  const double b = t.K / torque_Nm - 2.0 * t.R;
  const double below = b * b - 4.0 * t.Z * t.Z;
  if (below < 0.0 || b * torque_Nm < 0.0) return std::nullopt;
  const double x = 0.5 * (b + std::copysign(std::sqrt(below), b));
  return p.R_r / x;
}

std::optional<LoadedState> operating_point(const MachineParameters<double>& p, int pole_pairs,
                                              double v_peak_V, double f_Hz, double torque_Nm) {
  const double w_e = 2.0 * kPi * f_Hz;
  const auto slip = slip_for_torque(p, pole_pairs, v_peak_V, w_e, torque_Nm);
  if (!slip) return std::nullopt;
  const double w_r = (1.0 - *slip) * w_e;
  return LoadedState{*slip, w_r / pole_pairs, steady_state(p, pole_pairs, v_peak_V, w_e, w_r)};
}

}  // namespace imrig::est
