#include "estimators/fit/global/whitener.h"

#include <cmath>

namespace imrig::est {

namespace {

using Complex = std::complex<double>;

constexpr std::size_t kHold = 8;    // samples that share a step: the filter settles slowly
constexpr std::size_t kAfter = 12;  // samples behind a jump that do not
constexpr double kJump = 3.0;       // sigma of the voltage's noise

Eigen::Matrix2cd transition(const MachineParameters<double>& p, double w_r, double w_k, double h) {
  const Complex j(0.0, 1.0);
  Eigen::Matrix2cd A;
  A << -p.R_s / p.L_l - j * w_k, p.R_s / p.L_l, p.R_r / p.L_l,
      -p.R_r / p.L_l - p.R_r / p.L_m + j * (w_r - w_k);
  const Eigen::Matrix2cd B = A * h;
  const Eigen::Matrix2cd B2 = B * B;
  return Eigen::Matrix2cd::Identity() + B + B2 / 2.0 + B2 * B / 6.0 + B2 * B2 / 24.0;
}

// |dv|^2 of the jump behind each sample; 0 where the voltage moves no more than its noise does.
std::vector<double> jumps(const FrameRecord& frame, double sigma_V) {
  std::vector<double> out(frame.size(), 0.0);
  const double least = kJump * kJump * 4.0 * sigma_V * sigma_V;
  for (std::size_t k = 0; k + 1 < frame.size(); ++k) {
    const double square = std::norm(frame.v[k + 1] - frame.v[k]);
    if (square > least) out[k] = square;
  }
  return out;
}

struct Covariances {
  Eigen::Matrix3cd P = Eigen::Matrix3cd::Zero();
  void advance(const Eigen::Matrix3cd& F, const Eigen::Matrix3cd& Q) { P = (F * P * F.adjoint() + Q).eval(); }
};

}  // namespace

Whitener::Whitener(const DrivenRecord& record, const MachineParameters<double>& p, double flux_Wb,
                   const NoiseLevels& noise)
    : inverse_leakage_(1.0 / p.L_l) {
  const FrameRecord& frame = record.frame;
  const double h = frame.sample_time_s, mean = 1.0 / record.thinned;
  const double voltage2 = 2.0 * noise.voltage_V * noise.voltage_V * mean;
  const double by_speed = flux_Wb * noise.speed_rad_s * h;
  const double current = noise.current_A * record.mean_gain;
  const double current2 = std::max(2.0 * current * current, 1e-30);
  const std::vector<double> jump2 = jumps(frame, noise.voltage_V * std::sqrt(mean));

  const Eigen::RowVector3cd C(inverse_leakage_, -inverse_leakage_, 0.0);
  const Eigen::Vector3cd into(0.5 * h, 0.0, 1.0);  // of the next sample's voltage noise
  Eigen::Matrix3cd Q = voltage2 * into * into.adjoint();
  Q(1, 1) += by_speed * by_speed * mean;
  Covariances filter, open;
  filter.P(2, 2) = open.P(2, 2) = voltage2;
  std::size_t judged = 0, since_jump = kAfter;
  number_.reserve(frame.size());
  for (std::size_t k = 0; k < frame.size(); ++k) {
    const double near = std::max(jump2[k], k > 0 ? jump2[k - 1] : 0.0);
    const double smoothed = std::sqrt(near) * h / 8.0 * inverse_leakage_;
    const double R = current2 + smoothed * smoothed;
    Eigen::Matrix3cd F = Eigen::Matrix3cd::Zero();
    F.topLeftCorner<2, 2>() =
        steps_.empty() || k % kHold == 0 ? transition(p, frame.w_r[k], frame.w_k, h) : steps_.back().F;
    F.topRightCorner<2, 1>() = 0.5 * h * F.topLeftCorner<2, 1>();
    const double S = (C * filter.P * C.adjoint())(0, 0).real() + R;
    const Eigen::Vector3cd K = F * filter.P * C.adjoint() / S;
    since_jump = near > 0.0 ? 0 : since_jump + 1;
    if (k % kHold == 0 || since_jump < kAfter) {
      steps_.push_back({F.topLeftCorner<2, 2>(), F.topRightCorner<2, 1>(), K, std::sqrt(2.0 / S)});
    }
    number_.push_back(static_cast<std::uint32_t>(steps_.size() - 1));
    if (k >= frame.judged_from) {
      noise_power_ += (C * open.P * C.adjoint())(0, 0).real() + 2.0 * current * current;
      ++judged;
    }
    Eigen::Matrix3cd Q_here = Q;
    Q_here(0, 0) += jump2[k] * h * h * mean * mean / 12.0;
    open.advance(F, Q_here);
    filter.advance(F, Q_here);
    filter.P -= S * K * K.adjoint();
  }
  noise_power_ /= static_cast<double>(std::max<std::size_t>(1, judged));
}

}  // namespace imrig::est
