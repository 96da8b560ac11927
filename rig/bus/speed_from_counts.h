#pragma once
// Mechanical speed from encoder counts by a local least-squares fit.
//   w_k = (2 pi / counts_per_rev / T) * slope at k of the cubic through counts k-h..k+h,   2h+1 samples about
//   16 ms
// In the middle the window is centred; a swing of the shaft of 20 Hz, as a voltage step causes, loses 0.2 % of
// its amplitude where a straight line over 10 ms loses 4 %. Within h samples of an end
// the outermost full window's cubic is read off its middle. Noise for counts rounded independently (1/sqrt(12)
// count): sigma_w = (2 pi / counts_per_rev / T) sqrt(75/12) / sqrt(N^3), N = 2h+1 (centred, large N).

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace imrig {

inline constexpr double kSpeedWindow_s = 0.016;

// Counts as the DSP accumulates them, wrapping at 2^32, to a sequence without jumps that starts at the first
// count.
std::vector<std::int64_t> unwrap_counts(std::span<const std::int32_t> counts);

// Speed in rad/s at samples first .. first+n-1 of the unwrapped counts; the samples outside serve as margin.
// counts_per_rev > 0, sample_time_s > 0, first + n <= counts.size(). One sample alone gives NaN.
std::vector<double> speed_from_counts(std::span<const std::int64_t> counts, std::size_t first, std::size_t n,
                                      double sample_time_s, int counts_per_rev,
                                      double window_s = kSpeedWindow_s);

// One sigma of a centred sample's speed, rad/s, as above.
double speed_noise_rad_s(double sample_time_s, int counts_per_rev, double window_s = kSpeedWindow_s);

// Samples on each side of the centre: 2h+1 samples about window_s, h >= 1.
std::size_t speed_half_window(double sample_time_s, double window_s = kSpeedWindow_s);

}  // namespace imrig
