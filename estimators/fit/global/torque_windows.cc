#include "estimators/fit/global/torque_windows.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "rig/base/space_vector.h"

namespace imrig::est {

namespace {

constexpr std::size_t kFewestSamples = 16;
constexpr int kMostHalvings = 3;
constexpr double kSlowestField_rad_s = 6.0, kSlowestShaft_rad_s = 1.0;  // electrical; mechanical
constexpr double kInertia_s = 1.0;   // stored energy over rated power, twice: H of 0.5 s
constexpr double kSteady = 1e-3;     // of the apparent torque, that a moving speed may hide before it is cut,
constexpr double kMostDrift = 0.02;  // and at all
constexpr double kColour = 3.0;      // a torque bridge is filtered: its noise averages out slowly
constexpr double kRelative = 0.003;  // of the value: power meter and torque bridge
constexpr double kAngle = 1e-3;      // of the apparent torque: voltage and current channels, rad
constexpr double kOfLargest = 5e-4;  // zero of the bridge

constexpr double kLoaded = 0.3;   // of the apparent torque, before a factor can be told
constexpr double kSpread = 0.05;  // of the loads, before friction can be told from a factor
constexpr double kLeastFactor = 0.8, kMostFactor = 1.2;

double mean_of(const std::vector<double>& x, std::size_t from, std::size_t to) {
  return std::accumulate(x.begin() + static_cast<std::ptrdiff_t>(from),
                         x.begin() + static_cast<std::ptrdiff_t>(to), 0.0) /
         static_cast<double>(to - from);
}

// From sample to sample: what steps of the voltage and ripple do to the torque, the model follows.
double noise_of(const std::vector<double>& x, std::size_t from, std::size_t to) {
  double square = 0.0;
  for (std::size_t k = from + 1; k < to; ++k) square += std::pow(x[k] - x[k - 1], 2);
  return std::sqrt(0.5 * square / static_cast<double>(to - from - 1));
}

// Cuts a record until the speed stands still in each part.
class Cutter {
 public:
  Cutter(const std::vector<double>& torque_Nm, const FrameRecord& frame, int thinned)
      : torque_Nm_(torque_Nm),
        frame_(frame),
        by_(static_cast<std::size_t>(thinned)),
        period_(2.0 * kPi / (std::abs(frame.w_k) * frame.sample_time_s)) {}

  void cut(std::size_t from, std::size_t to, int halvings, std::vector<TorqueWindow>& out) const {
    const double periods = std::floor(static_cast<double>(to - from) / period_);
    const auto length = static_cast<std::size_t>(std::lround(periods * period_));
    if (periods < 1.0 || length < kFewestSamples || length > to - from) return;
    const auto w = window(from, from + length);
    if (!w) return;
    if (w->hidden_Nm > kSteady * w->apparent_Nm && halvings < kMostHalvings && periods >= 2.0) {
      const std::size_t middle = from + length / 2;
      cut(from, middle, halvings + 1, out);
      cut(middle, to, halvings + 1, out);
      return;
    }
    if (w->hidden_Nm < kMostDrift * w->apparent_Nm) out.push_back(*w);
  }

