#include "estimators/fit/global/torque_windows.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "estimators/fit/global/torque_sums.h"
#include "rig/base/space_vector.h"

namespace imrig::est {

namespace {

constexpr std::size_t kFewestSamples = 16;
constexpr int kMostHalvings = 6;
constexpr double kSlowestField_rad_s = 6.0, kSlowestShaft_rad_s = 1.0;  // electrical; mechanical
constexpr double kInertia_s = 1.0;   // stored energy over rated power, twice: H of 0.5 s
constexpr double kSteady = 1e-3;     // of the apparent torque, that a moving speed may hide before it is cut,
constexpr double kMostDrift = 0.02;  // and at all
constexpr double kColour = 3.0;      // a torque bridge is filtered: its noise averages out slowly
constexpr double kRelative = 0.003;  // of the value: power meter and torque bridge
constexpr double kAngle = 1e-3;      // of the apparent torque: voltage and current channels, rad

constexpr double kLoaded = 0.3;   // of the apparent torque, before a factor can be told
constexpr double kSpread = 0.003;         // least eigenvalue that tells factor, R_s and friction apart,
constexpr std::size_t kFewestToTell = 5;  // and fewest windows
constexpr double kMostFactor = 1.25,
                 kGross = 2.5;          // that a factor may be off where they can be told, and where not
constexpr double kOfApparent = 0.3;     // of the apparent torque, that a bridge must reach
constexpr double kWhole = 1e-9;         // of a period: rounding
constexpr double kFewestTorques = 4.0;  // samples

double mean_of(const std::vector<double>& x, std::size_t from, std::size_t to) {
  return std::accumulate(x.begin() + static_cast<std::ptrdiff_t>(from),
                         x.begin() + static_cast<std::ptrdiff_t>(to), 0.0) /
         static_cast<double>(to - from);
}

// Of a channel that may have gaps, or be slower than the others.
struct Seen {
  double mean = 0.0, scatter = 0.0, n = 0.0;
};

// scatter: from one sample to the next; what steps of the voltage and ripple do to the torque, the model
// follows.
Seen seen(const std::vector<double>& x, std::size_t from, std::size_t to) {
  Seen out;
  double square = 0.0, last = NAN;
  for (std::size_t k = from; k < std::min(to, x.size()); ++k) {
    if (!std::isfinite(x[k])) continue;
    out.mean += x[k];
    if (out.n > 0.0) square += (x[k] - last) * (x[k] - last);
    last = x[k];
    out.n += 1.0;
  }
  if (out.n < 2.0) return out;
  out.mean /= out.n;
  out.scatter = std::sqrt(0.5 * square / (out.n - 1.0));
  return out;
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
    const double periods = std::floor(static_cast<double>(to - from) / period_ + kWhole);
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
  // Nothing where hardly a torque was measured or the shaft stands still.
  std::optional<TorqueWindow> window(std::size_t from, std::size_t to) const {
    const std::size_t first = frame_.first + from * by_, last = frame_.first + to * by_;
    const double w_r = mean_of(frame_.w_r, from, to);
    if (std::abs(w_r) < kSlowestShaft_rad_s * frame_.pole_pairs) return std::nullopt;
    const double per_power = 1.5 * frame_.pole_pairs / frame_.w_k;
    double v2 = 0.0, i2 = 0.0, p = 0.0;
    for (std::size_t k = from; k < to; ++k) {
      v2 += std::norm(frame_.v[k]), i2 += std::norm(frame_.i[k]);
      p += (frame_.v[k] * std::conj(frame_.i[k])).real();
    }
    const double n = static_cast<double>(to - from);
    const Seen torque = seen(torque_Nm_, first, last);
    if (torque.n < kFewestTorques) return std::nullopt;
    TorqueWindow w{.from = from, .to = to, .mean_Nm = torque.mean, .samples = torque.n};
    w.noise_Nm = kColour * torque.scatter / std::sqrt(torque.n);
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

double torque_range_Nm(const std::vector<TorqueWindow>& windows) {
  double out = 0.0;
  for (const TorqueWindow& w : windows)
    out = std::max({out, std::abs(w.mean_Nm), kOfApparent * w.apparent_Nm});
  return out;
}

std::string torque_contradiction(const std::vector<const TorqueWindow*>& windows, double R_s_ohm) {
  if (windows.empty()) return {};
  if (std::all_of(windows.begin(), windows.end(), [](const TorqueWindow* w) { return w->mean_Nm == 0.0; }))
    return "is zero throughout";
  // T = factor P - ohm C - lost sgn(w), by least squares.
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  double gt = 0.0, gg = 0.0, loaded = 0.0;
  for (const TorqueWindow* w : windows) {
    const double gap = w->power_Nm - R_s_ohm * w->copper_Nm_per_ohm;
    const Eigen::Vector3d by(w->power_Nm, -w->copper_Nm_per_ohm, w->copper_Nm_per_ohm > 0.0 ? -1.0 : 1.0);
    H += by * by.transpose(), g += w->mean_Nm * by;
    gt += gap * w->mean_Nm, gg += gap * gap;
    loaded = std::max(loaded, std::abs(gap) / w->apparent_Nm);
  }
  if (loaded < kLoaded) return {};  // too little load to tell
  const Eigen::Vector3d scale = H.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::Matrix3d scaled = scale.asDiagonal() * H * scale.asDiagonal();
  const bool differ = windows.size() >= kFewestToTell &&
                      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scaled).eigenvalues()[0] > kSpread;
  const double factor =
      differ ? (scale.asDiagonal() * scaled.ldlt().solve(scale.asDiagonal() * g))[0] : gt / gg;
  const double most = differ ? kMostFactor : kGross;
  if (factor > 1.0 / most && factor < most) return {};
  return fmt::format("is {:.3g} times what the electrical power leaves for the air gap", factor);
}

void weigh(std::vector<TorqueWindow>& windows, double range_Nm, double declared_Nm) {
  // What meters are off by is the same in all windows of a record: together they are worth one.
  const double alike = std::sqrt(static_cast<double>(windows.size()));
  for (TorqueWindow& w : windows) {
    const double meters = std::hypot(kRelative * w.mean_Nm, kAngle * w.apparent_Nm, kTorqueZero * range_Nm);
    const double declared = std::isfinite(declared_Nm) ? kColour * declared_Nm / std::sqrt(w.samples) : 0.0;
    w.sigma_Nm = std::hypot(std::max(w.noise_Nm, declared), w.hidden_Nm, alike * meters);
  }
}

}  // namespace imrig::est
