#include "estimators/diagnose/compare_series.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "estimators/diagnose/channel.h"
#include "estimators/model/predict.h"
#include "rig/base/file.h"
#include "rig/base/space_vector.h"

namespace imrig::est {

namespace {

constexpr double kInitialStates = 4.0;  // two complex fluxes, estimated from the current
constexpr std::size_t kOverlaySamples = 1200;
constexpr double kSamplesPerPeriod = 20.0;
constexpr double kShortestStretch_s = 0.05;

double square(double x) { return x * x; }

TimeSeries disturbed(const TimeSeries& series, const Noise& noise, std::mt19937_64& random) {
  std::normal_distribution<double> draw(0.0, 1.0);
  TimeSeries out = series;
  if (!std::isnan(noise.voltage_V)) {
    for (auto& v : out.v) {
      const double alpha = draw(random), beta = draw(random);
      v += noise.voltage_V * SpaceVector(alpha, beta);
    }
  }
  if (!std::isnan(noise.speed_rad_s)) {
    for (auto& w : out.speed_rad_s) w += noise.speed_rad_s * draw(random);
  }
  return out;
}

// Each record draws its own noise, by its values alone: neither its name nor its place in the set matters.
std::uint64_t seed_of(const TimeSeries& series, std::uint64_t seed) {
  const std::size_t bytes = std::min<std::size_t>(64, series.i.size()) * sizeof(SpaceVector);
  return fnv1a64({reinterpret_cast<const char*>(series.i.data()), bytes}, fnv1a64("noise") + seed);
}

// Per sample: what voltage and speed noise do to the prediction, mean square over the draws. So small a
// disturbance passes any effect as it passes the linear machine.
struct PassedNoise {
  double current2 = 0.0;  // of |i|, mean over the samples
  std::vector<double> power2;
  std::vector<double> lines2;  // of the error's lines
};

PassedNoise passed_noise(const MachineParameters<double>& machine, const DataSet& data,
                         const TimeSeries& series, const CompareOptions& options, const LineProbe& probe) {
  PassedNoise out;
  const CurrentPrediction clean = predict_current(machine, data.pole_pairs, series);
  const std::size_t n = clean.predicted.size();
  out.power2.assign(n, 0.0);
  out.lines2.assign(line_kinds().size(), 0.0);
  if (std::isnan(data.noise.voltage_V) && std::isnan(data.noise.speed_rad_s)) return out;
  std::mt19937_64 random(seed_of(series, options.noise_seed));
  const double weight = 1.0 / std::max(1, options.noise_draws);
  for (int draw = 0; draw < options.noise_draws; ++draw) {
    const auto moved = predict_current(machine, data.pole_pairs, disturbed(series, data.noise, random));
    std::vector<std::complex<double>> shifts(n);
    for (std::size_t k = 0; k < n; ++k) {
      const auto shift = moved.predicted[k] - clean.predicted[k];
      shifts[k] = shift;
      out.current2 += weight * std::norm(shift) / static_cast<double>(n);
      out.power2[k] += weight * square(power_W(series.v[clean.first + k], shift));
    }
    const std::vector<double> lines2 = probe.powers(shifts);
    for (std::size_t k = 0; k < lines2.size(); ++k) out.lines2[k] += weight * lines2[k];
  }
  return out;
}

// Of samples begin to end of the prediction; initial_states: real values that were estimated from them.
Channels channels_of(const DataSet& data, const TimeSeries& series, const CurrentPrediction& p,
                     const PassedNoise& passed, std::size_t begin, std::size_t end, double initial_states) {
  Channels out;
  ChannelResult& current = out["current_A"];
  ChannelResult& power = out["input_power_W"];
  current.unit = std::string("A");
  power.unit = std::string("W");
  const double sigma2 = square(data.noise.current_A * p.noise_gain);  // of each component
  for (std::size_t k = begin; k < end; ++k) {
    const auto error = p.measured[k] - p.predicted[k];
    const SpaceVector v = series.v[p.first + k];
    add_value(current, std::norm(error), std::norm(p.measured[k]), 2.0 * sigma2 + passed.current2);
    const double own = square(1.5 * std::abs(v)) * sigma2;
    add_value(power, square(power_W(v, error)), square(power_W(v, p.measured[k])), own + passed.power2[k]);
  }
  // Two real values a sample, one variance for their sum.
  current.chi2 *= 2.0;
  current.dof = 2.0 * static_cast<double>(current.values) - initial_states;
  // Where the voltage passes through zero, power says nothing, and its chi2 is that of the mean.
  power.chi2 = power.error2 / power.noise2 * static_cast<double>(power.values);
  power.dof = static_cast<double>(power.values) - initial_states;
  finish(current);
  finish(power);
  return out;
}

// As many stretches as conditions may differ in, none shorter than two periods or a twentieth of a second.
std::size_t stretch_length(const CurrentPrediction& p, const TimeSeries& series, double f_Hz,
                           std::size_t most) {
  const double shortest_s = std::fmax(kShortestStretch_s, 2.0 / std::abs(f_Hz));
  const auto shortest = static_cast<std::size_t>(std::ceil(shortest_s / series.sample_time_s));
  const std::size_t count =
      std::clamp<std::size_t>(p.measured.size() / std::max<std::size_t>(1, shortest), 1, most);
  return (p.measured.size() + count - 1) / count;
}

Record piece(const Record& record, std::size_t begin, std::size_t end) {
  Record out;
  out.kind = record.kind;
  const TimeSeries& s = record.series;
  const auto cut = [&](const auto& from, auto& to) {
    using Offset = std::ptrdiff_t;
    if (!from.empty())
      to.assign(from.begin() + static_cast<Offset>(begin), from.begin() + static_cast<Offset>(end));
  };
  out.series.sample_time_s = s.sample_time_s;
  cut(s.v, out.series.v);
  cut(s.i, out.series.i);
  cut(s.speed_rad_s, out.series.speed_rad_s);
  cut(s.torque_Nm, out.series.torque_Nm);
  cut(s.stator_C, out.series.stator_C);
  return out;
}

std::vector<Stretch> stretches_of(const ModelPrediction& model, const DataSet& data, const Record& record,
                                  const CurrentPrediction& p, const PassedNoise& passed,
                                  const CompareOptions& options, const ComparedRecord& whole) {
  const TimeSeries& series = record.series;
  const std::size_t all = p.measured.size();
  const std::size_t length = stretch_length(p, series, whole.conditions.f_Hz, options.stretches);
  std::vector<Stretch> out;
  for (std::size_t begin = 0; begin < all; begin += length) {
    const std::size_t end = std::min(all, begin + length);
    Stretch s;
    s.conditions =
        conditions_of(piece(record, p.first + begin, p.first + end), data.pole_pairs, model.machine().R_s);
    if (whole.conditions.f_Hz == 0.0) {  // so short a stretch of DC drifts by chance
      s.conditions.f_Hz = 0.0;
      s.conditions.slip = s.conditions.psi_Wb = kMissing;
    }
    s.time_s = series.sample_time_s * (static_cast<double>(series.first_index) +
                                       static_cast<double>(p.first) + 0.5 * static_cast<double>(begin + end));
    const double share = static_cast<double>(end - begin) / static_cast<double>(all);
    s.channels = channels_of(data, series, p, passed, begin, end, kInitialStates * share);
    std::complex<double> along{};
    double v2 = 0.0;
    for (std::size_t k = begin; k < end; ++k) {
      const SpaceVector v = series.v[p.first + k];
      along += (p.measured[k] - p.predicted[k]) * std::conj(v);
      v2 += std::norm(v);
    }
    const std::complex<double> mean = along / std::sqrt(v2 * static_cast<double>(end - begin));
    s.signed_errors = {{"current_A", "active", mean.real()}, {"current_A", "reactive", -mean.imag()}};
    out.push_back(std::move(s));
  }
  return out;
}

// A steady stretch of measured torque, into a channel.
void add_torque(const TorquePrediction& t, Channels& channels) {
  ChannelResult& channel = channels["torque_Nm"];
  channel.unit = "Nm";
  channel.dof += 1.0;
  add_value(channel, square(t.measured_Nm - t.predicted_Nm), square(t.measured_Nm), square(t.sigma_Nm));
  finish(channel);
}

// The shaft torque, in the record's channels and in those of the stretches that it falls into.
void add_torques(const ModelPrediction& model, const TimeSeries& series, const CurrentPrediction& p,
                 const CompareOptions& options, ComparedRecord& out) {
  const std::size_t length = stretch_length(p, series, out.conditions.f_Hz, options.stretches);
  for (const TorquePrediction& t : model.torque(series)) {
    add_torque(t, out.channels);
    if (t.middle < p.first) continue;
    Stretch& stretch = out.stretches.at(std::min(out.stretches.size() - 1, (t.middle - p.first) / length));
    const bool first = !stretch.channels.contains("torque_Nm");
    if (first) stretch.signed_errors.push_back({"torque_Nm", "", t.measured_Nm - t.predicted_Nm});
    add_torque(t, stretch.channels);
  }
}

std::size_t stride_of(std::size_t samples, double f_Hz, double sample_time_s) {
  const std::size_t all = (samples + kOverlaySamples - 1) / kOverlaySamples;
  if (!(std::abs(f_Hz) > 0.0)) return std::max<std::size_t>(1, all);
  const auto fine =
      static_cast<std::size_t>(std::max(1.0, 1.0 / (kSamplesPerPeriod * std::abs(f_Hz) * sample_time_s)));
  return std::clamp<std::size_t>(all, 1, fine);
}

// The stretch of the given length with the largest error.
std::size_t worst_stretch(const CurrentPrediction& p, std::size_t length) {
  double sum = 0.0, largest = -1.0;
  std::size_t best = 0;
  for (std::size_t k = 0; k < p.measured.size(); ++k) {
    sum += std::norm(p.measured[k] - p.predicted[k]);
    if (k + 1 < length) continue;
    if (sum > largest) {
      largest = sum;
      best = k + 1 - length;
    }
    sum -= std::norm(p.measured[k + 1 - length] - p.predicted[k + 1 - length]);
  }
  return best;
}

Overlay overlay_of(const CurrentPrediction& p, const TimeSeries& series, double f_Hz) {
  Overlay out;
  const std::size_t stride = stride_of(p.measured.size(), f_Hz, series.sample_time_s);
  const std::size_t length = std::min(p.measured.size(), stride * kOverlaySamples);
  const std::size_t begin = worst_stretch(p, length);
  for (std::size_t k = begin; k < begin + length; k += stride) {
    out.t_s.push_back(static_cast<double>(p.first + k) * series.sample_time_s);
    out.measured.push_back(p.measured[k]);
    out.predicted.push_back(p.predicted[k]);
  }
  return out;
}

std::vector<std::complex<double>> errors_of(const CurrentPrediction& p) {
  std::vector<std::complex<double>> out;
  for (std::size_t k = 0; k < p.measured.size(); ++k) out.push_back(p.measured[k] - p.predicted[k]);
  return out;
}

Residual residual_of(const CurrentPrediction& p, const TimeSeries& series) {
  Residual out;
  out.first = p.first;
  const Fundamental v = fundamental_of(series.v, series.sample_time_s);
  const SpaceVector turn =
      std::isnan(v.f_Hz) ? SpaceVector(1.0, 0.0) : std::polar(1.0, -std::arg(v.amplitude));
  for (std::size_t k = 0; k < p.measured.size(); ++k) {
    const auto error = p.measured[k] - p.predicted[k];
    out.current.push_back(error * turn);
    out.power.push_back(power_W(series.v[p.first + k], error));
  }
  return out;
}

double variance_of(const DataSet& data, const CurrentPrediction& p, const PassedNoise& passed) {
  const double known = 2.0 * square(data.noise.current_A * p.noise_gain) + passed.current2;
  if (std::isfinite(known) && known > 0.0) return known;
  double sum = 0.0;
  for (std::size_t k = 0; k < p.measured.size(); ++k) sum += std::norm(p.measured[k] - p.predicted[k]);
  return sum / static_cast<double>(std::max<std::size_t>(1, p.measured.size()));
}

// A held speed that was rounded is off by a constant of the record, which is estimated from it like its
// initial flux: at most half a step, and as likely as rounding makes it. rad/s, mechanical.
double speed_off(const ModelPrediction& model, const TimeSeries& series, const CurrentPrediction& p,
                 double variance, double sigma_rad_s) {
  TimeSeries moved = series;
  for (double& w : moved.speed_rad_s) w += sigma_rad_s;
  const CurrentPrediction q = model.current(moved);
  double along = 0.0, power = 0.5 * variance;
  for (std::size_t k = 0; k < p.measured.size() && k < q.predicted.size(); ++k) {
    const auto shift = q.predicted[k] - p.predicted[k];
    along += (std::conj(shift) * (p.measured[k] - p.predicted[k])).real();
    power += std::norm(shift);
  }
  const double most = std::sqrt(3.0);
  return power > 0.0 ? sigma_rad_s * std::clamp(along / power, -most, most) : 0.0;
}

}  // namespace

Residual compare_series(const ModelPrediction& model, const DataSet& data, const Record& record,
                        const CompareOptions& options, double speed_sigma_rad_s, ComparedRecord& out) {
  const TimeSeries& series = record.series;
  CurrentPrediction p = model.current(series);
  const LineProbe probe(series, p.first, p.measured.size(), out.conditions.f_Hz, data.pole_pairs);
  const PassedNoise passed = passed_noise(model.machine(), data, series, options, probe);
  if (speed_sigma_rad_s > 0.0) {
    TimeSeries mended = series;
    const double off = speed_off(model, series, p, variance_of(data, p, passed), speed_sigma_rad_s);
    for (double& w : mended.speed_rad_s) w += off;
    p = model.current(mended);
  }
  out.channels = channels_of(data, series, p, passed, 0, p.measured.size(), kInitialStates);
  if (!std::isnan(out.channels["current_A"].floor)) out.floor_from = "declared noise";
  out.stretches = stretches_of(model, data, record, p, passed, options, out);
  add_torques(model, series, p, options, out);
  out.lines = probe.lines(errors_of(p), 2.0 * square(data.noise.current_A), passed.lines2);
  out.overlay = overlay_of(p, series, out.conditions.f_Hz);
  return residual_of(p, series);
}

}  // namespace imrig::est
