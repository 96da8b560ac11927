#include "estimators/fit/maps/deep_bar.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimators/fit/maps/linear_fit.h"
#include "estimators/fit/maps/locked_sweep.h"
#include "estimators/fit/student_t.h"

namespace imrig::est {

namespace {

constexpr double kCurveError = 5e-3;    // of R_r: what one branch leaves of a bar
constexpr double kLeakageError = 3e-3;  // likewise of L_l
constexpr int kScan = 24;
constexpr int kGolden = 40;
constexpr int kRounds = 3;  // R_2's temperature follows the R_1 found

// With tau = L_2/R_2 given, everything is linear: the line's columns without its last, R_2, one L_0 a sweep.
class BarFit {
 public:
  BarFit(const Eigen::MatrixXd& columns, const std::vector<const LockedPoint*>& points, std::size_t sweeps)
      : columns_(columns), points_(points), relative_(sweeps, 1.0), y_(2 * rows()), sigma_(2 * rows()) {
    for (Eigen::Index k = 0; k < rows(); ++k) {
      const LockedPoint& p = *points[static_cast<std::size_t>(k)];
      y_[2 * k] = p.R_r_ohm;
      y_[2 * k + 1] = p.L_l_H;
      sigma_[2 * k] = kCurveError * p.R_r_ohm;
      sigma_[2 * k + 1] = kLeakageError * p.L_l_H;
      cluster_.insert(cluster_.end(), 2, static_cast<std::size_t>(k));
      low_ = std::min(low_, p.w_s);
      high_ = std::max(high_, p.w_s);
    }
  }

  LinearFit at(double tau) const { return linear_fit(matrix(tau), y_, sigma_, cluster_); }
  double chi2(double tau) const {
    const LinearFit fit = at(tau);
    return fit.residual.cwiseQuotient(sigma_).squaredNorm();
  }

  // The best tau: a scan, then golden section.
  double best() const {
    const double from = std::log(0.2 / high_), to = std::log(2.0 / low_), width = (to - from) / kScan;
    double least = std::numeric_limits<double>::infinity(), a = from;
    for (int k = 0; k <= kScan; ++k) {
      const double c = chi2(std::exp(from + k * width));
      if (c < least) least = c, a = from + (k - 1) * width;
    }
    double b = a + 2.0 * width;
    constexpr double kPart = 0.6180339887498949;
    for (int k = 0; k < kGolden; ++k) {
      const double c = b - kPart * (b - a), d = a + kPart * (b - a);
      (chi2(std::exp(c)) < chi2(std::exp(d)) ? b : a) = chi2(std::exp(c)) < chi2(std::exp(d)) ? d : c;
    }
    return std::exp(0.5 * (a + b));
  }

  void heat(const Eigen::VectorXd& c) {
    for (std::size_t g = 0; g < relative_.size(); ++g) relative_[g] = c[static_cast<Eigen::Index>(g)] / c[0];
  }

  // With d/d ln tau as one more column: the covariance of everything.
  LinearFit with_doubt_of_tau(double tau, const Eigen::VectorXd& c) const {
    constexpr double kStep = 1e-4;
    const Eigen::MatrixXd here = matrix(tau);
    Eigen::MatrixXd A(here.rows(), here.cols() + 1);
    A << here, (matrix(tau * (1.0 + kStep)) - matrix(tau * (1.0 - kStep))) * c / (2.0 * kStep);
    return linear_fit(A, y_, sigma_, cluster_);
  }

  Eigen::Index bar() const { return columns_.cols() - 1; }
  // Of the straight line over w_s.
  double line_misfit() const {
    Eigen::VectorXd R(rows()), sigma(rows());
    for (Eigen::Index k = 0; k < rows(); ++k) R[k] = y_[2 * k], sigma[k] = sigma_[2 * k];
    const std::vector<std::size_t> own(cluster_.begin(), cluster_.begin() + rows());
    const LinearFit fit = linear_fit(columns_, R, sigma, own);
    return std::sqrt(fit.residual.cwiseQuotient(R).squaredNorm() / static_cast<double>(rows()));
  }
  double rms_of_R(const LinearFit& fit) const {
    double sum = 0.0;
    for (Eigen::Index k = 0; k < rows(); ++k) sum += std::pow(fit.residual[2 * k] / y_[2 * k], 2);
    return std::sqrt(sum / static_cast<double>(rows()));
  }

