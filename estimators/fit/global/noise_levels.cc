#include "estimators/fit/global/noise_levels.h"

#include <algorithm>
#include <cmath>

#include "rig/base/error.h"

namespace imrig::est {

namespace {

constexpr std::size_t kStretch = 64;

double median(std::vector<double>& x) {
  if (x.empty()) return 0.0;
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  std::nth_element(x.begin(), middle, x.end());
  return *middle;
}

double square(std::complex<double> x) { return 0.5 * std::norm(x); }  // of each component
double square(double x) { return x * x; }

// Mean square of second differences over each stretch, divided by six.
template <class X>
void add_stretches(const std::vector<X>& x, std::vector<double>& out) {
  for (std::size_t from = 0; from + kStretch <= x.size(); from += kStretch) {
    double sum = 0.0;
    for (std::size_t k = from + 1; k + 1 < from + kStretch; ++k)
      sum += square(x[k + 1] - 2.0 * x[k] + x[k - 1]);
    out.push_back(sum / (6.0 * static_cast<double>(kStretch - 2)));
  }
}

double either(double declared, double seen) { return std::isfinite(declared) ? declared : seen; }

}  // namespace

NoiseEstimate noise_levels(const DataSet& data) {
  std::vector<double> current, voltage, speed;
  for (const Record& record : data.records) {
    if (record.kind == RecordKind::kPoints || record.kind == RecordKind::kDc) continue;
    try {
      TimeSeries series = record.series;
      series.voltage_filter_s = 0.0;  // the sensors' own noise, before the matched filter
      const FrameRecord frame = to_frame(series, data.pole_pairs);
      add_stretches(frame.i, current);
      add_stretches(frame.v, voltage);
      add_stretches(frame.w_r, speed);
    } catch (const Error&) {
      continue;  // cannot be fitted either
    }
  }
  NoiseEstimate out;
  out.seen = {std::sqrt(median(current)), std::sqrt(median(voltage)), std::sqrt(median(speed))};
  out.declared = std::isfinite(data.noise.current_A) && data.noise.current_A > 0.0;
  out.levels = {either(data.noise.current_A, out.seen.current_A),
                either(data.noise.voltage_V, out.seen.voltage_V),
                either(data.noise.speed_rad_s * data.pole_pairs, out.seen.speed_rad_s)};
  if (out.declared) {
    out.declared_factor = out.seen.current_A / data.noise.current_A;
    if (out.declared_factor > kBelieved) out.levels.current_A = out.seen.current_A;
  }
  return out;
}

}  // namespace imrig::est
