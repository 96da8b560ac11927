#include "estimators/fit/combine.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimators/fit/student_t.h"

namespace imrig::est {

namespace {

constexpr double kOutlier = 6.0;
constexpr std::size_t kFewestToJudge = 4;  // with fewer records nobody can say which one is wrong

double median(std::vector<double> x) {
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  std::nth_element(x.begin(), middle, x.end());
  if (x.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(x.begin(), middle));
}

std::vector<std::string> find_outliers(const std::vector<Contribution>& all) {
  std::vector<std::string> reasons(all.size());
  if (all.size() < kFewestToJudge) return reasons;
  std::vector<double> values, distances;
  for (const auto& one : all) values.push_back(one.value);
  const double centre = median(values);
  for (const double value : values) distances.push_back(std::abs(value - centre));
  const double spread = 1.4826 * median(distances);
  for (std::size_t k = 0; k < all.size(); ++k) {
    const double scale = std::hypot(spread, all[k].sigma);
    if (distances[k] > kOutlier * scale) {
      reasons[k] =
          fmt::format("{:.4g} is {:.0f} robust standard deviations from the median {:.4g} of the records",
                      all[k].value, distances[k] / scale, centre);
    }
  }
  return reasons;
}

// Variance between the records beyond their own noise.
double between_records(const std::vector<Contribution>& kept) {
  if (kept.size() < 2) return 0.0;
  double w = 0.0, w2 = 0.0, wy = 0.0;
  for (const auto& one : kept) {
    const double weight = 1.0 / (one.sigma * one.sigma);
    w += weight;
    w2 += weight * weight;
    wy += weight * one.value;
  }
  double q = 0.0;
  for (const auto& one : kept) q += std::pow((one.value - wy / w) / one.sigma, 2);
  const double spare = static_cast<double>(kept.size()) - 1.0;
  const double scale = w - w2 / w;
  return scale > 0.0 ? std::max(0.0, (q - spare) / scale) : 0.0;
}

}  // namespace

Combined combine(const std::vector<Contribution>& all) {
  Combined out;
  out.outlier = find_outliers(all);
  std::vector<Contribution> kept;
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (out.outlier[k].empty()) kept.push_back(all[k]);
  }
  out.used = kept.size();
  const double tau2 = between_records(kept);
  out.scatter = std::sqrt(tau2);
  double w = 0.0, wy = 0.0;
  for (const auto& one : kept) {
    const double weight = 1.0 / (one.sigma * one.sigma + tau2);
    w += weight;
    wy += weight * one.value;
  }
  out.value = wy / w;
  double q = 0.0;
  for (const auto& one : kept) q += std::pow(one.value - out.value, 2) / (one.sigma * one.sigma + tau2);
  const double spare = static_cast<double>(kept.size()) - 1.0;
  const double own = 1.0 / std::sqrt(w);
  const double scattered = spare > 0.0 ? own * std::sqrt(q / spare) : 0.0;
  const bool scatter_decides = tau2 > 0.0 || scattered > own;
  out.sigma = std::max(own, scattered);
  out.degrees_of_freedom = scatter_decides ? spare : std::numeric_limits<double>::infinity();
  return out;
}

double half_width_95(const Combined& combined, double common_sigma) {
  const double t =
      std::isinf(combined.degrees_of_freedom) ? kNormal975 : student_t_975(combined.degrees_of_freedom);
  return std::hypot(t * combined.sigma, kNormal975 * common_sigma);
}

}  // namespace imrig::est
