#include "estimators/fit/maps/magnetizing_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "estimators/fit/maps/linear_fit.h"
#include "estimators/fit/student_t.h"

namespace imrig::est {

namespace {

constexpr std::size_t kFewest = 6;
constexpr double kModelError = 3e-3;  // the form's own, so that no cluster of points decides alone
constexpr int kKnees = 60;

std::optional<LinearFit> fit_at(const std::vector<MagnetizingSample>& samples, double knee) {
  const auto n = static_cast<Eigen::Index>(samples.size());
  Eigen::MatrixXd A(n, 3);
  Eigen::VectorXd y(n), sigma(n);
  std::vector<std::size_t> cluster;
  for (Eigen::Index k = 0; k < n; ++k) {
    const MagnetizingSample& s = samples[static_cast<std::size_t>(k)];
    const double above = std::max(0.0, s.I_d_A - knee);
    A.row(k) << 1.0, above, above * above;
    y[k] = s.L_m_H;
    sigma[k] = s.L_m_H * std::hypot(s.relative_sigma, kModelError);
    cluster.push_back(s.record);
  }
  try {
    return linear_fit(A, y, sigma, cluster);
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

}  // namespace

MagnetizingMap fit_magnetizing(const std::vector<MagnetizingSample>& samples, double gain_sigma) {
  MagnetizingMap map;
  if (samples.size() < kFewest) return map;
  const auto by_current = [](const auto& a, const auto& b) { return a.I_d_A < b.I_d_A; };
  const auto [low, high] = std::minmax_element(samples.begin(), samples.end(), by_current);
  map.lowest_A = low->I_d_A;
  map.highest_A = high->I_d_A;
  double best_knee = kMissing, least = std::numeric_limits<double>::infinity();
  const auto look = [&](double knee) {
    const auto fit = fit_at(samples, knee);
    if (!fit || fit->rms >= least) return;
    least = fit->rms;
    best_knee = knee;
  };
  const double span = map.highest_A - map.lowest_A;
  for (int k = 0; k < kKnees; ++k) look(map.lowest_A + span * k / kKnees);
  for (double step = span / kKnees; step > 1e-4 * span; step *= 0.5) {
    const double centre = best_knee;
    look(std::max(0.0, centre - 0.5 * step));
    look(centre + 0.5 * step);
  }
  const auto fit = std::isfinite(best_knee) ? fit_at(samples, best_knee) : std::nullopt;
  if (!fit) return map;
  map.knee_A = best_knee;
  double squares = 0.0;
  for (std::size_t k = 0; k < samples.size(); ++k)
    squares += std::pow(fit->residual[static_cast<Eigen::Index>(k)] / samples[k].L_m_H, 2);
  map.misfit = std::sqrt(squares / static_cast<double>(samples.size()));
  const std::string found = fmt::format("steady phasors, {} windows", samples.size());
  // L_0, b, c to the paper's k: linear, so the covariance goes along.
  const double K = best_knee;
  const auto parameter = [&](Eigen::RowVector3d row, const char* unit) {
    const double value = row * fit->c;
    const double sigma = std::sqrt(std::max(0.0, (row * fit->covariance * row.transpose()).value()));
    const double half = std::hypot(fit->t_975() * sigma, kNormal975 * gain_sigma * value);
    return Parameter{value, value - half, value + half, unit, found};
  };
  map.L_0 = parameter({1.0, 0.0, 0.0}, "H");
  map.k_1 = parameter({0.0, 0.0, 1.0}, "H/A^2");
  map.k_2 = parameter({0.0, 1.0, -2.0 * K}, "H/A");
  map.k_3 = parameter({1.0, -K, K * K}, "H");
  return map;
}

}  // namespace imrig::est
