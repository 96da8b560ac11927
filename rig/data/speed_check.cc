#include "rig/data/speed_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "rig/base/space_vector.h"

namespace imrig {

namespace {

constexpr double kFastest = 1.15;             // of synchronous: beyond it no generator of this kind runs
constexpr std::size_t kSamplesPerValue = 20;  // so seldom a speed is new where it moves in steps
constexpr std::size_t kFewestChanges = 8;
constexpr double kCoarse = 1e-4;   // of slip: 0.3 % of R_r at rated slip
constexpr double kSlowest = 0.70;  // beyond pull-out for all but special machines

// Whether a motor could run at this share of the synchronous speed.
bool fits(double share) { return share > 0.88 && share < 1.04; }

std::string cause(double share, int pole_pairs) {
  if (share < 0.0) return "its sign or the phase order is reversed";
  if (fits(share * 60.0 / (2.0 * kPi))) return "the column seems to hold rad/s, not rpm";
  if (fits(share * 2.0 * kPi / 60.0)) return "the column seems to hold rpm, not rad/s";
  if (pole_pairs > 1 && fits(share / pole_pairs)) {
    return fmt::format("it would fit 1 pole pair, or the column holds the electrical speed of {}",
                       pole_pairs);
  }
  for (int other = 1; other <= 12; ++other) {
    if (fits(share * other / pole_pairs))
      return fmt::format("{} pole pair{} would fit", other, other == 1 ? "" : "s");
  }
  if (fits(share * 60.0)) return "the column seems to hold turns per second, not rpm";
  if (fits(share / 1000.0) || fits(share * 1000.0)) return "off by a thousand";
  return "speed, frequency or pole pairs are wrong, or the motor is stalled";
}

}  // namespace

double fastest(const std::vector<double>& speed_rad_s) {
  double out = 0.0;
  for (const double speed : speed_rad_s) {
    if (std::abs(speed) > std::abs(out)) out = speed;
  }
  return out;
}

std::string coarse_speed(const std::vector<double>& speed_rad_s, double f_Hz, int pole_pairs) {
  if (pole_pairs <= 0 || !(std::abs(f_Hz) > 1.0)) return "";
  std::vector<double> values = speed_rad_s;
  std::erase_if(values, [](double w) { return !std::isfinite(w); });
  if (values.empty()) return "";
  const std::size_t samples = values.size();
  std::size_t changes = 0;
  for (std::size_t k = 1; k < samples; ++k) changes += values[k] != values[k - 1] ? 1u : 0u;
  if (changes < kFewestChanges) return "";  // set-points, not steps
  std::sort(values.begin(), values.end());
  // Rounding in the file is no step.
  const double same = 1e-6 * std::max(std::abs(values.front()), std::abs(values.back()));
  std::size_t different = 1;
  double step = std::numeric_limits<double>::infinity();
  for (std::size_t k = 1; k < samples; ++k) {
    const double apart = values[k] - values[k - 1];
    if (apart <= same) continue;
    ++different;
    step = std::min(step, apart);
  }
  const double slip = 0.5 * step * pole_pairs / (2.0 * kPi * std::abs(f_Hz));
  if (different < 2 || different * kSamplesPerValue > samples || slip < kCoarse) return "";
  return fmt::format(
      "speed moves in steps of {:.3g} rpm: while it is constant it may be off by half of one, a slip of "
      "{:.2g} %; count "
      "over a longer window",
      rpm_of_rad_s(step), 100.0 * slip);
}

std::string implausible_speed(double speed_rad_s, double f_Hz, int pole_pairs, bool may_stand) {
  if (pole_pairs <= 0 || !(std::abs(f_Hz) > 1.0) || std::isnan(speed_rad_s)) return "";
  const double synchronous = 2.0 * kPi * f_Hz / pole_pairs;
  const double share = speed_rad_s / synchronous;
  const bool slow = share < kSlowest && !may_stand;
  const bool backwards = share < -0.05;
  const bool units = may_stand && (fits(share * 60.0 / (2.0 * kPi)) || fits(share * 60.0));
  if (share <= kFastest && !slow && !backwards && !units) return "";
  return fmt::format(
      "speed {:.5g} rpm at {:.4g} Hz and {} pole pair{} (synchronous {:.5g} rpm) would be a slip of {:.3g} "
      "%; {}",
      rpm_of_rad_s(speed_rad_s), f_Hz, pole_pairs, pole_pairs == 1 ? "" : "s", rpm_of_rad_s(synchronous),
      100.0 * (1.0 - share), cause(share, pole_pairs));
}

}  // namespace imrig
