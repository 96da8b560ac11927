#include "rig/data/column_quality.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace imrig {

namespace {

constexpr std::size_t kRun = 4;    // samples in a row
constexpr std::size_t kOften = 6;  // times as often as in the next band
constexpr double kBand = 0.02;     // of the half range
constexpr double kUneven = 0.1;

struct Extreme {
  std::size_t exactly = 0, longest_run = 0;  // samples at the extreme itself
  std::size_t band = 0, next = 0;            // in the band below it, and in the one below that
};

// sign +1: the largest value; -1: the smallest.
Extreme extreme_of(const std::vector<double>& x, double sign, double top, double width) {
  Extreme out;
  std::size_t run = 0;
  for (const double value : x) {
    const double below = top - sign * value;
    run = below == 0.0 ? run + 1 : 0;
    out.exactly += below == 0.0 ? 1u : 0u;
    out.longest_run = std::max(out.longest_run, run);
    out.band += below < width ? 1u : 0u;
    out.next += below >= width && below < 2.0 * width ? 1u : 0u;
  }
  return out;
}

double top_of(const std::vector<double>& x, double sign) {
  double top = -INFINITY;
  for (const double value : x) {
    if (sign * value > top) top = sign * value;
  }
  return top;
}

double rms(const std::vector<double>& x) {
  double sum = 0.0;
  for (const double value : x) sum += std::isnan(value) ? 0.0 : value * value;
  return x.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(x.size()));
}

}  // namespace

std::string clipped(const std::vector<double>& x) {
  const double tops[] = {top_of(x, 1.0), top_of(x, -1.0)};
  if (!(tops[0] > -tops[1])) return "";  // constant or empty: another matter
  for (const double sign : {1.0, -1.0}) {
    const double top = tops[sign > 0.0 ? 0 : 1];
    const Extreme found = extreme_of(x, sign, top, kBand * 0.5 * (tops[0] + tops[1]));
    // A value that is held for some samples, by a slow converter say, needs a longer run where nothing lies
    // beside it.
    const std::size_t needed = found.next == 0 ? 4 * kRun : kRun;
    if (found.longest_run < needed || found.band < kOften * found.next) continue;
    return fmt::format("sits at its {} value {:.4g} in {} of {} samples, up to {} in a row: clipped?",
                       sign > 0 ? "largest" : "smallest", sign * top, found.exactly, x.size(),
                       found.longest_run);
  }
  return "";
}

std::string uneven_sum(const std::vector<double>& a, const std::vector<double>& b,
                       const std::vector<double>& c) {
  std::vector<double> sum(a.size());
  for (std::size_t k = 0; k < sum.size(); ++k) sum[k] = a[k] + b[k] + c[k];
  const double largest = std::max({rms(a), rms(b), rms(c)});
  if (!(rms(sum) > kUneven * largest)) return "";
  return fmt::format(
      "do not sum to zero: the sum has {:.3g} rms, the largest of them {:.3g}; a sensor's sign or scale is "
      "wrong",
      rms(sum), largest);
}

}  // namespace imrig
