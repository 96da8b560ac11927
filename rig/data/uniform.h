#pragma once
// Time stamps to uniform sampling. TimeSeries knows only a sample time, so what a file holds must be a uniform stretch:
//   jitter up to 1 % of a step      the stamps are rounding; samples stay as they are
//   jitter up to 50 % of a step     linear interpolation onto the uniform grid, said in a warning
//   a step over 1.5 times the rest  a gap: the longest stretch without one is kept, said in a warning
//   stamps that go back or stand    refused

#include <cstddef>
#include <string>
#include <vector>

namespace imrig {

struct UniformStretch {
  double sample_time_s = 0.0;   // 0: refused, reason says why
  std::size_t begin = 0;        // rows [begin, end) of the file
  std::size_t end = 0;
  bool interpolate = false;     // onto t[begin] + k sample_time_s
  std::vector<std::string> warnings;
  std::string reason;
};

UniformStretch uniform_stretch(const std::vector<double>& t_s);

// Values at t[begin] + k dt for k = 0.. end - begin - 1, linear between neighbours.
std::vector<double> interpolate(const std::vector<double>& t_s, const std::vector<double>& x, const UniformStretch& stretch);

}  // namespace imrig
