#include "estimators/fit/maps/resistance_line.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimators/fit/maps/linear_fit.h"
#include "estimators/fit/student_t.h"

namespace imrig::est {

namespace {
constexpr double kReference_C = 20.0;
constexpr std::size_t kFewest = 3;
}  // namespace

double ResistanceLine::at(double stator_C) const {
  if (!std::isfinite(stator_C)) return R_20.value;
  return R_20.value * (1.0 + alpha.value * (stator_C - kReference_C));
}

double ResistanceLine::sigma_at(double stator_C) const {
  const double x = std::isfinite(stator_C) ? stator_C - kReference_C : 0.0;
  return std::sqrt(std::max(0.0, covariance[0] + 2.0 * x * covariance[1] + x * x * covariance[2]));
}

ResistanceLine resistance_line(const std::vector<ResistancePoint>& points, double gain_sigma) {
  ResistanceLine line;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const auto& point : points) {
    if (!std::isfinite(point.stator_C)) continue;
    line.points.push_back(point);
    low = std::min(low, point.stator_C);
    high = std::max(high, point.stator_C);
  }
  if (line.points.size() < kFewest || high - low < kLeastSpread_C) {
    line.failure = line.points.size() < kFewest
                       ? fmt::format("only {} DC records know the winding's temperature", line.points.size())
                       : fmt::format("the temperatures of the DC records spread over {:.1f} K only", high - low);
    return line;
  }
  const auto n = static_cast<Eigen::Index>(line.points.size());
  Eigen::MatrixXd A(n, 2);
  Eigen::VectorXd y(n), sigma(n);
  std::vector<std::size_t> cluster;
  for (Eigen::Index k = 0; k < n; ++k) {
    const ResistancePoint& point = line.points[static_cast<std::size_t>(k)];
    A.row(k) << 1.0, point.stator_C - kReference_C;
    y[k] = point.R_s_ohm;
    sigma[k] = std::max(point.sigma_ohm, 1e-9 * point.R_s_ohm);
    cluster.push_back(static_cast<std::size_t>(k));
  }
  // Noise alone does not set the weights: what differs from record to record counts as much.
  const double typical = sigma.mean();
  sigma = (sigma.array().square() + typical * typical).sqrt();
  const LinearFit fit = linear_fit(A, y, sigma, cluster);
  line.covariance[0] = fit.covariance(0, 0);
  line.covariance[1] = fit.covariance(0, 1);
  line.covariance[2] = fit.covariance(1, 1);
  const double R = fit.c[0], slope = fit.c[1];
  const auto parameter = [&](double value, double half, const char* unit) {
    return Parameter{value, value - half, value + half, unit,
                     fmt::format("line over {} dc records, {:.0f} to {:.0f} C", n, low, high)};
  };
  line.R_20 = parameter(R, std::hypot(fit.t_975() * std::sqrt(fit.covariance(0, 0)), kNormal975 * gain_sigma * R), "ohm");
  const double variance =
      (fit.covariance(1, 1) - 2.0 * slope / R * fit.covariance(0, 1) + slope * slope / (R * R) * fit.covariance(0, 0)) / (R * R);
  line.alpha = parameter(slope / R, fit.t_975() * std::sqrt(std::max(0.0, variance)), "1/K");
  return line;
}

}  // namespace imrig::est
