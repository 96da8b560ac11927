#include "estimators/fit/standstill/standstill_fit.h"

#include <ceres/jet.h>
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "estimators/fit/standstill/standstill_response.h"
#include "estimators/fit/standstill/standstill_start.h"
#include "estimators/fit/student_t.h"

namespace imrig::est {

namespace {

constexpr int kTheta = static_cast<int>(kStandstillParameters);
constexpr int kAll = kTheta + 3;  // ln theta, psi_s(0), psi_r(0), constant current
constexpr int kMostIterations = 60;
constexpr double kLongestStep = 0.7;     // of any ln theta
constexpr double kSettledSigmas = 1e-4;  // a step below this many sigmas ends the search ...
constexpr double kSettled = 1e-10;       // ... or below this much of ln theta
constexpr double kShortStart_s = 1.5;    // of the record, on which the starts are ranked
constexpr int kRanked = 2;
constexpr double kUnseen = 1e3;  // amplification: 0.1 % of misfit is as large as the parameter
constexpr double kLag_s = 1e-3;  // by then the current channel's noise has died away, the machine's has not

using Jet = ceres::Jet<double, kTheta>;
using Vector = Eigen::Matrix<double, kAll, 1>;
using Matrix = Eigen::Matrix<double, kAll, kAll>;
using Vector4 = Eigen::Matrix<double, kTheta, 1>;
using Matrix4 = Eigen::Matrix<double, kTheta, kTheta>;

// Sums over a stretch of samples: of the Jacobian's products, of its products with the residual, of r^2.
struct Sums {
  Matrix H = Matrix::Zero();
  Vector g = Vector::Zero();
  double cost = 0.0;
  std::size_t n = 0;
  void add(const Vector& row, double r) {
    H.selfadjointView<Eigen::Lower>().rankUpdate(row);
    g += row * r;
    cost += r * r;
    ++n;
  }
  Sums& operator+=(const Sums& other) {
    H += other.H;
    g += other.g;
    cost += other.cost;
    n += other.n;
    return *this;
  }
};

struct Point {
  Vector4 log_theta = Vector4::Zero();
  double psi_s = 0.0, psi_r = 0.0, constant = 0.0;
  Point moved(const Vector& step) const {
    return {log_theta + step.head<kTheta>(), psi_s + step[4], psi_r + step[5], constant + step[6]};
  }
};

MachineParameters<double> theta_of(const Point& p) {
  return {std::exp(p.log_theta[0]), std::exp(p.log_theta[1]), std::exp(p.log_theta[2]),
          std::exp(p.log_theta[3])};
}

Point point_of(const MachineParameters<double>& p) {
  Point out;
  out.log_theta << std::log(p.R_s), std::log(p.R_r), std::log(p.L_l), std::log(p.L_m);
  return out;
}

MachineParameters<Jet> seeded(const Point& p) {
  const auto one = [&](int k) { return exp(Jet(p.log_theta[k], k)); };
  return {one(0), one(1), one(2), one(3)};
}

bool steppable(const MachineParameters<double>& p, double h) {
  return h * (p.R_s / p.L_l + p.R_r / p.L_l + p.R_r / p.L_m) < kMostStep;
}

// Residual and Jacobian over the first n samples, summed per block; residuals also in `kept` where wanted.
std::vector<Sums> evaluate(const AxisRecord& record, const Point& at, std::size_t n, std::size_t blocks,
                           std::vector<double>* kept = nullptr) {
  const StandstillStep<Jet> step = standstill_step(seeded(at), record.sample_time_s);
  const StandstillStep<double> plain = standstill_step(theta_of(at), record.sample_time_s);
  StandstillState<Jet> x{Jet(at.psi_s), Jet(at.psi_r)};
  StandstillState<double> from_s{1.0, 0.0}, from_r{0.0, 1.0};
  std::vector<Sums> sums(blocks);
  Vector row;
  row[6] = 1.0;
  for (std::size_t k = 0; k < n; ++k) {
    const Jet i = x.current(step);
    row.head<kTheta>() = i.v;
    row[4] = from_s.current(plain);
    row[5] = from_r.current(plain);
    const double r = i.a + at.constant - record.i[k];
    sums[k * blocks / n].add(row, r);
    if (kept != nullptr) kept->push_back(r);
    if (k + 1 == n) break;
    x.advance(step, record.u[k], record.u[k + 1]);
    from_s.advance(plain, 0.0, 0.0);
    from_r.advance(plain, 0.0, 0.0);
  }
  for (Sums& s : sums) s.H.triangularView<Eigen::StrictlyUpper>() = s.H.transpose();
  return sums;
}

Sums whole(const std::vector<Sums>& blocks) {
  Sums sum;
  for (const Sums& b : blocks) sum += b;
  return sum;
}

// Solves in columns of equal length: volts, webers and ampere do not mix well otherwise.
struct Scaled {
  Vector scale;
  Eigen::LDLT<Matrix> solver;
  Scaled(const Matrix& H, double damping) {
    for (int k = 0; k < kAll; ++k) scale[k] = 1.0 / std::sqrt(std::max(H(k, k), 1e-300));
    Matrix S = scale.asDiagonal() * H * scale.asDiagonal();
    S.diagonal().array() += damping;
    solver.compute(S);
  }
  Vector solve(const Vector& right) const {
    return scale.cwiseProduct(solver.solve(scale.cwiseProduct(right)));
  }
  Matrix inverse() const {
    const Matrix S = solver.solve(Matrix::Identity());
    return scale.asDiagonal() * S * scale.asDiagonal();
  }
};

// R_s from elsewhere: weight (ln R_s - value)^2 is added to the cost.
struct Prior {
  double log_R_s = 0.0;
  double weight = 0.0;
  Sums with(Sums sums, const Point& at) const {
    const double off = at.log_theta[0] - log_R_s;
    sums.H(0, 0) += weight;
    sums.g[0] += weight * off;
    sums.cost += weight * off * off;
    return sums;
  }
};

struct Search {
  Point at;
  double cost = std::numeric_limits<double>::infinity();
  bool settled = false;
  int iterations = 0;
};

// Levenberg-Marquardt. n: samples used.
Search descend(const AxisRecord& record, const Point& start, std::size_t n, int most,
               const Prior& prior = {}) {
  Search s;
  s.at = start;
  Sums here = prior.with(whole(evaluate(record, s.at, n, 1)), s.at);
  s.cost = here.cost;
  double damping = 1e-4;
  for (; s.iterations < most && !s.settled; ++s.iterations) {
    Vector step = -Scaled(here.H, damping).solve(here.g);
    const double longest = step.head<kTheta>().cwiseAbs().maxCoeff();
    if (!std::isfinite(longest)) break;
    if (longest > kLongestStep) step *= kLongestStep / longest;
    const Point next = s.at.moved(step);
    const double variance = here.cost / static_cast<double>(n);
    const bool small = step.dot(here.H * step) < kSettledSigmas * kSettledSigmas * variance ||
                       step.head<kTheta>().cwiseAbs().maxCoeff() < kSettled;
    if (!steppable(theta_of(next), record.sample_time_s)) {
      damping = std::max(10.0 * damping, 1e-3);
      continue;
    }
    const Sums there = prior.with(whole(evaluate(record, next, n, 1)), next);
    if (there.cost < here.cost) {
      s.at = next;
      s.cost = there.cost;
      here = there;
      damping *= 0.1;
      s.settled = small;
    } else if (small) {
      s.settled = true;
    } else {
      damping = std::max(10.0 * damping, 1e-6);
    }
  }
  return s;
}

Search search(const AxisRecord& record, const StandstillFitOptions& options) {
  auto starts = standstill_starts(record);
  if (options.nominal) starts.push_back(*options.nominal);
  std::erase_if(starts, [&](const auto& p) { return !steppable(p, record.sample_time_s); });
  const auto some = std::min(record.size(), static_cast<std::size_t>(kShortStart_s / record.sample_time_s));
  std::vector<Search> ranked;
  for (const auto& start : starts) ranked.push_back(descend(record, point_of(start), some, 3));
  std::sort(ranked.begin(), ranked.end(), [](const auto& a, const auto& b) { return a.cost < b.cost; });
  Search best;
  for (std::size_t k = 0; k < std::min<std::size_t>(kRanked, ranked.size()); ++k) {
    Search one = descend(record, ranked[k].at, record.size(), kMostIterations);
    if (one.cost < best.cost) best = one;
  }
  return best;
}

// Gradient of |G|^2 by ln theta, and |G|^2 itself, in 1/(ohm^2 s).
Jet noise_power_gain(const MachineParameters<Jet>& p) {
  const Jet b_1 = 1.0 / p.L_l, b_0 = p.R_r / (p.L_m * p.L_l);
  const Jet a_1 = (p.R_s + p.R_r) / p.L_l + p.R_r / p.L_m, a_0 = p.R_s * p.R_r / (p.L_m * p.L_l);
  return (b_1 * b_1 * a_0 + b_0 * b_0) / (2.0 * a_0 * a_1);
}

// sigma_v^2 from the residual: its covariance at a lag where the current channel's own noise has no part any
// more, over the machine's response to white noise there.
double voltage_variance(const AxisRecord& record, const MachineParameters<double>& theta,
                        const std::vector<double>& residual) {
  const auto lag = std::max<std::size_t>(1, static_cast<std::size_t>(kLag_s / record.sample_time_s));
  double measured = 0.0;
  for (std::size_t k = 0; k + lag < residual.size(); ++k) measured += residual[k] * residual[k + lag];
  measured /= static_cast<double>(residual.size() - lag);
  const StandstillStep<double> step = standstill_step(theta, record.sample_time_s);
  StandstillState<double> x;
  x.advance(step, 0.0, 1.0);
  x.psi_s += step.g_0[0];
  x.psi_r += step.g_0[1];
  const auto memory =
      static_cast<std::size_t>(10.0 * theta.L_l / (theta.R_s + theta.R_r) / record.sample_time_s) + lag;
  std::vector<double> response;
  for (std::size_t k = 0; k < memory; ++k) {
    response.push_back(x.current(step));
    x.advance(step, 0.0, 0.0);
  }
  double expected = 0.0;
  for (std::size_t k = 0; k + lag < response.size(); ++k) expected += response[k] * response[k + lag];
  return expected > 0.0 ? std::max(0.0, measured / expected) : 0.0;
}

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

std::string cannot_separate(const StandstillFit& fit, const StandstillFitOptions& options) {
  std::string names;
  for (std::size_t k = 0; k < kStandstillParameters; ++k) {
    const bool flat = !(fit.amplification[k] <= options.most_amplification);
    const bool noisy = !(fit.sigma[k] <= options.most_relative_sigma);
    if (!flat && !noisy) continue;
    names += names.empty() ? "" : ", ";
    if (!(fit.amplification[k] <= kUnseen)) {
      names += fmt::format("{} (not seen at all)", kStandstillNames[k]);
    } else if (flat) {
      names += fmt::format("{} (0.1 % of misfit moves it by {:.2g} %)", kStandstillNames[k],
                           0.1 * fit.amplification[k]);
    } else {
      names += fmt::format("{} (sigma {:.2g} %)", kStandstillNames[k], 100.0 * fit.sigma[k]);
    }
  }
  if (names.empty()) return "";
  return "cannot separate " + names +
         ": excite with two frequencies or more, one of them near R_r/L_m or below";
}

class Judgement {
 public:
  Judgement(const AxisRecord& record, const StandstillFitOptions& options, const Search& found,
            const Prior& prior = {})
      : record_(record), options_(options), prior_(prior), at_(found.at) {
    residual_.reserve(record.size());
    blocks_ = evaluate(record, at_, record.size(), static_cast<std::size_t>(options.blocks), &residual_);
    data_ = whole(blocks_);
    all_ = prior_.with(data_, at_);
  }

