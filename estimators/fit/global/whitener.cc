#include "estimators/fit/global/whitener.h"

#include <cmath>

namespace imrig::est {

namespace {

using Complex = std::complex<double>;

Eigen::Matrix2cd transition(const MachineParameters<double>& p, double w_r, double w_k, double h) {
  const Complex j(0.0, 1.0);
  Eigen::Matrix2cd A;
  A << -p.R_s / p.L_l - j * w_k, p.R_s / p.L_l, p.R_r / p.L_l,
      -p.R_r / p.L_l - p.R_r / p.L_m + j * (w_r - w_k);
  const Eigen::Matrix2cd B = A * h;
  const Eigen::Matrix2cd B2 = B * B;
  return Eigen::Matrix2cd::Identity() + B + B2 / 2.0 + B2 * B / 6.0 + B2 * B2 / 24.0;
}

}  // namespace

Whitener::Whitener(const DrivenRecord& record, const MachineParameters<double>& p, double flux_Wb,
                   const NoiseLevels& noise)
    : inverse_leakage_(1.0 / p.L_l) {
  const FrameRecord& frame = record.frame;
  const double h = frame.sample_time_s;
  const double mean = 1.0 / record.thinned;
  const double q_stator = 2.0 * noise.voltage_V * noise.voltage_V * mean * h * h;
  const double by_speed = flux_Wb * noise.speed_rad_s * h;
  const double q_rotor = by_speed * by_speed * mean;
  const double current = noise.current_A * record.mean_gain;
  const double R = std::max(2.0 * current * current, 1e-30);
  const Eigen::RowVector2cd C(inverse_leakage_, -inverse_leakage_);
  Eigen::Matrix2cd Q = Eigen::Matrix2cd::Zero();
  Q(0, 0) = q_stator;
  Q(1, 1) = q_rotor;
  Eigen::Matrix2cd P = Eigen::Matrix2cd::Zero();     // of the filter
  Eigen::Matrix2cd open = Eigen::Matrix2cd::Zero();  // without it: the simulation's own error
  Step step;
  std::size_t judged = 0;
  for (std::size_t k = 0; k < frame.size(); ++k) {
    if (k % kHold == 0) {
      step.F = transition(p, frame.w_r[k], frame.w_k, h);
      const double S = (C * P * C.adjoint())(0, 0).real() + R;
      step.K = step.F * P * C.adjoint() / S;
      step.weight = std::sqrt(2.0 / S);
      steps_.push_back(step);
    }
    if (k >= frame.judged_from) {
      noise_power_ += (C * open * C.adjoint())(0, 0).real() + 2.0 * current * current;
      ++judged;
    }
    open = (step.F * open * step.F.adjoint() + Q).eval();
    const double S = (C * P * C.adjoint())(0, 0).real() + R;
    const Eigen::Vector2cd K = step.F * P * C.adjoint() / S;
    P = (step.F * P * step.F.adjoint() + Q - S * K * K.adjoint()).eval();
  }
  noise_power_ /= static_cast<double>(std::max<std::size_t>(1, judged));
  current_power_ = 2.0 * current * current;
}

}  // namespace imrig::est
