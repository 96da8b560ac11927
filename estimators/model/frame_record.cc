#include "estimators/model/frame_record.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "rig/base/error.h"

namespace imrig::est {

namespace {

using Complex = std::complex<double>;

constexpr std::size_t kFewestSamples = 16;
constexpr double kFilterMemory = 8.0;  // time constants until the filter's start is forgotten: exp(-8) = 3e-4

// The longest stretch with the gates on: [begin, end).
std::pair<std::size_t, std::size_t> driven_stretch(const TimeSeries& series) {
  if (series.gates_on.empty()) return {0, series.size()};
  std::pair<std::size_t, std::size_t> best{0, 0};
  for (std::size_t begin = 0; begin < series.size();) {
    std::size_t end = begin;
    while (end < series.size() && series.gates_on[end] != 0) ++end;
    if (end - begin > best.second - best.first) best = {begin, end};
    begin = end + 1;
  }
  return best;
}

void check(const TimeSeries& series) {
  const std::size_t n = series.size();
  const bool flags_match = series.gates_on.empty() || series.gates_on.size() == n;
  if (series.v.size() != n || series.speed_rad_s.size() != n || !flags_match) {
    throw Error("record", "has voltage, current and speed of different lengths");
  }
  if (!(series.sample_time_s > 0.0) || !(series.voltage_filter_s >= 0.0))
    throw Error("record", "has no valid sample time");
}

void check_finite(const TimeSeries& series, std::size_t begin, std::size_t end) {
  for (std::size_t k = begin; k < end; ++k) {
    const double sum = series.v[k].real() + series.v[k].imag() + series.i[k].real() + series.i[k].imag() +
                       series.speed_rad_s[k];
    if (!std::isfinite(sum)) throw Error("record", fmt::format("holds a missing value at sample {}", k));
  }
}

double frame_speed(const TimeSeries& series, std::size_t begin, std::size_t end) {
  Complex turn = 0.0;
  for (std::size_t k = begin; k + 1 < end; ++k) turn += series.v[k + 1] * std::conj(series.v[k]);
  return turn == Complex(0.0) ? 0.0 : std::arg(turn) / series.sample_time_s;
}

// tau dy/dt = x - y - j w tau y with x on a straight line between samples, stepped exactly; starts in the
// quasi-steady state of its input.
void filter_like_voltage(FrameRecord& record, double tau) {
  const double h = record.sample_time_s;
  const Complex rate(1.0 / tau, record.w_k);
  const Complex z = rate * h;
  const Complex decay = std::exp(-z);
  const Complex gain = 1.0 / (rate * tau);
  const Complex slope = (1.0 - decay) / z;
  const Complex old_weight = gain * (slope - decay);
  const Complex new_weight = gain * (1.0 - slope);
  Complex x = record.i.front();
  record.i.front() *= gain;
  for (std::size_t k = 1; k < record.size(); ++k) {
    const Complex next = record.i[k];
    record.i[k] = decay * record.i[k - 1] + old_weight * x + new_weight * next;
    x = next;
  }
  // White noise through y[k+1] = d y[k] + a x[k] + b x[k+1].
  const double power = (std::norm(old_weight) + std::norm(new_weight) +
                        2.0 * (std::conj(old_weight) * decay * new_weight).real()) /
                       (1.0 - std::norm(decay));
  record.noise_gain = std::sqrt(power);
  record.judged_from = static_cast<std::size_t>(std::ceil(kFilterMemory * tau / h));
}

}  // namespace

Complex FrameRecord::back(std::size_t k) const {
  return std::polar(1.0, w_k * sample_time_s * static_cast<double>(k));
}

FrameRecord to_frame(const TimeSeries& series, int pole_pairs) {
  check(series);
  const auto [begin, end] = driven_stretch(series);
  if (end - begin < kFewestSamples)
    throw Error("record", fmt::format("has {} samples with the gates on", end - begin),
                "at least 16 are needed");
  check_finite(series, begin, end);
  FrameRecord record;
  record.sample_time_s = series.sample_time_s;
  record.first = begin;
  record.w_k = frame_speed(series, begin, end);
  for (std::size_t k = begin; k < end; ++k) {
    const Complex turn = std::conj(record.back(k - begin));
    record.v.push_back(series.v[k] * turn);
    record.i.push_back(series.i[k] * turn);
    record.w_r.push_back(pole_pairs * series.speed_rad_s[k]);
  }
  if (series.voltage_filter_s > 0.0) filter_like_voltage(record, series.voltage_filter_s);
  if (record.judged_from + kFewestSamples > record.size())
    throw Error("record", "is shorter than the memory of the voltage filter");
  return record;
}

}  // namespace imrig::est
