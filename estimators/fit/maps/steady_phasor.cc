#include "estimators/fit/maps/steady_phasor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "rig/data/conditions.h"

namespace imrig::est {

namespace {

using Complex = std::complex<double>;
using Signal = std::vector<Complex>;

constexpr double kSteadyAdmittance = 5e-3;  // relative change between the halves
constexpr double kSteadySpeed = 2e-3;       // of the field's speed
constexpr double kFewestPeriods = 4.0;
constexpr std::size_t kFewestSamples = 64;
constexpr double kRest_rad_s = 0.5;
constexpr double kLastPart = 0.4;   // of a record with a step in it
constexpr double kOneAxis = 0.5;    // |sum i^2| / sum |i|^2: 0 for a turning vector, 1 along one axis
constexpr int kRefinements = 4;
constexpr double kHann = 1.5;       // variance of a Hann-weighted mean over that of a plain one

struct Window {
  std::size_t begin = 0;
  std::size_t end = 0;
  std::size_t size() const { return end > begin ? end - begin : 0; }
};

double hann(std::size_t k, std::size_t n) {
  return 1.0 - std::cos(2.0 * kPi * (static_cast<double>(k) + 0.5) / static_cast<double>(n));
}

// Weighted mean of x exp(-j w t), t counted from the series' first sample; the weights have mean one.
Complex demodulated(const Signal& x, const Window& in, double w, double h) {
  Complex sum = 0.0;
  const Complex turn = std::polar(1.0, -w * h);
  Complex back = std::polar(1.0, -w * h * static_cast<double>(in.begin));
  for (std::size_t k = in.begin; k < in.end; ++k) {
    sum += hann(k - in.begin, in.size()) * x[k] * back;
    back *= turn;
  }
  return sum / static_cast<double>(in.size());
}

double mean(const std::vector<double>& x, const Window& in) {
  double sum = 0.0;
  for (std::size_t k = in.begin; k < in.end; ++k) sum += hann(k - in.begin, in.size()) * x[k];
  return sum / static_cast<double>(in.size());
}

std::array<Window, 2> halves(const Window& in) {
  const std::size_t middle = in.begin + in.size() / 2;
  return {Window{in.begin, middle}, Window{middle, in.end}};
}

// The frequency at which the phase does not move from one half of the window to the other.
std::optional<double> refined(const Signal& x, const Window& in, double w, double h) {
  const auto parts = halves(in);
  const double apart_s = 0.5 * static_cast<double>(in.size()) * h;
  for (int round = 0; round < kRefinements; ++round) {
    const Complex early = demodulated(x, parts[0], w, h), late = demodulated(x, parts[1], w, h);
    if (!(std::abs(early) > 0.0) || !(std::abs(late) > 0.0)) return std::nullopt;
    w += std::arg(late * std::conj(early)) / apart_s;
  }
  const bool whole = std::isfinite(w) && std::abs(w) * h * static_cast<double>(in.size()) > 2.0 * kPi * kFewestPeriods;
  return whole ? std::optional(w) : std::nullopt;
}

Signal part(const Signal& x, const Window& in) {
  return {x.begin() + static_cast<std::ptrdiff_t>(in.begin), x.begin() + static_cast<std::ptrdiff_t>(in.end)};
}

bool finite(const TimeSeries& s, const Window& in) {
  for (std::size_t k = in.begin; k < in.end; ++k) {
    if (!std::isfinite(std::norm(s.v[k]) + std::norm(s.i[k]) + s.speed_rad_s[k])) return false;
  }
  return true;
}

double mean_temperature(const TimeSeries& s, const Window& in) {
  double sum = 0.0;
  std::size_t n = 0;
  for (std::size_t k = in.begin; k < in.end && k < s.stator_C.size(); ++k) {
    if (!std::isfinite(s.stator_C[k])) continue;
    sum += s.stator_C[k];
    ++n;
  }
  return n > 0 ? sum / static_cast<double>(n) : kMissing;
}

// Noise of the mean speed from blocks that are long against the speed's own smoothing.
double mean_speed_sigma(const TimeSeries& s, const Window& in) {
  constexpr std::size_t kBlocks = 8;
  const std::size_t length = in.size() / kBlocks;
  std::array<double, kBlocks> block{};
  double centre = 0.0;
  for (std::size_t b = 0; b < kBlocks; ++b) {
    for (std::size_t k = 0; k < length; ++k)
      block[b] += s.speed_rad_s[in.begin + b * length + k] / static_cast<double>(length);
    centre += block[b] / kBlocks;
  }
  double squares = 0.0;
  for (const double one : block) squares += (one - centre) * (one - centre);
  return std::sqrt(kHann * squares / (kBlocks * (kBlocks - 1.0)));
}

bool usable(const TimeSeries& s) {
  return s.size() >= kFewestSamples && s.v.size() == s.size() && s.speed_rad_s.size() == s.size() &&
         s.sample_time_s > 0.0;
}

// The longest stretch with the gates on.
Window driven(const TimeSeries& s) {
  if (s.gates_on.size() != s.size()) return {0, s.size()};
  Window longest;
  for (std::size_t begin = 0; begin < s.size();) {
    std::size_t end = begin;
    while (end < s.size() && s.gates_on[end] != 0) ++end;
    if (end - begin > longest.size()) longest = {begin, end};
    begin = end + 1;
  }
  return longest;
}

// Where the voltage is stepped: the segment changes inside the record.
std::optional<std::size_t> step_at(const TimeSeries& s, const Window& in) {
  if (s.segment.size() != s.size()) return std::nullopt;
  for (std::size_t k = in.begin + 1; k < in.end; ++k) {
    if (s.segment[k] != s.segment[k - 1]) return k;
  }
  return std::nullopt;
}

SteadyPhasor basic(const DataSet& data, std::size_t record, const Window& in, double w) {
  const TimeSeries& s = data.records[record].series;
  SteadyPhasor p;
  p.record = record;
  p.w_e = std::abs(w);
  p.stator_C = mean_temperature(s, in);
  p.time_s = (static_cast<double>(s.first_index) + 0.5 * static_cast<double>(in.begin + in.end)) * s.sample_time_s;
  p.samples = static_cast<double>(in.size()) / kHann;
  p.w_r = data.pole_pairs * mean(s.speed_rad_s, in) * (w < 0.0 ? -1.0 : 1.0);
  p.slip_sigma = data.pole_pairs * mean_speed_sigma(s, in);
  return p;
}

// From the filtered samples' phasor back to that of the voltage in front of the filter.
Complex before_filter(const TimeSeries& s, double w) {
  const double tau = s.voltage_filter_s, h = s.sample_time_s;
  const bool from_the_rig = s.segment.size() == s.size();  // its inverter's voltage steps on the sample grid
  if (!(tau > 0.0) || !from_the_rig) return Complex(1.0, w * tau);
  const double a = std::exp(-h / tau), theta = w * h;
  const Complex back = std::polar(1.0, -theta);
  const Complex held = (1.0 - a * back) / ((1.0 - a) * back);
  return held * (1.0 - back) / Complex(0.0, theta);
}

// A vector that turns backward is looked at from the other side: conjugate phasors obey the same circuit.
void set_phasors(SteadyPhasor& p, Complex v, Complex i, double w, const TimeSeries& s) {
  v *= before_filter(s, w);
  p.v = w < 0.0 ? std::conj(v) : v;
  p.i = w < 0.0 ? std::conj(i) : i;
}

std::optional<SteadyPhasor> running(const DataSet& data, std::size_t record, const Window& in) {
  const TimeSeries& s = data.records[record].series;
  const double h = s.sample_time_s;
  if (in.size() < kFewestSamples || !finite(s, in)) return std::nullopt;
  const Fundamental rough = fundamental_of(part(s.v, in), h);
  if (!std::isfinite(rough.f_Hz)) return std::nullopt;
  const auto w = refined(s.v, in, 2.0 * kPi * rough.f_Hz, h);
  if (!w) return std::nullopt;
  const auto parts = halves(in);
  const Complex v_early = demodulated(s.v, parts[0], *w, h), v_late = demodulated(s.v, parts[1], *w, h);
  const Complex early = demodulated(s.i, parts[0], *w, h) / v_early, late = demodulated(s.i, parts[1], *w, h) / v_late;
  if (std::abs(v_late - v_early) > kSteadyAdmittance * std::abs(v_late)) return std::nullopt;
  const double moved = data.pole_pairs * (mean(s.speed_rad_s, parts[1]) - mean(s.speed_rad_s, parts[0]));
  if (std::abs(late - early) > kSteadyAdmittance * std::abs(late) || std::abs(moved) > kSteadySpeed * std::abs(*w))
    return std::nullopt;
  SteadyPhasor p = basic(data, record, in, *w);
  set_phasors(p, demodulated(s.v, in, *w, h), demodulated(s.i, in, *w, h), *w, s);
  return p;
}

// Signals along the axis of the current, so that they are real.
Signal along(const Signal& x, Complex axis) {
  Signal out(x.size());
  for (std::size_t k = 0; k < x.size(); ++k) out[k] = (x[k] * std::conj(axis)).real();
  return out;
}

// Frequency of a real sinusoid: x[k+m] + x[k-m] = 2 cos(w m h) x[k], by least squares, m about a tenth of a period
// found by doubling.
std::optional<double> one_axis_frequency(const Signal& x, const Window& in, double h) {
  for (std::size_t m = 1; m < in.size() / 8; m *= 2) {
    double xy = 0.0, xx = 0.0;
    for (std::size_t k = in.begin + m; k + m < in.end; ++k) {
      xy += x[k].real() * 0.5 * (x[k + m].real() + x[k - m].real());
      xx += x[k].real() * x[k].real();
    }
    if (!(xx > 0.0)) return std::nullopt;
    const double c = xy / xx;
    if (c < 0.7) return std::acos(std::clamp(c, -1.0, 1.0)) / (static_cast<double>(m) * h);
  }
  return std::nullopt;
}

}  // namespace

CircuitState circuit_state(const SteadyPhasor& p, double R_s, double L_l, double R_c) {
  const Complex psi = (p.v - R_s * p.i) / Complex(0.0, p.w_e) - L_l * p.i;
  CircuitState c;
  c.psi_r_Wb = std::abs(psi);
  const Complex i = p.i * std::conj(psi) / c.psi_r_Wb;
  c.I_d_A = i.real();
  c.I_q_A = i.imag();
  c.L_m_H = c.psi_r_Wb / c.I_d_A;
  c.R_r_ohm = p.slip_rad_s() * c.psi_r_Wb / (c.I_q_A - p.w_e * c.psi_r_Wb / R_c);
  return c;
}

std::vector<SteadyPhasor> running_phasors(const DataSet& data, std::size_t record) {
  const TimeSeries& s = data.records[record].series;
  std::vector<SteadyPhasor> out;
  if (!usable(s)) return out;
  Window all = driven(s);
  const auto begin_after = static_cast<std::size_t>(8.0 * s.voltage_filter_s / s.sample_time_s);
  all.begin = std::min(all.end, all.begin + begin_after);
  const RecordKind kind = data.records[record].kind;
  const bool whole = kind == RecordKind::kSteady || kind == RecordKind::kNoLoad;
  const auto step = step_at(s, all);
  if (step && !whole) {
    if (const auto p = running(data, record, {all.begin, *step})) out.push_back(*p);
  }
  const auto length = static_cast<std::size_t>((whole ? 1.0 : kLastPart) * static_cast<double>(all.size()));
  if (auto p = running(data, record, {all.end - length, all.end})) {
    p->last = true;
    out.push_back(*p);
  }
  std::erase_if(out, [](const SteadyPhasor& p) { return std::abs(p.w_r) < kRest_rad_s; });
  return out;
}

std::vector<SteadyPhasor> standing_phasors(const DataSet& data, std::size_t record) {
  const TimeSeries& s = data.records[record].series;
  if (!usable(s)) return {};
  Window in = driven(s);
  in.begin += in.size() / 8;  // a switch-on dies away
  if (in.size() < kFewestSamples || !finite(s, in)) return {};
  for (std::size_t k = in.begin; k < in.end; ++k) {
    if (std::abs(s.speed_rad_s[k]) > kRest_rad_s) return {};
  }
  const double h = s.sample_time_s;
  Complex squares = 0.0;
  double norms = 0.0;
  for (std::size_t k = in.begin; k < in.end; ++k) {
    squares += s.i[k] * s.i[k];
    norms += std::norm(s.i[k]);
  }
  const bool one_axis = std::abs(squares) > kOneAxis * norms;
  const Complex axis = one_axis ? std::polar(1.0, 0.5 * std::arg(squares)) : Complex(1.0);
  const Signal i = one_axis ? along(s.i, axis) : s.i;
  const Signal v = one_axis ? along(s.v, axis) : s.v;
  std::optional<double> w;
  if (one_axis) {
    w = one_axis_frequency(i, in, h);
  } else if (const Fundamental rough = fundamental_of(part(s.i, in), h); std::isfinite(rough.f_Hz)) {
    w = 2.0 * kPi * rough.f_Hz;
  }
  if (w) w = refined(i, in, *w, h);
  if (!w) return {};
  SteadyPhasor p = basic(data, record, in, *w);
  const double both = one_axis ? 2.0 : 1.0;
  set_phasors(p, both * demodulated(v, in, *w, h), both * demodulated(i, in, *w, h), *w, s);
  p.w_r = 0.0;
  p.last = true;
  return {p};
}

}  // namespace imrig::est
