#include "estimators/fit/global/driven_record.h"

#include <algorithm>
#include <cmath>

namespace imrig::est {

namespace {

using Complex = std::complex<double>;

constexpr double kSlope_s = 2e-3;  // noise of the speed times a lag of 5 ms makes twice the noise

template <class X>
std::vector<X> averaged(const std::vector<X>& x, std::size_t by) {
  std::vector<X> out;
  out.reserve(x.size() / by);
  for (std::size_t k = 0; k + by <= x.size(); k += by) {
    X sum{};
    for (std::size_t m = 0; m < by; ++m) sum += x[k + m];
    out.push_back(sum * (1.0 / static_cast<double>(by)));
  }
  return out;
}

// Sigma of white noise after the matched filter and the average.
double gain_of(const FrameRecord& frame, std::size_t by) {
  const std::vector<Complex> response = frame.filter_response();
  std::vector<Complex> whole(response.size() + by - 1);
  for (std::size_t k = 0; k < response.size(); ++k) {
    for (std::size_t m = 0; m < by; ++m) whole[k + m] += response[k] / static_cast<double>(by);
  }
  double power = 0.0;
  for (const Complex& h : whole) power += std::norm(h);
  return std::sqrt(power);
}

void thin(DrivenRecord& record, double longest_s) {
  FrameRecord& frame = record.frame;
  if (frame.w_k != 0.0) longest_s = std::min(longest_s, kThinnedTurn / std::abs(frame.w_k));
  const std::size_t by = std::min(most_averaged(frame.sample_time_s, longest_s),
                                  std::max<std::size_t>(1, (frame.size() - frame.judged_from) / 64));
  record.mean_gain = gain_of(frame, by);
  if (by == 1) return;
  record.thinned = static_cast<int>(by);
  frame.v = averaged(frame.v, by);
  frame.i = averaged(frame.i, by);
  frame.w_r = averaged(frame.w_r, by);
  frame.judged_from = (frame.judged_from + by - 1) / by;
  frame.sample_time_s *= static_cast<double>(by);
  frame.noise_gain = record.mean_gain;
  // Averages over a straight line belong to the middle of their samples.
}

void add_voltage_rate(DrivenRecord& record) {
  const auto& v = record.frame.v;
  const double h = record.frame.sample_time_s;
  record.voltage_rate.resize(v.size());
  for (std::size_t k = 0; k < v.size(); ++k) {
    const std::size_t before = k == 0 ? 0 : k - 1, after = std::min(k + 1, v.size() - 1);
    const Complex slope =
        after == before ? Complex(0.0) : (v[after] - v[before]) / (h * static_cast<double>(after - before));
    record.voltage_rate[k] = slope + Complex(0.0, record.frame.w_k) * v[k];
  }
}

// Slope of a straight line through the samples nearer than kSlope_s.
std::vector<double> slopes(const std::vector<double>& w, double h) {
  const auto reach = static_cast<std::size_t>(std::max(1.0, std::round(kSlope_s / h)));
  std::vector<double> out(w.size(), 0.0);
  for (std::size_t k = 0; k < w.size(); ++k) {
    const std::size_t begin = k < reach ? 0 : k - reach, end = std::min(w.size(), k + reach + 1);
    const auto n = static_cast<double>(end - begin);
    const double middle = 0.5 * static_cast<double>(begin + end - 1);
    double along = 0.0;
    for (std::size_t m = begin; m < end; ++m) along += (static_cast<double>(m) - middle) * (w[m] - w[k]);
    if (n > 1.0) out[k] = along / (h * n * (n * n - 1.0) / 12.0);
  }
  return out;
}

void add_speed_rate(DrivenRecord& record) {
  record.speed_rate = slopes(record.frame.w_r, record.frame.sample_time_s);
  record.speed_bend = slopes(record.speed_rate, record.frame.sample_time_s);
}

void add_rotor_turn(DrivenRecord& record) {
  const FrameRecord& frame = record.frame;
  double angle = 0.0;
  for (std::size_t k = 0; k < frame.size(); ++k) {
    record.rotor_turn.push_back(std::polar(1.0, angle));
    const double next = k + 1 < frame.size() ? frame.w_r[k + 1] : frame.w_r[k];
    angle =
        std::remainder(angle + frame.sample_time_s * (0.5 * (frame.w_r[k] + next) - frame.w_k), 2.0 * kPi);
  }
}

void add_temperature(DrivenRecord& record, const TimeSeries& series) {
  if (series.stator_C.size() != series.size()) return;
  double last = kUnknown_C;
  for (std::size_t k = 0; k < record.size(); ++k) {
    const double here = series.stator_C[record.frame.first + k * static_cast<std::size_t>(record.thinned)];
    if (std::isfinite(here)) last = here;
    record.stator_C.push_back(last);
  }
}

}  // namespace

std::size_t most_averaged(double sample_time_s, double longest_s) {
  return static_cast<std::size_t>(std::max(1.0, std::floor(longest_s / sample_time_s + 1e-9)));
}

Instant DrivenRecord::at(std::size_t k) const {
  Instant out;
  out.w_k = frame.w_k;
  // Averages belong to the middle of their samples.
  const double t = frame.sample_time_s * (static_cast<double>(k) + 0.5 - 0.5 / thinned);
  out.turn = std::polar(1.0, frame.w_k * t);
  out.rotor_turn = rotor_turn[k];
  out.voltage_rate = voltage_rate[k];
  out.sample_time_s = frame.sample_time_s;
  out.current = frame.i[k];
  out.has_current = true;
  out.speed_rate = speed_rate[k];
  out.speed_bend = speed_bend[k];
  out.speed_sigma = speed_sigma;
  if (!stator_C.empty()) out.stator_C = stator_C[k];
  return out;
}

double DrivenRecord::torque_gain() const {
  return frame.filter_s > 0.0 ? std::norm(frame.filter_step().gain) : 1.0;
}

DrivenRecord driven_record(const TimeSeries& series, int pole_pairs, double longest_s) {
  DrivenRecord record;
  record.frame = to_frame(series, pole_pairs);
  thin(record, longest_s);
  straighten(record.frame.v);
  add_voltage_rate(record);
  add_speed_rate(record);
  add_rotor_turn(record);
  add_temperature(record, series);
  return record;
}

}  // namespace imrig::est
