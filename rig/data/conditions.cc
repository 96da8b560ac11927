#include "rig/data/conditions.h"

#include <algorithm>
#include <cmath>

namespace imrig {

namespace {

constexpr double kSingleFrequencyShare = 0.5;  // below it, a signal has no one frequency worth naming
constexpr double kLowest_Hz = 0.2;             // below it, it is DC here

double mean(const std::vector<double>& x) {
  double sum = 0.0;
  std::size_t count = 0;
  for (const double value : x) {
    if (std::isnan(value)) continue;
    sum += value;
    ++count;
  }
  return count == 0 ? kMissing : sum / static_cast<double>(count);
}

double rms(const std::vector<SpaceVector>& x) {
  double sum = 0.0;
  for (const auto& value : x) sum += std::norm(value);
  return x.empty() ? kMissing : std::sqrt(sum / static_cast<double>(x.size()));
}

// Mean of x e^{-j w k} over [begin, end).
SpaceVector demodulated(const std::vector<SpaceVector>& x, double w_per_sample, std::size_t begin,
                        std::size_t end) {
  SpaceVector sum{};
  const SpaceVector turn = std::polar(1.0, -w_per_sample);
  SpaceVector phase = std::polar(1.0, -w_per_sample * static_cast<double>(begin));
  for (std::size_t k = begin; k < end; ++k) {
    sum += x[k] * phase;
    phase *= turn;
  }
  return sum / static_cast<double>(std::max<std::size_t>(1, end - begin));
}

// The mean turn per sample is coarse; the drift of the phase between windows ever further apart sharpens it
// without ambiguity.
double turn_per_sample(const std::vector<SpaceVector>& x) {
  SpaceVector sum{};
  for (std::size_t k = 1; k < x.size(); ++k) sum += x[k] * std::conj(x[k - 1]);
  double w = std::arg(sum);
  for (std::size_t window = std::min<std::size_t>(64, x.size() / 2); window >= 8;
       window = std::min(window * 2, x.size() / 2)) {
    SpaceVector drift{};
    for (std::size_t at = 0; at + 2 * window <= x.size(); at += window) {
      drift +=
          demodulated(x, w, at + window, at + 2 * window) * std::conj(demodulated(x, w, at, at + window));
    }
    w += std::arg(drift) / static_cast<double>(window);
    if (window == x.size() / 2) break;
  }
  return w;
}

void add_flux_and_torque(SpaceVector v, SpaceVector i, double w, double R_s, int pole_pairs,
                         Conditions& out) {
  const SpaceVector psi = (v - R_s * i) / SpaceVector(0.0, w);
  out.psi_Wb = std::abs(psi);
  if (std::isnan(out.torque_Nm) && pole_pairs > 0)
    out.torque_Nm = 1.5 * pole_pairs * (std::conj(psi) * i).imag();
}

double slip_of(double speed_rad_s, double f_Hz, int pole_pairs) {
  if (pole_pairs <= 0 || std::abs(f_Hz) < kLowest_Hz) return kMissing;
  return 1.0 - pole_pairs * speed_rad_s / (2.0 * kPi * f_Hz);
}

// Each condition's mean over the points that have it.
Conditions mean_conditions(const std::vector<SteadyPoint>& points, int pole_pairs, double R_s_ohm) {
  std::vector<Conditions> all;
  for (const auto& point : points) all.push_back(conditions_of(point, pole_pairs, R_s_ohm));
  Conditions out;
  for (const auto place :
       {&Conditions::f_Hz, &Conditions::v_V, &Conditions::slip, &Conditions::i_A, &Conditions::psi_Wb,
        &Conditions::torque_Nm, &Conditions::stator_C, &Conditions::speed_rad_s}) {
    std::vector<double> values;
    for (const auto& c : all) values.push_back(c.*place);
    out.*place = mean(values);
  }
  return out;
}

}  // namespace

Fundamental fundamental_of(const std::vector<SpaceVector>& x, double sample_time_s) {
  Fundamental out;
  const double level = rms(x);
  if (x.size() < 16 || !(level > 0.0) || !std::isfinite(level)) return out;
  const double w = turn_per_sample(x);
  out.amplitude = demodulated(x, w, 0, x.size());
  out.share = std::norm(out.amplitude) / (level * level);
  if (out.share >= kSingleFrequencyShare) out.f_Hz = w / (2.0 * kPi * sample_time_s);
  return out;
}

Conditions conditions_of(const Record& record, int pole_pairs, double R_s_ohm) {
  Conditions out;
  if (!record.points.empty()) return mean_conditions(record.points, pole_pairs, R_s_ohm);
  const TimeSeries& series = record.series;
  out.v_V = rms(series.v);
  out.i_A = rms(series.i);
  out.speed_rad_s = mean(series.speed_rad_s);
  out.torque_Nm = mean(series.torque_Nm);
  out.stator_C = mean(series.stator_C);
  const bool no_voltage = series.v.empty() || !(out.v_V > 0.0);
  const Fundamental carrier = fundamental_of(no_voltage ? series.i : series.v, series.sample_time_s);
  out.f_Hz = std::abs(carrier.f_Hz) < kLowest_Hz ? 0.0 : carrier.f_Hz;
  out.slip = slip_of(out.speed_rad_s, out.f_Hz, pole_pairs);
  if (no_voltage || std::isnan(R_s_ohm) || std::isnan(out.f_Hz) || out.f_Hz == 0.0) return out;
  const double w = 2.0 * kPi * out.f_Hz;
  const SpaceVector i = demodulated(series.i, w * series.sample_time_s, 0, series.i.size());
  add_flux_and_torque(carrier.amplitude, i, w, R_s_ohm, pole_pairs, out);
  return out;
}

Conditions conditions_of(const SteadyPoint& point, int pole_pairs, double R_s_ohm) {
  Conditions out;
  out.f_Hz = point.f_Hz;
  out.v_V = point.v_peak_V;
  out.i_A = point.i_peak_A;
  out.speed_rad_s = point.speed_rad_s;
  out.torque_Nm = point.torque_Nm;
  out.stator_C = point.stator_C;
  out.slip = slip_of(point.speed_rad_s, point.f_Hz, pole_pairs);
  double cosine = point.power_factor;
  if (std::isnan(cosine)) cosine = point.p_in_W / (1.5 * point.v_peak_V * point.i_peak_A);
  if (std::isnan(R_s_ohm) || !(std::abs(cosine) <= 1.0) || !(point.f_Hz > kLowest_Hz)) return out;
  const SpaceVector i = std::polar(point.i_peak_A, -std::acos(cosine));  // an induction motor's current lags
  add_flux_and_torque({point.v_peak_V, 0.0}, i, 2.0 * kPi * point.f_Hz, R_s_ohm, pole_pairs, out);
  return out;
}

double dc_resistance_ohm(const DataSet& data) {
  double sum = 0.0;
  int count = 0;
  for (const auto& record : data.records) {
    const TimeSeries& series = record.series;
    if (record.kind != RecordKind::kDc || series.v.empty()) continue;
    SpaceVector vi{};
    double ii = 0.0;
    for (std::size_t k = 0; k < series.size(); ++k) {
      vi += series.v[k] * std::conj(series.i[k]);
      ii += std::norm(series.i[k]);
    }
    if (!(ii > 0.0)) continue;
    sum += vi.real() / ii;
    ++count;
  }
  return count == 0 ? kMissing : sum / count;
}

}  // namespace imrig