 private:
  // Nothing where a sample is missing or the shaft stands still.
  std::optional<TorqueWindow> window(std::size_t from, std::size_t to) const {
    const std::size_t first = frame_.first + from * by_, last = frame_.first + to * by_;
    if (last > torque_Nm_.size()) return std::nullopt;
    const double w_r = mean_of(frame_.w_r, from, to);
    if (std::abs(w_r) < kSlowestShaft_rad_s * frame_.pole_pairs) return std::nullopt;
    const double per_power = 1.5 * frame_.pole_pairs / frame_.w_k;
    double v2 = 0.0, i2 = 0.0, p = 0.0;
    for (std::size_t k = from; k < to; ++k) {
      v2 += std::norm(frame_.v[k]), i2 += std::norm(frame_.i[k]);
      p += (frame_.v[k] * std::conj(frame_.i[k])).real();
    }
    const double n = static_cast<double>(to - from), torque = mean_of(torque_Nm_, first, last);
    if (!std::isfinite(torque)) return std::nullopt;
    TorqueWindow w{.from = from, .to = to, .mean_Nm = torque};
    w.noise_Nm = kColour * noise_of(torque_Nm_, first, last) / std::sqrt(static_cast<double>(last - first));
    w.power_Nm = per_power * p / n;
    w.apparent_Nm = std::abs(per_power) * std::sqrt(v2 * i2) / n;
    w.copper_Nm_per_ohm = per_power * i2 / n;
    w.hidden_Nm = w.apparent_Nm * kInertia_s * std::abs(slope(from, to) / w_r);
    return w;
  }
  // Of the speed, rad/s^2 electrical: between its means over the two halves.
  double slope(std::size_t from, std::size_t to) const {
    const std::size_t middle = from + (to - from) / 2;
    const double change = mean_of(frame_.w_r, middle, to) - mean_of(frame_.w_r, from, middle);
    return change / (0.5 * static_cast<double>(to - from) * frame_.sample_time_s);
  }

  const std::vector<double>& torque_Nm_;
  const FrameRecord& frame_;
  std::size_t by_;
  double period_;  // of the supply, samples
};

}  // namespace

std::vector<TorqueWindow> torque_windows(const std::vector<double>& torque_Nm, const FrameRecord& frame,
                                         int thinned) {
  std::vector<TorqueWindow> out;
  if (torque_Nm.empty() || std::abs(frame.w_k) < kSlowestField_rad_s) return out;
  Cutter(torque_Nm, frame, thinned).cut(frame.judged_from, frame.size(), 0, out);
  return out;
}

double largest_torque_Nm(const std::vector<TorqueWindow>& windows) {
  double largest_Nm = 0.0;
  for (const TorqueWindow& w : windows) largest_Nm = std::max(largest_Nm, std::abs(w.mean_Nm));
  return largest_Nm;
}

std::string torque_contradiction(const std::vector<const TorqueWindow*>& windows, double R_s_ohm) {
  // T = factor T_gap - lost sgn(w): two unknowns, by least squares.
  double gg = 0.0, gs = 0.0, ss = 0.0, gt = 0.0, st = 0.0, largest = 0.0;
  for (const TorqueWindow* w : windows) {
    const double gap = w->power_Nm - R_s_ohm * w->copper_Nm_per_ohm,
                 sense = w->copper_Nm_per_ohm > 0.0 ? 1.0 : -1.0;
    gg += gap * gap, gs += gap * sense, ss += 1.0, gt += gap * w->mean_Nm, st += sense * w->mean_Nm;
    largest = std::max(largest, std::abs(gap) / w->apparent_Nm);
  }
  if (windows.empty() || largest < kLoaded) return {};  // too little load to tell
  const double spread = gg * ss - gs * gs;
  const double factor = spread > kSpread * gg * ss ? (gt * ss - gs * st) / spread : gt / gg;
  if (factor > kLeastFactor && factor < kMostFactor) return {};
  return fmt::format("is {:.3g} times what the electrical power leaves for the air gap", factor);
}

void weigh(std::vector<TorqueWindow>& windows, double largest_Nm) {
  largest_Nm = std::max(largest_Nm, largest_torque_Nm(windows));
  // What meters are off by is the same in all windows of a record: together they are worth one.
  const double alike = std::sqrt(static_cast<double>(windows.size()));
  for (TorqueWindow& w : windows) {
    const double meters = std::hypot(kRelative * w.mean_Nm, kAngle * w.apparent_Nm, kOfLargest * largest_Nm);
    w.sigma_Nm = std::hypot(w.noise_Nm, w.hidden_Nm, alike * meters);
  }
}

}  // namespace imrig::est
