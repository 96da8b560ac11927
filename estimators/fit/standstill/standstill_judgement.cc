#include "estimators/fit/standstill/standstill_judgement.h"

#include <algorithm>
#include <cmath>

#include "estimators/fit/standstill/standstill_noise.h"
#include "estimators/fit/student_t.h"

namespace imrig::est::standstill {

namespace {

// `all` may hold a prior, which stays when a block is left out.
Matrix4 jackknife(const std::vector<Sums>& blocks, const Sums& all) {
  const auto n = static_cast<double>(blocks.size());
  std::vector<Vector4> without;
  Vector4 mean = Vector4::Zero();
  for (const Sums& block : blocks) {
    const Vector step = -Scaled(all.H - block.H, 0.0).solve(all.g - block.g);
    without.push_back(step.head<kTheta>());
    mean += without.back() / n;
  }
  Matrix4 covariance = Matrix4::Zero();
  for (const Vector4& w : without) covariance += (w - mean) * (w - mean).transpose();
  return covariance * ((n - 1.0) / n);
}

double root(double x) { return std::sqrt(std::max(0.0, x)); }

}  // namespace

Judgement::Judgement(const AxisRecord& record, const StandstillFitOptions& options, const Search& found,
                     const Prior& prior)
    : record_(record), options_(options), prior_(prior), at_(found.at) {
  residual_.reserve(record.size());
  blocks_ = evaluate(record, at_, record.size(), static_cast<std::size_t>(options.blocks), &residual_);
  data_ = whole(blocks_);
  all_ = prior_.with(data_, at_);
}

Prior Judgement::prior_of(const KnownResistance& known, const StandstillFit& free) const {
  const double unit = root(Scaled(all_.H, 0.0).inverse()(0, 0));
  const double noise_A = free.sigma[0] / unit;
  return {std::log(known.value_ohm), noise_A * noise_A / (known.relative_sigma * known.relative_sigma)};
}

void Judgement::fill(StandstillFit& fit) {
  goodness(fit);
  const Matrix inverse = Scaled(all_.H, 0.0).inverse();
  const double energy = fit.current_A * fit.current_A * samples();
  for (int k = 0; k < kTheta; ++k)
    fit.amplification[static_cast<std::size_t>(k)] = root(inverse(k, k) * energy);
  subtract_noise_bias(inverse, fit);
  // A low-pass leaves less variance but the same density at low frequency, which is where the parameters
  // sit.
  const double white = fit.residual_A / record_.noise_gain;
  const Matrix4 spread = (inverse * data_.H * inverse).topLeftCorner<kTheta, kTheta>();
  const double widen = student_t_975(static_cast<double>(blocks_.size()) - 1.0) / kNormal975;
  noise_ = spread * (white * white) + of_prior(inverse);
  scatter_ = jackknife(blocks_, all_) * (widen * widen) + of_prior(inverse);
  for (int k = 0; k < kTheta; ++k) {
    Vector4 one = Vector4::Zero();
    one[k] = 1.0;
    fit.sigma[static_cast<std::size_t>(k)] = sigma_along(one);
  }
  in_t_circuit(fit);
}

Matrix4 Judgement::of_prior(const Matrix& inverse) const {
  if (!(prior_.weight > 0.0)) return Matrix4::Zero();
  const Vector4 per_R_s = inverse.block<kTheta, 1>(0, 0) * prior_.weight;
  return per_R_s * per_R_s.transpose() * (options_.R_s->relative_sigma * options_.R_s->relative_sigma);
}

double Judgement::sigma_along(const Vector4& d) const {
  return root(std::max(d.dot(noise_ * d), d.dot(scatter_ * d)));
}

void Judgement::goodness(StandstillFit& fit) const {
  double sum = 0.0, square = 0.0;
  for (const double i : record_.i) {
    sum += i;
    square += i * i;
  }
  fit.current_A = root(square / samples() - sum * sum / (samples() * samples()));
  fit.residual_A = std::sqrt(data_.cost / samples());
  fit.nrmse = fit.residual_A / fit.current_A;
}

void Judgement::subtract_noise_bias(const Matrix& inverse, StandstillFit& fit) {
  const PowerGain gain = noise_power_gain(theta_of(at_));
  const double h = record_.sample_time_s;
  const double declared = options_.noise.voltage_V;
  const double variance =
      declared >= 0.0 ? declared * declared : voltage_variance(record_, theta_of(at_), residual_);
  const Vector4 pull = gain.slope * (0.5 * samples() * variance * h);
  const Vector4 bias = -inverse.topLeftCorner<kTheta, kTheta>() * pull;
  Point corrected = at_;
  // The bias is first order; where it is large the record cannot separate the parameters, and is refused.
  if (bias.cwiseAbs().maxCoeff() < 0.1) corrected.log_theta -= bias;
  for (int k = 0; k < kTheta; ++k) fit.noise_bias[static_cast<std::size_t>(k)] = bias[k];
  fit.theta = theta_of(corrected);
  const double current = options_.noise.current_A;
  if (current > 0.0) {
    const double expected =
        record_.noise_gain * record_.noise_gain * current * current + variance * h * gain.value;
    fit.chi2_per_dof = fit.residual_A * fit.residual_A / expected;
  }
}

// Relative: d ln L_s = (L_l d ln L_l + L_m d ln L_m)/L_s, L_mT^2 = L_m L_s, R_rT = R_r L_s/L_m.
void Judgement::in_t_circuit(StandstillFit& fit) const {
  fit.t = t_of(fit.theta);
  const double L_s = fit.theta.L_l + fit.theta.L_m;
  const Vector4 of_L_s(0.0, 0.0, fit.theta.L_l / L_s, fit.theta.L_m / L_s);
  const Vector4 of_L_m(0.0, 0.0, 0.0, 1.0), of_R_r(0.0, 1.0, 0.0, 0.0);
  fit.sigma_L_s = sigma_along(of_L_s);
  fit.sigma_L_m_t = sigma_along(0.5 * (of_L_s + of_L_m));
  fit.sigma_R_r_t = sigma_along(of_R_r + of_L_s - of_L_m);
}

}  // namespace imrig::est::standstill
