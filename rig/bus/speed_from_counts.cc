#include "rig/bus/speed_from_counts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "rig/base/space_vector.h"

namespace imrig {

namespace {

double rad_s_per_count(double sample_time_s, int counts_per_rev) {
  return 2.0 * kPi / counts_per_rev / sample_time_s;
}

// Least-squares parabola through a window; x counts samples from the window's middle.
struct Parabola {
  double slope = 0.0;      // counts per sample, in the middle
  double curvature = 0.0;  // counts per sample^2: the slope at x is slope + curvature x
};

// By the orthogonal polynomials of n points, x and x^2 - (n^2 - 1)/12.
Parabola fit_parabola(std::span<const std::int64_t> counts) {
  const auto n = static_cast<double>(counts.size());
  const double mean_x2 = (n * n - 1.0) / 12.0;
  double slope_sum = 0.0;
  double curvature_sum = 0.0;
  for (std::size_t k = 0; k < counts.size(); ++k) {
    const double x = static_cast<double>(k) - 0.5 * (n - 1.0);
    const auto c = static_cast<double>(counts[k] - counts[0]);
    slope_sum += x * c;
    curvature_sum += (x * x - mean_x2) * c;
  }
  Parabola fit;
  fit.slope = slope_sum / (n * mean_x2);
  if (counts.size() > 2) fit.curvature = 2.0 * curvature_sum / (n * mean_x2 * (n * n - 4.0) / 15.0);
  return fit;
}

// sum_{j=-h}^{h} j c_{k+j} while the window slides, exact. Modulo 2^64: no real shaft comes near, and absurd
// counts do no harm.
class SlidingSlope {
 public:
  SlidingSlope(std::span<const std::int64_t> counts, std::size_t centre, std::size_t half)
      : counts_(counts), centre_(centre), half_(half) {
    for (std::size_t j = centre - half; j <= centre + half; ++j) {
      sum_ += count(j);
      moment_ += (j - centre) * count(j);
    }
    const auto n = static_cast<double>(2 * half + 1);
    sum_x2_ = n * (n * n - 1.0) / 12.0;
  }
  double slope() const { return static_cast<double>(static_cast<std::int64_t>(moment_)) / sum_x2_; }
  void advance() {
    const std::uint64_t out = count(centre_ - half_);
    const std::uint64_t in = count(centre_ + half_ + 1);
    moment_ += (half_ + 1) * out + half_ * in - sum_;
    sum_ += in - out;
    ++centre_;
  }

 private:
  std::uint64_t count(std::size_t k) const { return static_cast<std::uint64_t>(counts_[k]); }

  std::span<const std::int64_t> counts_;
  std::size_t centre_;
  std::size_t half_;
  std::uint64_t sum_ = 0;
  std::uint64_t moment_ = 0;
  double sum_x2_ = 0.0;
};

}  // namespace

std::size_t speed_half_window(double sample_time_s, double window_s) {
  return static_cast<std::size_t>(std::clamp(std::round(0.5 * window_s / sample_time_s), 1.0, 1e5));
}

double speed_noise_rad_s(double sample_time_s, int counts_per_rev, double window_s) {
  const auto n = static_cast<double>(2 * speed_half_window(sample_time_s, window_s) + 1);
  return rad_s_per_count(sample_time_s, counts_per_rev) / std::sqrt(n * n * n);
}

std::vector<std::int64_t> unwrap_counts(std::span<const std::int32_t> counts) {
  std::vector<std::int64_t> out(counts.size());
  for (std::size_t k = 0; k < counts.size(); ++k) {
    if (k == 0) {
      out[0] = counts[0];
      continue;
    }
    const auto step = static_cast<std::uint32_t>(counts[k]) - static_cast<std::uint32_t>(counts[k - 1]);
    out[k] = out[k - 1] + static_cast<std::int32_t>(step);
  }
  return out;
}

std::vector<double> speed_from_counts(std::span<const std::int64_t> counts, std::size_t first, std::size_t n,
                                      double sample_time_s, int counts_per_rev, double window_s) {
  const double unit = rad_s_per_count(sample_time_s, counts_per_rev);
  const std::size_t half = speed_half_window(sample_time_s, window_s);
  const std::size_t all = counts.size();
  std::vector<double> speed(n, std::numeric_limits<double>::quiet_NaN());
  if (all < 2) return speed;
  // Ends: the outermost full window's parabola, read off its middle.
  const std::size_t width = std::min(all, 2 * half + 1);
  const Parabola head = fit_parabola(counts.first(width));
  const Parabola tail = fit_parabola(counts.last(width));
  const double middle = 0.5 * static_cast<double>(width - 1);
  const std::size_t centred_begin = half;                       // first sample with a centred window
  const std::size_t centred_end = all > half ? all - half : 0;  // behind the last one
  const std::size_t begin = std::max(first, centred_begin);
  const std::size_t end = std::min(first + n, centred_end);
  for (std::size_t k = first; k < first + n; ++k) {
    if (k < centred_begin && (k < centred_end || 2 * k < all)) {
      speed[k - first] = unit * (head.slope + head.curvature * (static_cast<double>(k) - middle));
    } else if (k >= centred_end) {
      speed[k - first] = unit * (tail.slope + tail.curvature * (static_cast<double>(k) -
                                                                (static_cast<double>(all - width) + middle)));
    }
  }
  if (begin < end) {
    SlidingSlope window(counts, begin, half);
    for (std::size_t k = begin;; window.advance()) {
      speed[k - first] = unit * window.slope();
      if (++k == end) break;
    }
  }
  return speed;
}

}  // namespace imrig
