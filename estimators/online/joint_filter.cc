#include "estimators/online/joint_filter.h"

#include <algorithm>
#include <cmath>

namespace imrig::est {

namespace {

constexpr double kMostLog = 1.5;  // of a parameter from its start: beyond, the filter has lost its way

std::array<double, 4> listed(const MachineParameters<double>& p) { return {p.R_s, p.R_r, p.L_l, p.L_m}; }

}  // namespace

JointFilter::JointFilter(const JointFilterConfig& config) : config_(config), iron_(config.iron) { reset(1.0); }

void JointFilter::reset(double flux_sigma_Wb) {
  const auto start = listed(config_.start), sigma = listed(config_.sigma);
  P_.setZero();
  for (int k = 0; k < 4; ++k) {
    const auto at = static_cast<std::size_t>(k);
    x_[4 + k] = std::log(start[at]);
    P_(4 + k, 4 + k) = sigma[at] * sigma[at];
  }
  p_ = config_.start;
  corrections_ = 0;
  lose_flux(flux_sigma_Wb);
}

void JointFilter::lose_flux(double flux_sigma_Wb) {
  x_.head<4>().setZero();
  P_.topRows<4>().setZero();
  P_.leftCols<4>().setZero();
  for (int k = 0; k < 4; ++k) P_(k, k) = flux_sigma_Wb * flux_sigma_Wb;
  begun_ = false;
  count_ = 0;
}

FluxState<double> JointFilter::derivative(const FluxState<double>& x, Complex v, double w_r) const {
  if (!config_.iron.any()) return BaseMachine<double>(p_).derivative(x, v, w_r, 0.0);
  const Complex r = plain(x.psi_r);
  const IronCircuit::Currents i = iron_.currents(p_, plain(x.psi_s), r, v, w_r);
  return {Cx<double>(v - p_.R_s * i.stator), Cx<double>(p_.R_r * i.rotor + Complex(0.0, w_r) * r)};
}

// Heun's rule on a straight line of the voltage.
void JointFilter::step(std::complex<double> v, double w_r, double h) {
  const FluxState<double> x{Cx<double>(psi_s()), Cx<double>(psi_r())};
  const FluxState<double> a = derivative(x, v_, w_r_);
  const FluxState<double> there{x.psi_s + scaled(h, a.psi_s), x.psi_r + scaled(h, a.psi_r)};
  const FluxState<double> b = derivative(there, v, w_r);
  const double half = 0.5 * h;
  x_[0] += half * (a.psi_s.re + b.psi_s.re);
  x_[1] += half * (a.psi_s.im + b.psi_s.im);
  x_[2] += half * (a.psi_r.re + b.psi_r.re);
  x_[3] += half * (a.psi_r.im + b.psi_r.im);
}

Eigen::Matrix4d JointFilter::slopes() const {
  const IronCircuit::Currents all = currents();
  const auto pair = [](Complex z) { return Eigen::Vector2d(z.real(), z.imag()); };
  const Eigen::Vector2d i = (x_.head<2>() - x_.segment<2>(2)) / p_.L_l, i_m = pair(all.magnetizing);
  Eigen::Matrix4d g = Eigen::Matrix4d::Zero();
  g.block<2, 1>(0, 0) = -p_.R_s * pair(all.stator);
  g.block<2, 1>(2, 1) = p_.R_r * pair(all.rotor);
  g.block<2, 1>(0, 2) = p_.R_s * i;
  g.block<2, 1>(2, 2) = -p_.R_r * i;
  g.block<2, 1>(2, 3) = p_.R_r * i_m;
  return g;
}

void JointFilter::spread(double w_r, double t) {
  const double s = p_.R_s / p_.L_l, r = p_.R_r / p_.L_l, m = p_.R_r / p_.L_m;
  Eigen::Matrix4d A;
  A << -s, 0, s, 0, 0, -s, 0, s, r, 0, -(r + m), -w_r, 0, r, w_r, -(r + m);
  A *= t;
  const Eigen::Matrix4d A2 = A * A;
  const Eigen::Matrix4d Phi = Eigen::Matrix4d::Identity() + A + 0.5 * A2 + (A2 * A) * (1.0 / 6.0) + (A2 * A2) * (1.0 / 24.0);
  const Eigen::Matrix4d now = slopes(), B = (0.5 * t) * (Phi * slopes_ + now);
  slopes_ = now;
  const Eigen::Matrix4d xx = P_.topLeftCorner<4, 4>(), xt = P_.topRightCorner<4, 4>(), tt = P_.bottomRightCorner<4, 4>();
  const Eigen::Matrix4d new_xt = Phi * xt + B * tt;
  const Eigen::Matrix4d cross = Phi * xt * B.transpose();
  Eigen::Matrix4d new_xx = Phi * xx * Phi.transpose() + cross + cross.transpose() + B * tt * B.transpose();
  // White noise of each sample's voltage over a stride.
  const double per_flux = config_.voltage_noise_V * config_.voltage_noise_V * t * t / kStride;
  new_xx(0, 0) += per_flux;
  new_xx(1, 1) += per_flux;
  P_.topLeftCorner<4, 4>() = new_xx;
  P_.topRightCorner<4, 4>() = new_xt;
  P_.bottomLeftCorner<4, 4>() = new_xt.transpose();
  const auto drift = listed(config_.drift);
  for (int k = 0; k < 4; ++k) P_(4 + k, 4 + k) += drift[static_cast<std::size_t>(k)] * drift[static_cast<std::size_t>(k)] * t;
}

void JointFilter::correct(std::complex<double> measured) {
  const double per_L = 1.0 / p_.L_l;
  const Eigen::Vector2d i = (x_.head<2>() - x_.segment<2>(2)) * per_L;
  const Complex drawn = currents().stator;
  const Eigen::Vector2d miss(measured.real() - drawn.real(), measured.imag() - drawn.imag());
  // H = [1/L_l, -1/L_l, 0, 0, -i, 0]
  const Eigen::Matrix<double, 8, 2> PH =
      per_L * (P_.leftCols<2>() - P_.middleCols<2>(2)) - P_.col(6) * i.transpose();
  Eigen::Matrix2d S = per_L * (PH.topRows<2>() - PH.middleRows<2>(2)) - i * PH.row(6);
  S(0, 0) += config_.current_noise_A * config_.current_noise_A;
  S(1, 1) += config_.current_noise_A * config_.current_noise_A;
  const double determinant = S(0, 0) * S(1, 1) - S(0, 1) * S(1, 0);
  if (!(determinant > 0.0)) return;
  Eigen::Matrix2d inverse;
  inverse << S(1, 1), -S(0, 1), -S(1, 0), S(0, 0);
  inverse /= determinant;
  const Eigen::Matrix<double, 8, 2> K = PH * inverse;
  x_ += K * miss;
  P_ -= K * PH.transpose();
  P_ = (0.5 * (P_ + P_.transpose())).eval();
  const auto start = listed(config_.start);
  bool sound = x_.allFinite();
  for (int k = 0; k < 4; ++k) sound = sound && std::abs(x_[4 + k] - std::log(start[static_cast<std::size_t>(k)])) < kMostLog;
  if (!sound) return reset(1.0);
  p_ = {std::exp(x_[4]), std::exp(x_[5]), std::exp(x_[6]), std::exp(x_[7])};
  ++corrections_;
}

void JointFilter::take(std::complex<double> v, std::complex<double> i, double w_r, double h) {
  if (begun_) {
    step(v, w_r, h);
    w_sum_ += w_r;
    ++count_;
  } else {
    slopes_ = slopes();
    w_sum_ = 0.0;
  }
  begun_ = true;
  v_ = v;
  w_r_ = w_r;
  if (count_ < kStride) return;
  if (config_.iron.any()) iron_.settle(psi_s(), psi_r(), w_r);
  spread(w_sum_ / kStride, kStride * h);
  correct(i);
  count_ = 0;
  w_sum_ = 0.0;
}

void JointFilter::anchor_R_s(double R_s_ohm, double relative_sigma, double dt_s) {
  const double noise = relative_sigma * relative_sigma / dt_s;
  const State K = P_.col(4) / (P_(4, 4) + noise);
  x_ += K * (std::log(R_s_ohm) - x_[4]);
  P_ -= (K * P_.row(4)).eval();
  P_ = (0.5 * (P_ + P_.transpose())).eval();
  p_ = {std::exp(x_[4]), std::exp(x_[5]), std::exp(x_[6]), std::exp(x_[7])};
}

MachineParameters<double> JointFilter::parameters() const { return p_; }

MachineParameters<double> JointFilter::relative_sigma() const {
  const auto at = [&](int k) { return std::sqrt(std::max(P_(4 + k, 4 + k), 0.0)); };
  return {at(0), at(1), at(2), at(3)};
}

}  // namespace imrig::est
