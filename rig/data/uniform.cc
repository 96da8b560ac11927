#include "rig/data/uniform.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace imrig {

namespace {

constexpr double kRounding = 0.01;   // of a step: left as it is
constexpr double kRepairable = 0.5;  // of a step: interpolated

UniformStretch refused(std::string reason) {
  UniformStretch stretch;
  stretch.reason = std::move(reason);
  return stretch;
}

std::string bad_stamp(const std::vector<double>& t_s) {
  for (std::size_t k = 0; k < t_s.size(); ++k) {
    if (!std::isfinite(t_s[k])) return fmt::format("sample {} has no time stamp", k + 1);
    if (k > 0 && !(t_s[k] > t_s[k - 1])) {
      return fmt::format("time stands or goes back at sample {} ({} s after {} s)", k + 1, t_s[k],
                         t_s[k - 1]);
    }
  }
  return "";
}

struct Breaks {
  std::size_t gaps = 0, incomplete = 0;
  double longest_s = 0.0, longest_at_s = 0.0;
};

// The longest run of complete rows without a gap in time.
Breaks longest_run(const std::vector<double>& t_s, const std::vector<std::uint8_t>& complete, double step_s,
                   UniformStretch& best) {
  Breaks breaks;
  std::size_t begin = 0;
  for (std::size_t k = 0; k <= t_s.size(); ++k) {
    const bool over = k == t_s.size();
    const bool gap = !over && k > 0 && t_s[k] - t_s[k - 1] > kGap * step_s;
    const bool hole = !over && complete[k] == 0;
    if (gap) {
      ++breaks.gaps;
      if (t_s[k] - t_s[k - 1] > breaks.longest_s) {
        breaks.longest_s = t_s[k] - t_s[k - 1];
        breaks.longest_at_s = t_s[k - 1];
      }
    }
    breaks.incomplete += hole ? 1u : 0u;
    if ((over || gap || hole) && k - std::min(k, begin) > best.end - best.begin) {
      best.begin = begin;
      best.end = k;
    }
    if (gap) begin = k;
    if (hole) begin = k + 1;
  }
  return breaks;
}

void tell_breaks(const Breaks& breaks, std::size_t total, UniformStretch& stretch) {
  const std::string kept =
      fmt::format("the longest whole stretch is kept, {} of {} samples", stretch.end - stretch.begin, total);
  if (breaks.gaps > 0) {
    stretch.warnings.push_back(fmt::format("{} gap{} in time, the longest of {:.4g} s after t = {:.6g} s; {}",
                                           breaks.gaps, breaks.gaps == 1 ? "" : "s", breaks.longest_s,
                                           breaks.longest_at_s, kept));
  }
  if (breaks.incomplete > 0) {
    stretch.warnings.push_back(
        fmt::format("{} of {} rows miss a voltage, current or speed; {}", breaks.incomplete, total, kept));
  }
}

double largest_deviation(const std::vector<double>& t_s, const UniformStretch& stretch) {
  double largest = 0.0;
  for (std::size_t k = stretch.begin; k < stretch.end; ++k) {
    const double ideal = t_s[stretch.begin] + static_cast<double>(k - stretch.begin) * stretch.sample_time_s;
    largest = std::max(largest, std::abs(t_s[k] - ideal));
  }
  return largest;
}

}  // namespace

double median_step(const std::vector<double>& t_s) {
  std::vector<double> steps(t_s.size() - 1);
  for (std::size_t k = 0; k < steps.size(); ++k) steps[k] = t_s[k + 1] - t_s[k];
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

UniformStretch uniform_stretch(const std::vector<double>& t_s, const std::vector<std::uint8_t>& complete) {
  if (t_s.size() < kShortestRecord)
    return refused(fmt::format("has {} samples; at least {} are needed", t_s.size(), kShortestRecord));
  if (const auto bad = bad_stamp(t_s); !bad.empty()) return refused(bad);
  UniformStretch stretch;
  const double step_s = median_step(t_s);
  const Breaks breaks = longest_run(t_s, complete, step_s, stretch);
  const std::size_t count = stretch.end - stretch.begin;
  if (count < kShortestRecord) {
    return refused(
        fmt::format("{} gaps in time and {} of {} rows with missing values leave no stretch of {} samples",
                    breaks.gaps, breaks.incomplete, t_s.size(), kShortestRecord));
  }
  stretch.sample_time_s = (t_s[stretch.end - 1] - t_s[stretch.begin]) / static_cast<double>(count - 1);
  tell_breaks(breaks, t_s.size(), stretch);
  const double jitter = largest_deviation(t_s, stretch) / stretch.sample_time_s;
  if (jitter > kRepairable) {
    return refused(fmt::format(
        "time stamps are not uniform: they stray up to {:.3g} steps of {:.4g} s from an even grid", jitter,
        stretch.sample_time_s));
  }
  stretch.interpolate = jitter > kRounding;
  if (stretch.interpolate) {
    stretch.warnings.push_back(
        fmt::format("time stamps stray up to {:.2g} of a step; interpolated onto {:.6g} s", jitter,
                    stretch.sample_time_s));
  }
  return stretch;
}

std::vector<double> take(const UniformStretch& stretch, const std::vector<double>& t_s,
                         const std::vector<double>& x) {
  if (x.empty()) return {};
  const auto from = [](std::size_t k) { return static_cast<std::ptrdiff_t>(k); };
  if (!stretch.interpolate) return {x.begin() + from(stretch.begin), x.begin() + from(stretch.end)};
  std::vector<double> even(stretch.end - stretch.begin);
  std::size_t left = stretch.begin;
  for (std::size_t k = 0; k < even.size(); ++k) {
    const double t = t_s[stretch.begin] + static_cast<double>(k) * stretch.sample_time_s;
    while (left + 2 < stretch.end && t_s[left + 1] < t) ++left;
    const double share = std::clamp((t - t_s[left]) / (t_s[left + 1] - t_s[left]), 0.0, 1.0);
    even[k] = x[left] + share * (x[left + 1] - x[left]);
  }
  return even;
}

}  // namespace imrig
