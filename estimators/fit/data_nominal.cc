#include "estimators/fit/data_nominal.h"

#include <algorithm>
#include <cmath>

#include "estimators/fit/points_fit.h"
#include "estimators/fit/steady_windows.h"
#include "rig/base/error.h"

namespace imrig::est {

namespace {

constexpr std::size_t kMostPoints = 48;  // a start needs no more

std::vector<SteadyPoint> all_points(const DataSet& data, const std::vector<std::size_t>& which) {
  std::vector<SteadyPoint> points;
  for (const std::size_t k : which) {
    try {
      const auto here = steady_windows(to_frame(data.records[k].series, data.pole_pairs), data.pole_pairs);
      points.insert(points.end(), here.begin(), here.end());
    } catch (const Error&) {
      // The fit of this record will say what is wrong with it.
    }
  }
  return points;
}

std::vector<SteadyPoint> thinned(const std::vector<SteadyPoint>& points) {
  if (points.size() <= kMostPoints) return points;
  std::vector<SteadyPoint> out;
  for (std::size_t k = 0; k < kMostPoints; ++k) out.push_back(points[k * points.size() / kMostPoints]);
  return out;
}

}  // namespace

std::optional<DataNominal> nominal_from_data(const DataSet& data, const std::vector<std::size_t>& which,
                                             double R_s) {
  const auto points = thinned(all_points(data, which));
  if (points.size() < 2) return std::nullopt;
  PointsOptions options;
  options.pole_pairs = data.pole_pairs;
  options.R_s = R_s;
  const PointsFit fit = fit_points(points, options);
  if (!fit.failure.empty()) return std::nullopt;
  return DataNominal{fit.theta, fit.sigma[0] / fit.theta.R_s};
}

double largest_flux_Wb(const DataSet& data, const std::vector<std::size_t>& which) {
  double largest = kMissing;
  for (const auto& point : all_points(data, which)) {
    const double flux = point.v_peak_V / (2.0 * kPi * point.f_Hz);
    if (!(flux <= largest)) largest = flux;
  }
  return largest;
}

}  // namespace imrig::est