 private:
  Eigen::Index rows() const { return columns_.rows(); }

  Eigen::MatrixXd matrix(double tau) const {
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(2 * rows(), bar() + 1 + static_cast<Eigen::Index>(relative_.size()));
    for (Eigen::Index k = 0; k < rows(); ++k) {
      const LockedPoint& p = *points_[static_cast<std::size_t>(k)];
      const double u = p.w_s * tau / relative_[p.sweep], bent = u * u / (1.0 + u * u);
      A.row(2 * k).head(bar()) = columns_.row(k).head(bar());
      A(2 * k, bar()) = relative_[p.sweep] * bent;
      A(2 * k + 1, bar()) = tau * (1.0 - bent);
      A(2 * k + 1, bar() + 1 + static_cast<Eigen::Index>(p.sweep)) = 1.0;
    }
    return A;
  }

  const Eigen::MatrixXd& columns_;
  const std::vector<const LockedPoint*>& points_;
  std::vector<double> relative_;  // R_1 of a sweep over the first's
  Eigen::VectorXd y_, sigma_;
  std::vector<std::size_t> cluster_;
  double low_ = std::numeric_limits<double>::infinity(), high_ = 0.0;
};

}  // namespace

DeepBar fit_deep_bar(const Eigen::MatrixXd& columns, const std::vector<const LockedPoint*>& points, std::size_t sweeps,
                     double gain_sigma) {
  DeepBar out;
  try {
    BarFit bar(columns, points, sweeps);
    double tau = 0.0;
    LinearFit fit;
    for (int round = 0; round < kRounds; ++round) {
      tau = bar.best();
      fit = bar.at(tau);
      bar.heat(fit.c);
    }
    const Eigen::VectorXd c = bar.at(tau).c;
    const LinearFit whole = bar.with_doubt_of_tau(tau, c);
    const Eigen::Index R = bar.bar(), T = whole.c.size() - 1;
    const auto sigma = [&](const Eigen::VectorXd& g) { return std::sqrt(std::max(0.0, g.dot(whole.covariance * g))); };
    const auto unit = [&](Eigen::Index k) { return Eigen::VectorXd(Eigen::VectorXd::Unit(whole.c.size(), k)); };
    const auto parameter = [&](double value, double own, const char* name) {
      const double half = std::hypot(whole.t_975() * own, kNormal975 * gain_sigma * value);
      return Parameter{value, value - half, value + half, name, "locked-like sweep, one branch of bars"};
    };
    out.R_2 = parameter(c[R], sigma(unit(R)), "ohm");
    out.L_2 = parameter(c[R] * tau, sigma(tau * (unit(R) + c[R] * unit(T))), "H");
    for (std::size_t g = 0; g < sweeps; ++g) {
      const auto k = static_cast<Eigen::Index>(g), L = R + 1 + k;
      out.sweeps.push_back({parameter(c[k], sigma(unit(k)), "ohm"), c[L] + c[R] * tau,
                            sigma(unit(L) + tau * (unit(R) + c[R] * unit(T)))});
    }
    out.R_1_ohm = c[0];
    out.misfit = bar.rms_of_R(bar.at(tau));
    const bool bends = out.R_2.ci95_low > 0.0 && out.L_2.ci95_low > 0.0 && out.misfit < bar.line_misfit();
    out.failure = bends ? "" : "the sweep shows no bend that stands out of its scatter";
  } catch (const std::exception& e) {
    out.failure = e.what();
  }
  return out;
}

}  // namespace imrig::est
