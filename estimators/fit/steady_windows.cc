#include "estimators/fit/steady_windows.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "rig/data/conditions.h"

namespace imrig::est {

namespace {

using Complex = std::complex<double>;

constexpr std::size_t kWindows = 6;
constexpr double kSteadyAdmittance = 0.05;  // relative change between halves
constexpr double kSteadySpeed = 0.01;
constexpr double kLowestFrequency_rad_s = 2.0;
constexpr double kSlow_s = 1e-3;

struct Sums {
  Complex iv = 0.0;
  double vv = 0.0, ii = 0.0, w = 0.0;
  std::size_t n = 0;
  Complex admittance() const { return iv / vv; }
  double speed() const { return w / static_cast<double>(n); }
};

Sums summed(const FrameRecord& record, std::size_t begin, std::size_t end) {
  Sums s;
  for (std::size_t k = begin; k < end; ++k) {
    s.iv += record.i[k] * std::conj(record.v[k]);
    s.vv += std::norm(record.v[k]);
    s.ii += std::norm(record.i[k]);
    s.w += record.w_r[k];
  }
  s.n = end - begin;
  return s;
}

// Speed of the field: the frame's and what is left of the voltage's turning in it, which is slow.
double field_speed(const FrameRecord& record) {
  const auto by = static_cast<std::size_t>(std::max(1.0, kSlow_s / record.sample_time_s));
  std::vector<Complex> v;
  for (std::size_t k = record.judged_from; k + by <= record.size(); k += by) {
    v.push_back(std::accumulate(record.v.begin() + static_cast<std::ptrdiff_t>(k),
                                record.v.begin() + static_cast<std::ptrdiff_t>(k + by), Complex(0.0)));
  }
  const Fundamental left = fundamental_of(v, record.sample_time_s * static_cast<double>(by));
  return record.w_k + (std::isfinite(left.f_Hz) ? 2.0 * kPi * left.f_Hz : 0.0);
}

}  // namespace

std::vector<SteadyPoint> steady_windows(const FrameRecord& record, int pole_pairs) {
  std::vector<SteadyPoint> points;
  const std::size_t length = (record.size() - record.judged_from) / kWindows;
  if (length < 8) return points;
  const double w_e = field_speed(record);
  if (std::abs(w_e) < kLowestFrequency_rad_s) return points;
  for (std::size_t window = 0; window < kWindows; ++window) {
    const std::size_t begin = record.judged_from + window * length;
    const Sums early = summed(record, begin, begin + length / 2);
    const Sums late = summed(record, begin + length / 2, begin + length);
    const Sums all = summed(record, begin, begin + length);
    if (!(all.vv > 0.0) || !(std::abs(all.iv) > 0.0)) continue;
    const bool steady =
        std::abs(late.admittance() - early.admittance()) < kSteadyAdmittance * std::abs(all.admittance()) &&
        std::abs(late.speed() - early.speed()) < kSteadySpeed * std::abs(w_e);
    if (!steady) continue;
    SteadyPoint point;
    point.v_peak_V = std::sqrt(all.vv / static_cast<double>(all.n));
    point.f_Hz = std::abs(w_e) / (2.0 * kPi);
    point.i_peak_A = std::abs(all.admittance()) * point.v_peak_V;
    point.p_in_W = 1.5 * point.v_peak_V * point.v_peak_V * all.admittance().real();
    point.speed_rad_s = all.speed() / pole_pairs * (w_e > 0.0 ? 1.0 : -1.0);
    points.push_back(point);
  }
  return points;
}

MeanConditions mean_conditions(const FrameRecord& record) {
  const Sums all = summed(record, record.judged_from, record.size());
  const double n = static_cast<double>(all.n);
  MeanConditions c;
  c.v_peak_V = std::sqrt(all.vv / n);
  c.i_peak_A = std::sqrt(all.ii / n);
  const double w_e = field_speed(record);
  c.f_Hz = w_e / (2.0 * kPi);
  if (std::abs(w_e) > kLowestFrequency_rad_s) c.slip = 1.0 - all.speed() / w_e;
  return c;
}

}  // namespace imrig::est
