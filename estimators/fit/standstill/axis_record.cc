#include "estimators/fit/standstill/axis_record.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>

#include "estimators/model/frame_record.h"

namespace imrig::est {

namespace {

constexpr double kAtRest_rad_s = 0.2;  // electrical, mean over the record: below, R_r moves by less than 1e-3
constexpr double kOffAxis = 0.1;       // of the current's rms: more of it turns, and makes torque
constexpr std::size_t kFewest = 64;

std::complex<double> mean_of(const std::vector<std::complex<double>>& x, std::size_t from) {
  std::complex<double> sum = 0.0;
  for (std::size_t k = from; k < x.size(); ++k) sum += x[k];
  return sum / static_cast<double>(x.size() - from);
}

}  // namespace

AxisRecord axis_record(const TimeSeries& series, int pole_pairs) {
  AxisRecord out;
  // The frame's turning is undone: with one axis it is a noisy number about zero.
  const FrameRecord frame = to_frame(series, pole_pairs);
  out.sample_time_s = frame.sample_time_s;
  out.noise_gain = frame.noise_gain;
  std::vector<std::complex<double>> v, i;
  double turned = 0.0;
  for (std::size_t k = frame.judged_from; k < frame.size(); ++k) {
    v.push_back(frame.v[k] * frame.back(k));
    i.push_back(frame.i[k] * frame.back(k));
    turned += frame.w_r[k];
  }
  if (i.size() < kFewest) {
    out.failure = fmt::format("has {} samples with the gates on", i.size());
    return out;
  }
  turned /= static_cast<double>(i.size());
  if (std::abs(turned) > kAtRest_rad_s) {
    out.failure = fmt::format("the shaft turns at {:.2g} rad/s (electrical)", turned);
    return out;
  }
  const std::complex<double> middle = mean_of(i, 0);
  std::complex<double> square = 0.0;
  double power = 0.0;
  for (const auto& x : i) {
    square += (x - middle) * (x - middle);
    power += std::norm(x - middle);
  }
  if (!(power > 0.0)) {
    out.failure = "the current does not change";
    return out;
  }
  const double off_axis = std::sqrt(std::max(0.0, 0.5 * (1.0 - std::abs(square) / power)));
  if (off_axis > kOffAxis) {
    out.failure =
        fmt::format("{:.0f} % of the current lies across its main axis: the field turns", 100.0 * off_axis);
    return out;
  }
  out.angle_rad = 0.5 * std::arg(square);
  const std::complex<double> back = std::polar(1.0, -out.angle_rad);
  for (std::size_t k = 0; k < i.size(); ++k) {
    out.u.push_back((v[k] * back).real());
    out.i.push_back((i[k] * back).real());
  }
  return out;
}

}  // namespace imrig::est
