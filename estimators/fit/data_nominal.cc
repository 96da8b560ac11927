#include "estimators/fit/data_nominal.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "estimators/fit/each.h"
#include "estimators/fit/points_fit.h"
#include "estimators/fit/start_guess.h"
#include "estimators/fit/steady_windows.h"
#include "rig/base/error.h"

namespace imrig::est {

namespace {

constexpr double kTold = 0.25;           // relative sigma below which the points tell a parameter
constexpr double kTypicalR_s = 0.03;     // of v/i
constexpr std::size_t kMostPoints = 48;  // a start needs no more

std::vector<SteadyPoint> thinned(const std::vector<SteadyPoint>& points) {
  if (points.size() <= kMostPoints) return points;
  std::vector<SteadyPoint> out;
  for (std::size_t k = 0; k < kMostPoints; ++k) out.push_back(points[k * points.size() / kMostPoints]);
  return out;
}

bool told(const PointsFit& fit) {
  const std::array values{fit.theta.R_s, fit.theta.R_r, fit.theta.L_l, fit.theta.L_m};
  for (std::size_t m = 0; m < values.size(); ++m) {
    if (fit.on_bound[m] || !(fit.sigma[m] < kTold * values[m])) return false;
  }
  return true;
}

// Points that are all alike leave the split of the inductance open: take an ordinary machine's.
std::optional<DataNominal> typical(const std::vector<SteadyPoint>& points, int pole_pairs, double R_s) {
  for (const auto& point : points) {
    const auto guesses = guesses_from_point(point, pole_pairs, R_s);
    if (!guesses.empty()) return DataNominal{guesses[guesses.size() / 3]};
  }
  return std::nullopt;
}

}  // namespace

std::vector<SteadyPoint> steady_points(const DataSet& data, const std::vector<std::size_t>& which,
                                       int threads) {
  std::vector<std::vector<SteadyPoint>> found(which.size());
  each(which.size(), threads, [&](std::size_t k) {
    try {
      found[k] = steady_windows(to_frame(data.records[which[k]].series, data.pole_pairs), data.pole_pairs);
    } catch (const Error&) {
      // The fit of this record will say what is wrong with it.
    }
  });
  std::vector<SteadyPoint> points;
  for (const auto& here : found) points.insert(points.end(), here.begin(), here.end());
  return points;
}

std::optional<DataNominal> nominal_from_points(const std::vector<SteadyPoint>& all, int pole_pairs,
                                               double R_s) {
  const auto points = thinned(all);
  if (points.size() < 2) return std::nullopt;
  PointsOptions options;
  options.pole_pairs = pole_pairs;
  options.R_s = R_s;
  const PointsFit fit = fit_points(points, options);
  if (fit.failure.empty() && told(fit)) return DataNominal{fit.theta};
  return typical(points, pole_pairs,
                 std::isfinite(R_s) ? R_s : kTypicalR_s * points[0].v_peak_V / points[0].i_peak_A);
}

double largest_flux_Wb(const std::vector<SteadyPoint>& points) {
  double largest = kMissing;
  for (const auto& point : points) {
    const double flux = point.v_peak_V / (2.0 * kPi * point.f_Hz);
    if (!(flux <= largest)) largest = flux;
  }
  return largest;
}

}  // namespace imrig::est
