#pragma once
// Time stamps to uniform sampling. TimeSeries knows only a sample time, so what a file holds must be a
// uniform stretch:
//   jitter up to 1 % of a step      the stamps are rounded; samples stay as they are
//   jitter up to 50 % of a step     linear interpolation onto the uniform grid, said in a warning
//   a step over 1.5 times the rest  a gap, and so is a row that misses a value: the longest stretch without
//   one is kept, said in a warning stamps that stand or go back    refused

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace imrig {

struct UniformStretch {
  double sample_time_s = 0.0;  // 0: refused, reason says why
  std::size_t begin = 0;       // rows [begin, end) of the file
  std::size_t end = 0;
  bool interpolate = false;  // onto t[begin] + k sample_time_s
  std::vector<std::string> warnings;
  std::string reason;
};

inline constexpr std::size_t kShortestRecord = 16;  // samples
inline constexpr double kGap = 1.5;                 // of the median step: beyond it samples are missing

// Of at least two stamps.
double median_step(const std::vector<double>& t_s);

// complete[k] is 0 where row k misses a value it needs; same length as t_s.
UniformStretch uniform_stretch(const std::vector<double>& t_s, const std::vector<std::uint8_t>& complete);

// The stretch's values: as they are, or at t[begin] + k dt for k = 0 .. end - begin - 1, linear between
// neighbours. Empty stays empty.
std::vector<double> take(const UniformStretch& stretch, const std::vector<double>& t_s,
                         const std::vector<double>& x);

}  // namespace imrig
