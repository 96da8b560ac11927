#include "estimators/fit/global/whitener.h"

#include <algorithm>
#include <cmath>

namespace imrig::est {

namespace {

using Complex = std::complex<double>;

constexpr std::size_t kHold = 8;       // samples that share a step: the filter settles slowly
constexpr std::size_t kAfter = 12;     // samples behind a jump that do not
constexpr double kJump = 3.0;          // sigma of the voltage's noise
constexpr double kSmooth = 2.5;        // of |dv|^2
constexpr double kBendOfNoise = 70.0;  // 1 + 16 + 36 + 16 + 1

Eigen::Matrix2cd transition(const MachineParameters<double>& p, double w_r, double w_k, double h) {
  const Complex j(0.0, 1.0);
  Eigen::Matrix2cd A;
  A << -p.R_s / p.L_l - j * w_k, p.R_s / p.L_l, p.R_r / p.L_l,
      -p.R_r / p.L_l - p.R_r / p.L_m + j * (w_r - w_k);
  const Eigen::Matrix2cd B = A * h;
  const Eigen::Matrix2cd B2 = B * B;
  return Eigen::Matrix2cd::Identity() + B + B2 / 2.0 + B2 * B / 6.0 + B2 * B2 / 24.0;
}

// |fourth difference|^2 at each sample, 0 at the ends.
std::vector<double> bends(const std::vector<Complex>& v) {
  std::vector<double> out(v.size(), 0.0);
  for (std::size_t k = 2; k + 2 < v.size(); ++k)
    out[k] = std::norm(v[k - 2] + v[k + 2] - 4.0 * (v[k - 1] + v[k + 1]) + 6.0 * v[k]);
  return out;
}

// |dv|^2 of the jump behind each sample; 0 where the voltage moves no more than its noise does, and where it
// moves along a smooth curve: harmonics of the supply. A jump bends it three times as much as it moves it, or
// twice where averaging has spread it; a harmonic sampled eight times a period half as much.
std::vector<double> jumps(const FrameRecord& frame, double sigma_V) {
  std::vector<double> out(frame.size(), 0.0);
  const double noise2 = 2.0 * sigma_V * sigma_V, least = kJump * kJump * 2.0 * noise2;
  const std::vector<double> bend2 = bends(frame.v);
  for (std::size_t k = 0; k + 1 < frame.size(); ++k) {
    const double square = std::norm(frame.v[k + 1] - frame.v[k]);
    const bool inside = k >= 2 && k + 3 < frame.size();
    const bool smooth = inside && std::max(bend2[k], bend2[k + 1]) < kSmooth * square + kBendOfNoise * noise2;
    if (square > least && !smooth) out[k] = square;
  }
  return out;
}

// The same where averaging has spread a jump over two steps: the whole of it behind the first of them, so
// that it may lie half a sample of the file off.
std::vector<double> whole_jumps(const FrameRecord& frame, const std::vector<double>& jump2) {
  std::vector<double> out = jump2;
  for (std::size_t k = 0; k + 2 < frame.size(); ++k) {
    if (out[k] == 0.0 || jump2[k + 1] == 0.0) continue;
    out[k] = std::max(std::norm(frame.v[k + 2] - frame.v[k]), out[k] + out[k + 1]);
    out[k + 1] = 0.0;
  }
  return out;
}

struct Covariances {
  Eigen::Matrix3cd P = Eigen::Matrix3cd::Zero();
  void advance(const Eigen::Matrix3cd& F, const Eigen::Matrix3cd& Q) { P = (F * P * F.adjoint() + Q).eval(); }
};

// Variance of the mean of |r|^2 over n samples, r circular with the covariances of its last sample
// throughout:
//   (r_0^2 + 2 sum_t (1 - t/n) |C F^t P C'|^2) / n
double variance_of_power(const Eigen::Matrix3cd& F, const Eigen::Matrix3cd& P, const Eigen::RowVector3cd& C,
                         double white2, std::size_t n) {
  constexpr double kForgotten = 1e-4;
  Eigen::Vector3cd ahead = P * C.adjoint();
  const double power = (C * ahead)(0, 0).real() + white2;
  double sum = power * power;
  for (std::size_t t = 1; t < n; ++t) {
    ahead = (F * ahead).eval();
    const double covariance2 = std::norm((C * ahead)(0, 0));
    sum += 2.0 * (1.0 - static_cast<double>(t) / static_cast<double>(n)) * covariance2;
    if (covariance2 < kForgotten * power * power / static_cast<double>(n)) break;
  }
  return n > 0 ? sum / static_cast<double>(n) : 0.0;
}

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

  const std::vector<double> whole2 = record.thinned == 1 ? jump2 : whole_jumps(frame, jump2);

  const Eigen::RowVector3cd C(inverse_leakage_, -inverse_leakage_, 0.0);
  const Eigen::Vector3cd into(0.5 * h, 0.0, 1.0);  // of the next sample's voltage noise
  Eigen::Matrix3cd Q = voltage2 * into * into.adjoint();
  Q(1, 1) += by_speed * by_speed * mean;
  Covariances filter, open, edges;
  filter.P(2, 2) = open.P(2, 2) = voltage2;
  Eigen::Matrix3cd F = Eigen::Matrix3cd::Zero();
  std::size_t judged = 0, since_jump = kAfter;
  bool edge_seen = false;
  number_.reserve(frame.size());
  for (std::size_t k = 0; k < frame.size(); ++k) {
    const double near = std::max(jump2[k], k > 0 ? jump2[k - 1] : 0.0);
    const double smoothed = std::sqrt(near) * h / 8.0 * inverse_leakage_;
    const double R = current2 + smoothed * smoothed;
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
      edge_power_ += (C * edges.P * C.adjoint())(0, 0).real();
      noise_power_ += (C * open.P * C.adjoint())(0, 0).real() + 2.0 * current * current;
      ++judged;
    }
    Eigen::Matrix3cd Q_here = Q, Q_edge = Eigen::Matrix3cd::Zero();
    const double edge2 = jump2[k] * h * h * mean * mean;
    Q_here(0, 0) += edge2 / 12.0;
    const double most2 = whole2[k] * h * h * mean * mean / 4.0;
    Q_edge(0, 0) = std::max(0.0, most2 - edge2 / 12.0);
    open.advance(F, Q_here);
    if (edge_seen || most2 > 0.0) edges.advance(F, Q_edge), edge_seen = true;
    filter.advance(F, Q_here);
    filter.P -= S * K * K.adjoint();
  }
  noise_power_ /= static_cast<double>(std::max<std::size_t>(1, judged));
  edge_power_ /= static_cast<double>(std::max<std::size_t>(1, judged));
  noise_power_variance_ = variance_of_power(F, open.P, C, 2.0 * current * current, judged);
}

}  // namespace imrig::est
