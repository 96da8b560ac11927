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
};

PassedNoise passed_noise(const MachineParameters<double>& machine, const DataSet& data,
                         const TimeSeries& series, const CompareOptions& options) {
  PassedNoise out;
  const CurrentPrediction clean = predict_current(machine, data.pole_pairs, series);
  const std::size_t n = clean.predicted.size();
  out.power2.assign(n, 0.0);
  if (std::isnan(data.noise.voltage_V) && std::isnan(data.noise.speed_rad_s)) return out;
  std::mt19937_64 random(seed_of(series, options.noise_seed));
  const double weight = 1.0 / std::max(1, options.noise_draws);
  for (int draw = 0; draw < options.noise_draws; ++draw) {
    const auto moved = predict_current(machine, data.pole_pairs, disturbed(series, data.noise, random));
    for (std::size_t k = 0; k < n; ++k) {
      const auto shift = moved.predicted[k] - clean.predicted[k];
      out.current2 += weight * std::norm(shift) / static_cast<double>(n);
      out.power2[k] += weight * square(power_W(series.v[clean.first + k], shift));
    }
  }
  return out;
}

void add_channels(const DataSet& data, const TimeSeries& series, const CurrentPrediction& p,
                  const PassedNoise& passed, ComparedRecord& out) {
  ChannelResult& current = out.channels["current_A"];
  ChannelResult& power = out.channels["input_power_W"];
  current.unit = std::string("A");
  power.unit = std::string("W");
  const double sigma2 = square(data.noise.current_A * p.noise_gain);  // of each component
  for (std::size_t k = 0; k < p.measured.size(); ++k) {
    const auto error = p.measured[k] - p.predicted[k];
    const SpaceVector v = series.v[p.first + k];
    add_value(current, std::norm(error), std::norm(p.measured[k]), 2.0 * sigma2 + passed.current2);
    const double own = square(1.5 * std::abs(v)) * sigma2;
    add_value(power, square(power_W(v, error)), square(power_W(v, p.measured[k])), own + passed.power2[k]);
  }
  // Two real values a sample, one variance for their sum.
  current.chi2 *= 2.0;
  current.dof = 2.0 * static_cast<double>(current.values) - kInitialStates;
  // Where the voltage passes through zero, power says nothing, and its chi2 is that of the mean.
  power.chi2 = power.error2 / power.noise2 * static_cast<double>(power.values);
  power.dof = static_cast<double>(power.values) - kInitialStates;
  finish(current);
  finish(power);
  if (!std::isnan(current.floor)) out.floor_from = "declared noise";
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

}  // namespace

Residual compare_series(const ModelPrediction& model, const DataSet& data, const Record& record,
                        const CompareOptions& options, ComparedRecord& out) {
  const CurrentPrediction p = model.current(record.series);
  add_channels(data, record.series, p, passed_noise(model.machine(), data, record.series, options), out);
  out.overlay = overlay_of(p, record.series, out.conditions.f_Hz);
  return residual_of(p, record.series);
}

}  // namespace imrig::est