  // The weight that an R_s from elsewhere has beside this record: the record's own sigma of R_s over its
  // sigma for a misfit of 1 A per sample is the ampere per sample that its noise amounts to.
  Prior prior_of(const KnownResistance& known, const StandstillFit& free) const {
    const double unit = root(Scaled(all_.H, 0.0).inverse()(0, 0));
    const double noise_A = free.sigma[0] / unit;
    return {std::log(known.value_ohm), noise_A * noise_A / (known.relative_sigma * known.relative_sigma)};
  }

  void fill(StandstillFit& fit) {
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

 private:
  // What the uncertainty of the given R_s brings.
  Matrix4 of_prior(const Matrix& inverse) const {
    if (!(prior_.weight > 0.0)) return Matrix4::Zero();
    const Vector4 per_R_s = inverse.block<kTheta, 1>(0, 0) * prior_.weight;
    return per_R_s * per_R_s.transpose() * (options_.R_s->relative_sigma * options_.R_s->relative_sigma);
  }

  double samples() const { return static_cast<double>(record_.size()); }

  double sigma_along(const Vector4& d) const {
    return root(std::max(d.dot(noise_ * d), d.dot(scatter_ * d)));
  }

  void goodness(StandstillFit& fit) const {
    double sum = 0.0, square = 0.0;
    for (const double i : record_.i) {
      sum += i;
      square += i * i;
    }
    fit.current_A = root(square / samples() - sum * sum / (samples() * samples()));
    fit.residual_A = std::sqrt(data_.cost / samples());
    fit.nrmse = fit.residual_A / fit.current_A;
  }

  void subtract_noise_bias(const Matrix& inverse, StandstillFit& fit) {
    const Jet gain = noise_power_gain(seeded(at_));
    const double h = record_.sample_time_s;
    const double declared = options_.noise.voltage_V;
    const double variance =
        declared >= 0.0 ? declared * declared : voltage_variance(record_, theta_of(at_), residual_);
    const Vector4 pull = gain.v * (0.5 * samples() * variance * h);
    const Vector4 bias = -inverse.topLeftCorner<kTheta, kTheta>() * pull;
    Point corrected = at_;
    // The bias is first order; where it is large the record cannot separate the parameters, and is refused.
    if (bias.cwiseAbs().maxCoeff() < 0.1) corrected.log_theta -= bias;
    for (int k = 0; k < kTheta; ++k) fit.noise_bias[static_cast<std::size_t>(k)] = bias[k];
    fit.theta = theta_of(corrected);
    const double current = options_.noise.current_A;
    if (current > 0.0) {
      const double expected =
          record_.noise_gain * record_.noise_gain * current * current + variance * h * gain.a;
      fit.chi2_per_dof = fit.residual_A * fit.residual_A / expected;
    }
  }

  // Relative: d ln L_s = (L_l d ln L_l + L_m d ln L_m)/L_s, L_mT^2 = L_m L_s, R_rT = R_r L_s/L_m.
  void in_t_circuit(StandstillFit& fit) const {
    fit.t = t_of(fit.theta);
    const double L_s = fit.theta.L_l + fit.theta.L_m;
    const Vector4 of_L_s(0.0, 0.0, fit.theta.L_l / L_s, fit.theta.L_m / L_s);
    const Vector4 of_L_m(0.0, 0.0, 0.0, 1.0), of_R_r(0.0, 1.0, 0.0, 0.0);
    fit.sigma_L_s = sigma_along(of_L_s);
    fit.sigma_L_m_t = sigma_along(0.5 * (of_L_s + of_L_m));
    fit.sigma_R_r_t = sigma_along(of_R_r + of_L_s - of_L_m);
  }

  const AxisRecord& record_;
  const StandstillFitOptions& options_;
  Prior prior_;
  Point at_;
  std::vector<double> residual_;
  std::vector<Sums> blocks_;
  Sums data_, all_;  // all_: with the prior
  Matrix4 noise_, scatter_;
};

}  // namespace

StandstillFit fit_standstill(const AxisRecord& record, const StandstillFitOptions& options) {
  StandstillFit fit;
  fit.failure = record.failure;
  if (!fit.failure.empty()) return fit;
  const Search found = search(record, options);
  fit.iterations = found.iterations;
  if (!std::isfinite(found.cost)) {
    fit.failure = "no start of the search suits the sample time";
    return fit;
  }
  Judgement alone(record, options, found);
  alone.fill(fit);
  bool settled = found.settled;
  if (options.R_s) {
    const Prior prior = alone.prior_of(*options.R_s, fit);
    const Search both = descend(record, found.at, record.size(), kMostIterations, prior);
    settled = both.settled;
    Judgement(record, options, both, prior).fill(fit);
  }
  fit.failure = cannot_separate(fit, options);
  if (fit.failure.empty() && !settled) fit.failure = "the fit does not settle";
  return fit;
}

}  // namespace imrig::est
