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

// Least-squares cubic through a window; x counts samples from the window's middle.
struct Cubic {
  double slope = 0.0;      // counts per sample: of the part that is odd and linear
  double curvature = 0.0;  // the slope at x is slope + curvature x + third (3 x^2 - q)
  double third = 0.0;
  double q = 0.0;
  double slope_at(double x) const { return slope + curvature * x + third * (3.0 * x * x - q); }
};

// By the orthogonal polynomials of n points: x, x^2 - (n^2 - 1)/12, x^3 - q x with q = (3 n^2 - 7)/20.
Cubic fit_cubic(std::span<const std::int64_t> counts) {
  const auto n = static_cast<double>(counts.size());
  const double mean_x2 = (n * n - 1.0) / 12.0;
  Cubic fit;
  fit.q = (3.0 * n * n - 7.0) / 20.0;
  double slope_sum = 0.0, curvature_sum = 0.0, third_sum = 0.0;
  for (std::size_t k = 0; k < counts.size(); ++k) {
    const double x = static_cast<double>(k) - 0.5 * (n - 1.0);
    const auto c = static_cast<double>(counts[k] - counts[0]);
    slope_sum += x * c;
    curvature_sum += (x * x - mean_x2) * c;
    third_sum += x * (x * x - fit.q) * c;
  }
  const double norm_1 = n * mean_x2;
  const double norm_2 = norm_1 * (n * n - 4.0) / 15.0;
  fit.slope = slope_sum / norm_1;
  if (counts.size() > 2) fit.curvature = 2.0 * curvature_sum / norm_2;
  if (counts.size() > 3) fit.third = third_sum / (norm_2 * 9.0 * (n * n - 9.0) / 140.0);
  return fit;
}

// The centred cubic's slope while its window slides, from the moments m_p = sum_{j=-h}^{h} j^p c_{k+j},
// exact:
//   slope = (S6 m1 - S4 m3) / (S2 S6 - S4^2),   S_p = sum j^p
// Modulo 2^64: m1 and m3 do not depend on where counting began, no real shaft makes them large, and absurd
// counts do no harm.
class SlidingSlope {
 public:
  SlidingSlope(std::span<const std::int64_t> counts, std::size_t centre, std::size_t half)
      : counts_(counts), centre_(centre), half_(half) {
    for (std::size_t k = centre - half; k <= centre + half; ++k) {
      const std::uint64_t j = k - centre;
      m0_ += count(k);
      m1_ += j * count(k);
      m2_ += j * j * count(k);
      m3_ += j * j * j * count(k);
      const double x = static_cast<double>(static_cast<std::int64_t>(j));
      S2_ += x * x;
      S4_ += x * x * x * x;
      S6_ += x * x * x * x * x * x;
    }
  }
  double slope() const {
    const auto m1 = static_cast<double>(static_cast<std::int64_t>(m1_));
    const auto m3 = static_cast<double>(static_cast<std::int64_t>(m3_));
    if (half_ == 1) return m1 / S2_;  // three points know no cubic
    return (S6_ * m1 - S4_ * m3) / (S2_ * S6_ - S4_ * S4_);
  }
  void advance() {
    const std::uint64_t out = count(centre_ - half_), in = count(centre_ + half_ + 1), h = half_;
    // Each j becomes j - 1; the leaving sample sat at -h, the new one comes in at h.
    const std::uint64_t lost = h + 1;  // where the leaving sample would be: -(h + 1)
    m3_ += -(3 * m2_) + 3 * m1_ - m0_ + lost * lost * lost * out + h * h * h * in;
    m2_ += -(2 * m1_) + m0_ - lost * lost * out + h * h * in;
    m1_ += -m0_ + lost * out + h * in;
    m0_ += in - out;
    ++centre_;
  }

 private:
  std::uint64_t count(std::size_t k) const { return static_cast<std::uint64_t>(counts_[k]); }

  std::span<const std::int64_t> counts_;
  std::size_t centre_, half_;
  std::uint64_t m0_ = 0, m1_ = 0, m2_ = 0, m3_ = 0;
  double S2_ = 0.0, S4_ = 0.0, S6_ = 0.0;
};

}  // namespace

std::size_t speed_half_window(double sample_time_s, double window_s) {
  return static_cast<std::size_t>(std::clamp(std::round(0.5 * window_s / sample_time_s), 1.0, 1e5));
}

double speed_noise_rad_s(double sample_time_s, int counts_per_rev, double window_s) {
  const auto n = static_cast<double>(2 * speed_half_window(sample_time_s, window_s) + 1);
  // 75 (n^4 - ...)/(12 n^3 ...) of the centred slope; its exact form for n points.
  const double square = n < 5.0 ? 1.0 / (n * n * n)
                                : 75.0 * (3.0 * std::pow(n, 4) - 18.0 * n * n + 31.0) /
                                      (36.0 * n * (n * n - 1.0) * (n * n - 4.0) * (n * n - 9.0));
  return rad_s_per_count(sample_time_s, counts_per_rev) * std::sqrt(square);
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
  // Ends: the outermost full window's cubic, read off its middle.
  const std::size_t width = std::min(all, 2 * half + 1);
  const Cubic head = fit_cubic(counts.first(width));
  const Cubic tail = fit_cubic(counts.last(width));
  const double middle = 0.5 * static_cast<double>(width - 1);
  const std::size_t centred_begin = half;                       // first sample with a centred window
  const std::size_t centred_end = all > half ? all - half : 0;  // behind the last one
  const std::size_t begin = std::max(first, centred_begin);
  const std::size_t end = std::min(first + n, centred_end);
  for (std::size_t k = first; k < first + n; ++k) {
    if (k < centred_begin && (k < centred_end || 2 * k < all)) {
      speed[k - first] = unit * head.slope_at(static_cast<double>(k) - middle);
    } else if (k >= centred_end) {
      speed[k - first] =
          unit * tail.slope_at(static_cast<double>(k) - (static_cast<double>(all - width) + middle));
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
