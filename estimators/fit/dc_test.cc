#include "estimators/fit/dc_test.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "estimators/fit/dc_levels.h"

namespace imrig::est {

namespace {

constexpr double kMovingShaft_rad_s = 0.5;
constexpr std::size_t kFewestZeros = 32;
constexpr std::size_t kBlocks = 16;     // a settled window is cut into, for noise and drift
constexpr double kDriftSigmas = 3.0;    // a larger change between the halves of a window is drift ...
constexpr double kDriftMatters = 5e-4;  // ... if it is also larger than this part of the value
constexpr double kCreepMatters =
    2e-3;  // likewise of the current, where the voltage is too noisy to show the drift
constexpr double kDistinct = 0.05;      // two currents differ when they differ by more than this part

struct Zeros {
  SpaceVector v{}, i{};
  bool found = false;
};

// Means of the channels with gates off and the current gone: the second half of the longest such stretch.
Zeros zeros_of(const TimeSeries& series) {
  Zeros zeros;
  if (series.gates_on.size() != series.size()) return zeros;
  Stretch longest;
  for (std::size_t begin = 0; begin < series.size();) {
    std::size_t end = begin;
    while (end < series.size() && series.gates_on[end] == 0) ++end;
    if (end - begin > longest.size()) longest = {begin, end};
    begin = end + 1;
  }
  longest.begin += longest.size() / 2;
  if (longest.size() < kFewestZeros) return zeros;
  for (std::size_t k = longest.begin; k < longest.end; ++k) {
    zeros.v += series.v[k];
    zeros.i += series.i[k];
  }
  zeros.v /= static_cast<double>(longest.size());
  zeros.i /= static_cast<double>(longest.size());
  zeros.found = true;
  return zeros;
}

struct Window {
  SpaceVector v{}, i{};
  double sigma_V = 0.0;  // of Re(v i*)/|i| - R |i| at fixed R
  double drift = 0.0;    // relative change of the resistance between the halves
  double drift_sigma = 0.0;
  double creep =
      0.0;  // likewise of the current: where the voltage is noisy it alone shows a flux that still builds up
  double creep_sigma = 0.0;
};

// Block means of one window give its level, its noise and its drift.
Window windowed(const TimeSeries& series, const Zeros& zeros, std::size_t begin, std::size_t end) {
  const std::size_t blocks = std::min(kBlocks, end - begin);
  const std::size_t length = (end - begin) / blocks;
  std::vector<SpaceVector> v(blocks), i(blocks);
  Window w;
  for (std::size_t b = 0; b < blocks; ++b) {
    for (std::size_t k = end - (b + 1) * length; k < end - b * length; ++k) {
      v[b] += (series.v[k] - zeros.v) / static_cast<double>(length);
      i[b] += (series.i[k] - zeros.i) / static_cast<double>(length);
    }
    w.v += v[b] / static_cast<double>(blocks);
    w.i += i[b] / static_cast<double>(blocks);
  }
  const double current = std::abs(w.i);
  const SpaceVector along = w.i / current;
  const double R = (w.v * std::conj(w.i)).real() / (current * current);
  double squares = 0.0, late = 0.0, early = 0.0, late_i = 0.0, early_i = 0.0;
  for (std::size_t b = 0; b < blocks; ++b) {
    const double left = ((v[b] - R * i[b]) * std::conj(along)).real();
    squares += left * left;
    (b < blocks / 2 ? late : early) += left / static_cast<double>(blocks / 2);
    (b < blocks / 2 ? late_i : early_i) += (i[b] * std::conj(along)).real() / static_cast<double>(blocks / 2);
  }
  const double n = static_cast<double>(blocks);
  w.sigma_V = std::sqrt(squares / (n * (n - 1.0)));
  w.drift = (late - early) / (R * current);
  w.creep = (late_i - early_i) / current;
  // Differences of neighbours see the noise without the drift.
  double rough = 0.0, rough_i = 0.0;
  for (std::size_t b = 1; b < blocks; ++b) {
    const double step = ((v[b] - R * i[b] - v[b - 1] + R * i[b - 1]) * std::conj(along)).real();
    rough += step * step / (2.0 * (n - 1.0));
    const double step_i = ((i[b] - i[b - 1]) * std::conj(along)).real();
    rough_i += step_i * step_i / (2.0 * (n - 1.0));
  }
  w.drift_sigma = std::sqrt(rough * 4.0 / n) / (R * current);
  w.creep_sigma = std::sqrt(rough_i * 4.0 / n) / current;
  return w;
}

// The settled end of a stretch: the longest of these parts that does not drift, else the shortest if its
// drift is small.
bool settled(const TimeSeries& series, const Zeros& zeros, const Stretch& stretch, Window& out) {
  constexpr std::array<double, 5> kParts{0.5, 0.35, 0.25, 0.15, 0.1};
  for (const double part : kParts) {
    const auto length = static_cast<std::size_t>(part * static_cast<double>(stretch.size()));
    if (length < 8) break;
    out = windowed(series, zeros, stretch.end - length, stretch.end);
    const auto moves = [](double change, double sigma, double matters) {
      return std::abs(change) > kDriftSigmas * sigma && std::abs(change) > matters;
    };
    // A flux that builds up moves the current and the resistance alike; a supply that wanders only the
    // current.
    const bool hidden = std::abs(out.creep) < kDriftSigmas * out.drift_sigma;
    if (!moves(out.drift, out.drift_sigma, kDriftMatters) &&
        !(hidden && moves(out.creep, out.creep_sigma, kCreepMatters)))
      return true;
  }
  return false;
}

// Weighted straight line y = R x + v_0.
void line(const std::vector<DcLevel>& levels, DcResult& result) {
  double s = 0.0, sx = 0.0, sy = 0.0, sxx = 0.0, sxy = 0.0;
  for (const auto& level : levels) {
    const double weight = 1.0 / (level.sigma_V * level.sigma_V);
    s += weight;
    sx += weight * level.current_A;
    sy += weight * level.voltage_V;
    sxx += weight * level.current_A * level.current_A;
    sxy += weight * level.current_A * level.voltage_V;
  }
  const double det = s * sxx - sx * sx;
  result.R_s_ohm = (s * sxy - sx * sy) / det;
  result.v_0_V = (sy - result.R_s_ohm * sx) / s;
  double chi2 = 0.0;
  for (const auto& level : levels) {
    const double left = (level.voltage_V - result.R_s_ohm * level.current_A - result.v_0_V) / level.sigma_V;
    chi2 += left * left;
  }
  const double spare = static_cast<double>(levels.size()) - 2.0;
  result.sigma_ohm = std::sqrt(s / det);
  result.degrees_of_freedom = 15.0 * static_cast<double>(levels.size());
  if (spare >= 1.0 && chi2 > spare) {  // the levels scatter more than their noise says
    result.sigma_ohm *= std::sqrt(chi2 / spare);
    result.degrees_of_freedom = spare;
  }
}

bool distinct(const std::vector<DcLevel>& levels) {
  const auto by_current = [](const DcLevel& a, const DcLevel& b) { return a.current_A < b.current_A; };
  const auto [low, high] = std::minmax_element(levels.begin(), levels.end(), by_current);
  return levels.size() > 1 && high->current_A - low->current_A > kDistinct * high->current_A;
}

// All levels carry one current: v_0 cannot be told apart from R_s and is taken as zero.
void mean_resistance(const std::vector<DcLevel>& levels, DcResult& result) {
  double weights = 0.0, sum = 0.0;
  for (const auto& level : levels) {
    const double weight = level.current_A * level.current_A / (level.sigma_V * level.sigma_V);
    weights += weight;
    sum += weight * level.voltage_V / level.current_A;
  }
  result.R_s_ohm = sum / weights;
  result.sigma_ohm = 1.0 / std::sqrt(weights);
  result.degrees_of_freedom = 15.0 * static_cast<double>(levels.size());
  result.notes.push_back("one level of current: an offset of the voltage cannot be told from R_s");
}

double mean_temperature(const TimeSeries& series) {
  double sum = 0.0;
  std::size_t n = 0;
  for (const double t : series.stator_C) {
    if (!std::isfinite(t)) continue;
    sum += t;
    ++n;
  }
  return n > 0 ? sum / static_cast<double>(n) : kMissing;
}

std::string unfit(const TimeSeries& series) {
  if (series.v.size() != series.size() || series.size() < 64) return "has fewer than 64 samples";
  for (std::size_t k = 0; k < series.size(); ++k) {
    if (!std::isfinite(series.v[k].real() + series.v[k].imag() + series.i[k].real() + series.i[k].imag()))
      return "holds missing values";
    if (k < series.speed_rad_s.size() && std::abs(series.speed_rad_s[k]) > kMovingShaft_rad_s) {
      return fmt::format("the shaft turns ({:.1f} rpm)", rpm_of_rad_s(series.speed_rad_s[k]));
    }
  }
  return "";
}

}  // namespace

DcResult fit_dc(const TimeSeries& series) {
  DcResult result;
  result.failure = unfit(series);
  if (!result.failure.empty()) return result;
  const Zeros zeros = zeros_of(series);
  if (!zeros.found)
    result.notes.push_back("no stretch with the gates off: the channels' zeros are taken as right");
  double worst = 0.0;
  for (const auto& stretch : dc_stretches(series)) {
    Window w;
    if (!settled(series, zeros, stretch, w)) {
      worst = std::max({worst, std::abs(w.drift), std::abs(w.creep)});
      continue;
    }
    const double current = std::abs(w.i);
    const double voltage = (w.v * std::conj(w.i)).real() / current;
    const double sigma =
        std::hypot(w.sigma_V, 0.5 * w.drift * voltage);  // drift that hides in the noise counts as doubt
    result.levels.push_back({current, voltage, std::max(sigma, 1e-12)});
  }
  if (result.levels.empty()) {
    result.failure =
        worst > 0.0
            ? fmt::format("no level settles: i or v/i still moves by {:.2g} % at the end", 100.0 * worst)
            : "no direct current flows";
    return result;
  }
  if (worst > 0.0)
    result.notes.push_back(
        fmt::format("a level that had not settled ({:.2g} %) was left out", 100.0 * worst));
  result.stator_C = mean_temperature(series);
  if (distinct(result.levels)) {
    line(result.levels, result);
  } else {
    mean_resistance(result.levels, result);
  }
  if (!(result.R_s_ohm > 0.0))
    result.failure = "voltage and current have opposite signs; check the channels' polarity";
  return result;
}

}  // namespace imrig::est
