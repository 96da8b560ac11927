#pragma once
// Fluxes and parameters at once: an extended Kalman filter over psi_s, psi_r and the logarithms of R_s, R_r, L_l,
// L_m, driven by voltage and speed, corrected by the current. Inverse-gamma circuit, stator frame (base_machine.h):
//   x' = f(x, theta) + voltage noise,   theta' = 0 + drift,   i = (psi_s - psi_r)/L_l + current noise
// The mean goes from sample to sample by Heun's rule; the covariance every kStride samples, with
//   Phi = exp(A kStride h) to fourth order,  dx/dtheta = kStride h (Phi g_0 + g_1)/2,  g = df/dtheta
// A prior sigma of 0 fixes a parameter. Beside the paper's observer it needs no steady state, and it says how well
// it knows. Saturation and iron loss come from the model and go into the mean and the slopes of the parameters
// (iron_circuit.h); Phi, the covariance's, is that of the linear circuit. The current's noise is taken as white.
// Source: Salvatore, Stasi and Tarchioni 1993 (IEEE Trans. Ind. Electron. 40) for the principle; here in flux states.

#include <Eigen/Core>
#include <array>
#include <complex>

#include "estimators/model/base_machine.h"
#include "estimators/online/iron_circuit.h"

namespace imrig::est {

struct JointFilterConfig {
  MachineParameters<double> start;
  MachineParameters<double> sigma;       // prior, relative
  MachineParameters<double> drift;       // relative, per square root of a second
  IronConfig iron;
  // Per component, of what take() is given. Well above the converters' noise: unequal gains and what the circuit
  // leaves out do not average away, and a filter that trusts each sample takes them for resistances.
  double current_noise_A = 0.3;
  double voltage_noise_V = 1.0;
};

class JointFilter {
 public:
  static constexpr int kStride = 8;

  explicit JointFilter(const JointFilterConfig& config);
  // Parameters and fluxes from the start.
  void reset(double flux_sigma_Wb);
  // The fluxes are lost, the parameters stay.
  void lose_flux(double flux_sigma_Wb);
  // One sample: V, A (both behind the same filter), electrical rad/s.
  void take(std::complex<double> v, std::complex<double> i, double w_r, double h);
  // R_s as known from elsewhere (temperature, direct current), relative sigma of one such word a second, dt_s after
  // the last one. A running motor tells R_s poorly: without it, R_s drifts off and takes L_m along.
  void anchor_R_s(double R_s_ohm, double relative_sigma, double dt_s);

  void set_current_noise(double sigma_A) { config_.current_noise_A = sigma_A; }

  MachineParameters<double> parameters() const;
  MachineParameters<double> relative_sigma() const;
  bool started() const { return corrections_ > 0; }

 private:
  using State = Eigen::Matrix<double, 8, 1>;
  using Square = Eigen::Matrix<double, 8, 8>;
  using Complex = std::complex<double>;
  Complex psi_s() const { return {x_[0], x_[1]}; }
  Complex psi_r() const { return {x_[2], x_[3]}; }
  IronCircuit::Currents currents() const { return iron_.currents(p_, psi_s(), psi_r(), v_, w_r_); }
  FluxState<double> derivative(const FluxState<double>& x, Complex v, double w_r) const;
  void step(std::complex<double> v, double w_r, double h);
  Eigen::Matrix4d slopes() const;  // df/dtheta, rows psi_s, psi_r, columns R_s, R_r, L_l, L_m
  void spread(double w_r, double h);
  void correct(std::complex<double> i);

  JointFilterConfig config_;
  IronCircuit iron_;
  State x_ = State::Zero();
  Square P_ = Square::Zero();
  MachineParameters<double> p_;  // exp of the state's
  Eigen::Matrix4d slopes_ = Eigen::Matrix4d::Zero();
  std::complex<double> v_;
  double w_r_ = 0.0, w_sum_ = 0.0;
  int count_ = 0;
  bool begun_ = false;
  long corrections_ = 0;
};

}  // namespace imrig::est
