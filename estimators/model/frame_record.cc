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
constexpr std::size_t kTurnsAtMost =
    64;  // by multiplication before the angle is taken anew: rounding stays below 1e-14
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

// tau dy/dt = x - y - j w tau y with x on a straight line between samples, stepped exactly.
FilterStep step_of(double tau, double h, double w_k) {
  const Complex rate(1.0 / tau, w_k);
  FilterStep f;
  f.gain = 1.0 / (rate * tau);
  f.decay = std::exp(-rate * h);
  const Complex slope = (1.0 - f.decay) / (rate * h);
  f.old = f.gain * (slope - f.decay);
  f.fresh = f.gain * (1.0 - slope);
  return f;
}

template <class Value>
void run_filter(std::vector<Value>& signal, Value start, Value decay, Value old, Value fresh) {
  Value x = signal.front();
  signal.front() = start;
  for (std::size_t k = 1; k < signal.size(); ++k) {
    const Value next = signal[k];
    signal[k] = decay * signal[k - 1] + old * x + fresh * next;
    x = next;
  }
}

// Starts in the quasi-steady state of its input.
void filter_like_voltage(FrameRecord& record, double tau) {
  record.filter_s = tau;
  record.judged_from = static_cast<std::size_t>(std::ceil(kFilterMemory * tau / record.sample_time_s));
  const FilterStep f = step_of(tau, record.sample_time_s, record.w_k);
  const Complex start = record.i.front() * f.gain;
  run_filter(record.i, start, f.decay, f.old, f.fresh);
  const FilterStep still = step_of(tau, record.sample_time_s, 0.0);
  run_filter(record.w_r, record.w_r.front(), still.decay.real(), still.old.real(), still.fresh.real());
  double power = 0.0;
  for (const Complex& response : record.filter_response()) power += std::norm(response);
  record.noise_gain = std::sqrt(power);
}

}  // namespace

Complex FrameRecord::back(std::size_t k) const {
  return std::polar(1.0, w_k * sample_time_s * static_cast<double>(k));
}

FilterStep FrameRecord::filter_step() const { return step_of(filter_s, sample_time_s, w_k); }

std::vector<Complex> FrameRecord::filter_response() const {
  if (filter_s <= 0.0) return {1.0};
  const FilterStep f = filter_step();
  std::vector<Complex> response{f.fresh, f.decay * f.fresh + f.old};
  while (response.size() < judged_from) response.push_back(f.decay * response.back());
  return response;
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
  record.pole_pairs = pole_pairs;
  record.w_k = frame_speed(series, begin, end);
  record.v.reserve(end - begin);
  record.i.reserve(end - begin);
  record.w_r.reserve(end - begin);
  const Complex once = std::polar(1.0, -record.w_k * record.sample_time_s);
  Complex turn = 1.0;
  for (std::size_t k = begin; k < end; ++k) {
    if ((k - begin) % kTurnsAtMost == 0) turn = std::conj(record.back(k - begin));
    record.v.push_back(series.v[k] * turn);
    record.i.push_back(series.i[k] * turn);
    record.w_r.push_back(pole_pairs * series.speed_rad_s[k]);
    turn *= once;
  }
  if (series.voltage_filter_s > 0.0) filter_like_voltage(record, series.voltage_filter_s);
  if (record.judged_from + kFewestSamples > record.size())
    throw Error("record", "is shorter than the memory of the voltage filter");
  return record;
}

void straighten(std::vector<Complex>& v) {
  if (v.size() < 5) return;
  std::vector<Complex> bend(v.size(), 0.0);  // second differences, 0 beside a step
  for (std::size_t k = 1; k + 1 < v.size(); ++k) {
    bend[k] = v[k + 1] - 2.0 * v[k] + v[k - 1];
    if (std::norm(bend[k]) > kBend * kBend * std::norm(v[k])) bend[k] = 0.0;
  }
  double second = 0.0, fourth = 0.0;
  std::vector<Complex> bend_of_bend(v.size(), 0.0);
  for (std::size_t k = 2; k + 2 < v.size(); ++k) {
    if (bend[k - 1] == 0.0 || bend[k] == 0.0 || bend[k + 1] == 0.0) continue;
    bend_of_bend[k] = bend[k + 1] - 2.0 * bend[k] + bend[k - 1];
    second += std::norm(bend[k]);
    fourth += std::norm(bend_of_bend[k]);
  }
  if (!(second > 0.0)) return;
  // 6 and 70: what differences make of white noise.
  const double smooth = std::clamp((0.5 - (fourth / 70.0) / (second / 6.0)) / 0.3, 0.0, 1.0);
  for (std::size_t k = 2; k + 2 < v.size(); ++k)
    v[k] -= smooth * (bend[k] * (1.0 / 12.0) - bend_of_bend[k] * (11.0 / 720.0));
}

FrameRecord to_driving_frame(const TimeSeries& series, int pole_pairs) {
  FrameRecord record = to_frame(series, pole_pairs);
  straighten(record.v);
  return record;
}

}  // namespace imrig::est
