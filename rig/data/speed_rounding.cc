#include "rig/data/speed_rounding.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "rig/base/space_vector.h"

namespace imrig {

namespace {

constexpr double kRpm = 2.0 * kPi / 60.0;
constexpr double kSteps_rad_s[] = {10.0 * kRpm, 1.0,        5.0 * kRpm, 2.5 * kRpm, 0.25, 2.0 * kRpm,
                                   0.2,         1.0 * kRpm, 0.1,        0.5 * kRpm, 0.05, 0.25 * kRpm,
                                   0.025,       0.2 * kRpm, 0.02,       0.1 * kRpm, 0.01};
constexpr double kOnGrid = 0.03;     // of a step: what files round beside it
constexpr double kNearlyAll = 0.98;  // of a record's samples, against cells that were filled
constexpr double kCoarsest = 0.05;   // of the fastest: what moves more is no rounding
constexpr std::size_t kFewestSamples = 16;
constexpr int kFewestMoves = 8;                 // from one value to its neighbour
constexpr std::size_t kFewestValues = 4;        // of speeds that never move
constexpr long kSetPoints = 5;                  // steps that divide all differences of set-points
constexpr double kUnmoved_rad_s = 1.01 * kRpm;  // coarsest step of speeds that never move
constexpr std::size_t kWindow = 100;            // samples,
constexpr double kSlow = 2.5;                   // in which a speed moves by no more steps
constexpr std::size_t kSoon = 5;      // samples: so long a value may be held and still count as noise
constexpr double kInTime = 0.9;       // of the changes, where an encoder's counts come at even intervals
constexpr double kWorthwhile = 0.08;  // of a step; counts of an encoder leave 0.05

struct Speeds {
  std::size_t record = 0;
  std::vector<double> w;  // finite
};

std::vector<Speeds> moving(const DataSet& data) {
  std::vector<Speeds> out;
  for (std::size_t k = 0; k < data.records.size(); ++k) {
    const TimeSeries& s = data.records[k].series;
    Speeds speeds{k, s.speed_rad_s};
    std::erase_if(speeds.w, [](double w) { return !std::isfinite(w); });
    const bool rests = std::all_of(speeds.w.begin(), speeds.w.end(), [](double w) { return w == 0.0; });
    if (rests || speeds.w.size() < kFewestSamples) continue;
    out.push_back(std::move(speeds));
  }
  return out;
}

bool on_grid(double w, double step) { return std::abs(w / step - std::round(w / step)) < kOnGrid; }

bool on_grid(const Speeds& speeds, double step) {
  // A coarse grid is refused by the first few values.
  const double most_off = (1.0 - kNearlyAll) * static_cast<double>(speeds.w.size());
  double off = 0.0;
  for (const double w : speeds.w) {
    if (!on_grid(w, step) && (off += 1.0) > most_off) return false;
  }
  return true;
}

// Samples between one change of the value and the next.
std::vector<std::size_t> runs_of(const std::vector<double>& w, double step) {
  std::vector<std::size_t> out;
  std::size_t last = w.size();
  for (std::size_t k = 1; k < w.size(); ++k) {
    if (std::abs(w[k] - w[k - 1]) < 0.5 * step) continue;
    if (last < w.size()) out.push_back(k - last);
    last = k;
  }
  return out;
}

// Whether values change at even intervals only, as counts over a window do.
bool in_time(const std::vector<std::size_t>& runs) {
  if (runs.size() < kFewestMoves) return false;
  const auto shortest = static_cast<double>(*std::min_element(runs.begin(), runs.end()));
  if (shortest <= static_cast<double>(kSoon)) return false;
  double samples = 0.0, intervals = 0.0;
  for (const std::size_t run : runs) {
    const auto length = static_cast<double>(run);
    if (length < 1.5 * shortest) samples += length, intervals += 1.0;
  }
  const double interval = samples / intervals;
  double even = 0.0;
  for (const std::size_t run : runs) {
    const double length = static_cast<double>(run), whole = std::round(length / interval);
    even += std::abs(length - whole * interval) < 1.2 + 0.02 * (length - interval) ? 1.0 : 0.0;
  }
  return even > kInTime * static_cast<double>(runs.size());
}

// What rounding at this step shows in the records that lie on it.
struct Shown {
  std::size_t moves = 0;  // from a value to its neighbour
  std::set<long> values;  // in steps, one of each record
  double variance = 0.0,
         where = 0.0;  // sum over samples in slow windows, of the value's noise in steps; their number
  bool counts = false;
};

void add_noise(const double* w, std::size_t n, std::size_t apart, double step, Shown& shown) {
  const auto [low, high] = std::minmax_element(w, w + n);
  if (*high - *low > kSlow * step) return;
  for (std::size_t k = apart; k + apart < n; ++k) {
    const double bend = (w[k + apart] - 2.0 * w[k] + w[k - apart]) / step;
    shown.variance += bend * bend / 6.0;
    shown.where += 1.0;
  }
}

Shown shown_by(const std::vector<Speeds>& all, const std::vector<bool>& on, double step) {
  Shown out;
  for (std::size_t r = 0; r < all.size(); ++r) {
    if (!on[r]) continue;
    const std::vector<double>& w = all[r].w;
    const std::vector<std::size_t> runs = runs_of(w, step);
    out.counts = out.counts || in_time(runs);
    for (std::size_t k = 1; k < w.size(); ++k) {
      const double moved = std::abs(w[k] - w[k - 1]) / step;
      out.moves += moved > 0.5 && moved < 1.5 ? 1 : 0;
    }
    const std::size_t soonest = runs.empty() ? 1 : *std::min_element(runs.begin(), runs.end());
    const std::size_t window = std::min(kWindow, w.size());
    for (std::size_t k = 0; k + window <= w.size(); k += window)
      add_noise(w.data() + k, window, std::min(soonest, kSoon), step, out);
    out.values.insert(std::lround(w[w.size() / 2] / step));
  }
  return out;
}

bool set_points(const std::set<long>& values) {
  long common = 0;
  for (const long v : values) common = std::gcd(common, v - *values.begin());
  return values.size() < kFewestValues || common >= kSetPoints;
}

// Rounding of x + noise is off by (1/pi) exp(-2 (pi sigma)^2) sin(2 pi x) and less, in steps; without noise
// by a uniform share. Where the noise is small, the rounded value's own variance is sigma / sqrt(pi) on
// average.
double sigma_of(const Shown& shown) {
  const double variance = shown.variance / shown.where;
  constexpr double kSmall = 0.17;
  const double noise =
      variance < kSmall ? std::sqrt(kPi) * variance : std::sqrt(std::max(0.0, variance - 1.0 / 12.0));
  return std::exp(-2.0 * kPi * kPi * noise * noise) / std::sqrt(12.0);
}

}  // namespace

SpeedRounding speed_rounding(const DataSet& data) {
  const SpeedRounding none{0.0, 0.0, std::vector<bool>(data.records.size(), false)};
  const std::vector<Speeds> all = moving(data);
  double fastest = 0.0;
  for (const Speeds& s : all) {
    for (const double w : s.w) fastest = std::max(fastest, std::abs(w));
  }
  for (const double step : kSteps_rad_s) {
    if (step > kCoarsest * fastest) continue;
    std::vector<bool> on;
    for (const Speeds& s : all) on.push_back(on_grid(s, step));
    if (2 * std::count(on.begin(), on.end(), true) < static_cast<std::ptrdiff_t>(all.size())) continue;
    const Shown shown = shown_by(all, on, step);
    const bool moves = shown.moves >= kFewestMoves;
    if (!moves && step > kUnmoved_rad_s) continue;
    if ((!moves && set_points(shown.values)) || !(shown.where > 0.0) || shown.counts) return none;
    const double sigma = sigma_of(shown);
    if (sigma < kWorthwhile) return none;
    SpeedRounding out = none;
    out.step_rad_s = step;
    out.sigma_rad_s = sigma * step;
    for (std::size_t r = 0; r < all.size(); ++r) out.of_record[all[r].record] = on[r];
    return out;
  }
  return none;
}

}  // namespace imrig
