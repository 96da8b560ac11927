#include "estimators/diagnose/order_spectrum.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <unsupported/Eigen/FFT>

#include "rig/base/space_vector.h"

namespace imrig::est {

namespace {

constexpr double kResolved = 3.0;  // times 1 / T: half the main lobe of a Hann window is 2
constexpr std::size_t kBeside = 12, kBesideFrom = 3;
constexpr std::size_t kShownSteps = 400;
constexpr double kShownOrders = 9.0;  // of the supply's frequency
constexpr double kFalse = 0.01;       // over all lines

// Phase a theta_1 + b theta_r; slip turns with theta_1 - pole_pairs theta_r.
struct Order {
  int a, b, slip;
};
constexpr std::array<Order, 11> kOrders{{{1, 0, 0},
                                         {0, 0, 0},
                                         {-1, 0, 0},
                                         {-5, 0, 0},
                                         {7, 0, 0},
                                         {1, 0, -2},
                                         {1, 0, 2},
                                         {1, -1, 0},
                                         {1, 1, 0},
                                         {1, -2, 0},
                                         {1, 2, 0}}};

double square(double x) { return x * x; }

// Of a number of length 1.
std::complex<double> power_of(std::complex<double> unit, int exponent) {
  if (exponent < 0) unit = std::conj(unit);
  std::complex<double> out(1.0, 0.0);
  for (int rest = std::abs(exponent); rest > 0; rest /= 2) {
    if (rest % 2 == 1) out *= unit;
    unit *= unit;
  }
  return out;
}

// The longest that FFTs take fast: 2^a 3^b 5^c.
std::size_t smooth_length(std::size_t n) {
  for (; n > 1; --n) {
    std::size_t rest = n;
    for (const std::size_t p : {2u, 3u, 5u}) {
      while (rest % p == 0) rest /= p;
    }
    if (rest == 1) break;
  }
  return n;
}

std::vector<double> hann(std::size_t n) {
  std::vector<double> out(n);
  double sum = 0.0;
  for (std::size_t k = 0; k < n; ++k) {
    out[k] = 1.0 - std::cos(2.0 * kPi * (static_cast<double>(k) + 0.5) / static_cast<double>(n));
    sum += out[k];
  }
  for (double& w : out) w /= sum;
  return out;
}

// Windowed spectrum, power of each bin, and the bins' spacing.
struct Spectrum {
  std::vector<double> power;
  double step_Hz = 0.0;
  std::size_t bin(double f_Hz) const {
    const auto n = static_cast<std::ptrdiff_t>(power.size());
    const auto at = static_cast<std::ptrdiff_t>(std::lround(f_Hz / step_Hz)) % n;
    return static_cast<std::size_t>(at < 0 ? at + n : at);
  }
};

Spectrum spectrum_of(const std::vector<std::complex<double>>& error, double sample_time_s) {
  const std::size_t n = smooth_length(error.size());
  const std::vector<double> window = hann(n);
  std::vector<std::complex<double>> signal(n), bins;
  for (std::size_t k = 0; k < n; ++k) signal[k] = window[k] * error[k];
  Eigen::FFT<double> fft;
  fft.fwd(bins, signal);
  Spectrum out;
  out.step_Hz = 1.0 / (sample_time_s * static_cast<double>(n));
  for (const auto& x : bins) out.power.push_back(std::norm(x));
  return out;
}

double median_of(std::vector<double> x) {
  if (x.size() < 3) return kMissing;
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  std::nth_element(x.begin(), middle, x.end());
  return *middle;
}

// Mean power beside a frequency, on its louder side (on the skirt of a strong line the other side is lower);
// from the median, which for |X|^2 of noise, exponential, is ln 2 times the mean. Not below what lies close
// by.
double beside(const Spectrum& spectrum, double f_Hz, const std::vector<double>& lines) {
  std::array<std::vector<double>, 2> sides;
  const std::size_t n = spectrum.power.size(), centre = spectrum.bin(f_Hz);
  for (std::size_t away = kBesideFrom; away <= std::min(kBeside, n / 4); ++away) {
    for (const std::size_t side : {0u, 1u}) {
      const std::size_t at = (centre + (side == 0 ? away : n - away)) % n;
      const bool line = std::any_of(lines.begin(), lines.end(), [&](double f) {
        const std::size_t d = (spectrum.bin(f) + n - at) % n;
        return std::min(d, n - d) < kBesideFrom;
      });
      if (!line) sides[side].push_back(spectrum.power[at]);
    }
  }
  double close = 0.0;  // a line falls off within two bins, a hill does not
  for (const std::size_t away : {2u, 3u})
    close += 0.25 * (spectrum.power[(centre + away) % n] + spectrum.power[(centre + n - away) % n]);
  return std::fmax(close, std::fmax(median_of(sides[0]), median_of(sides[1])) / std::log(2.0));
}

void show(const Spectrum& spectrum, double f_Hz, RecordLines& out) {
  const double half = std::min(0.5 * spectrum.step_Hz * static_cast<double>(spectrum.power.size() - 1),
                               kShownOrders * std::abs(f_Hz));
  const auto bins = static_cast<std::ptrdiff_t>(half / spectrum.step_Hz);
  const std::ptrdiff_t each =
      std::max<std::ptrdiff_t>(1, (2 * bins + 1) / static_cast<std::ptrdiff_t>(kShownSteps) + 1);
  for (std::ptrdiff_t k = -bins; k <= bins; k += each) {
    double largest = -1.0, at = 0.0;
    for (std::ptrdiff_t m = k; m < std::min(k + each, bins + 1); ++m) {
      const double f = static_cast<double>(m) * spectrum.step_Hz, p = spectrum.power[spectrum.bin(f)];
      if (p > largest) largest = p, at = f;
    }
    out.f_Hz.push_back(at);
    out.amplitude_A.push_back(std::sqrt(largest));
  }
}

}  // namespace

const std::vector<LineKind>& line_kinds() {
  static const std::vector<LineKind> kinds{
      {"f", "0", "what all phases share: base parameters, saturation, losses, a common gain"},
      {"0", "f", "direct current: offset of a current sensor or of the supply"},
      {"-f", "2f", "negative sequence: unequal sensor gains, unbalance of supply or winding"},
      {"-5f", "6f", "dead time of the inverter, saturation"},
      {"7f", "6f", "dead time of the inverter, saturation"},
      {"(1-2s)f", "2sf", "an asymmetric rotor: broken bar; a load that swings"},
      {"(1+2s)f", "2sf", "an asymmetric rotor: broken bar; a load that swings"},
      {"f-f_r", "f_r", "once a turn: eccentricity, coupling, encoder"},
      {"f+f_r", "f_r", "once a turn: eccentricity, coupling, encoder"},
      {"f-2f_r", "2f_r", "twice a turn: coupling, ovality"},
      {"f+2f_r", "2f_r", "twice a turn: coupling, ovality"}};
  return kinds;
}

double RecordLine::over_noise() const { return amplitude_A / std::fmax(noise_A, background_A); }

LineProbe::LineProbe(const TimeSeries& series, std::size_t first, std::size_t samples, double f_Hz,
                     int pole_pairs)
    : pole_pairs_(pole_pairs), sample_time_s_(series.sample_time_s), filter_s_(series.voltage_filter_s) {
  const double span_s = static_cast<double>(samples) * sample_time_s_;
  if (!(std::abs(f_Hz) * span_s > 4.0) || samples < 64) return;
  window_ = hann(samples);
  double turned = 0.0;
  for (std::size_t k = 0; k < samples; ++k) {
    back_1_.push_back(std::polar(1.0, -2.0 * kPi * f_Hz * sample_time_s_ * static_cast<double>(k)));
    back_r_.push_back(std::polar(1.0, -turned));
    turned += sample_time_s_ * series.speed_rad_s[first + k];
  }
  const double f_r = turned / (2.0 * kPi * span_s);
  for (const Order& o : kOrders) {
    const double f = o.a * f_Hz + o.b * f_r + o.slip * (f_Hz - pole_pairs * f_r);
    const bool apart = std::none_of(f_Hz_.begin(), f_Hz_.end(),
                                    [&](double other) { return std::abs(f - other) * span_s < kResolved; });
    resolved_.push_back(apart && std::abs(f) < 0.45 / sample_time_s_);
    f_Hz_.push_back(f);
  }
}

std::vector<double> LineProbe::powers(const std::vector<std::complex<double>>& signal) const {
  std::vector<double> out;
  for (std::size_t line = 0; line < f_Hz_.size(); ++line) {
    std::complex<double> sum{};
    const Order& o = kOrders[line];
    for (std::size_t k = 0; resolved_[line] && k < window_.size(); ++k) {
      sum += window_[k] * signal[k] * power_of(back_1_[k], o.a + o.slip) *
             power_of(back_r_[k], o.b - o.slip * pole_pairs_);
    }
    out.push_back(std::norm(sum));
  }
  return out;
}

RecordLines LineProbe::lines(const std::vector<std::complex<double>>& error, double white2,
                             const std::vector<double>& passed2) const {
  RecordLines out;
  if (!useful()) return out;
  const Spectrum spectrum = spectrum_of(error, sample_time_s_);
  const std::vector<double> power = powers(error);
  double window2 = 0.0;
  for (const double w : window_) window2 += w * w;
  for (std::size_t k = 0; k < power.size(); ++k) {
    RecordLine line;
    line.f_Hz = f_Hz_[k];
    if (resolved_[k]) {
      const double passes = 1.0 / (1.0 + square(2.0 * kPi * line.f_Hz * filter_s_));
      line.amplitude_A = std::sqrt(power[k]);
      line.noise_A = std::sqrt(white2 * window2 * passes + passed2[k]);
      line.background_A = std::sqrt(beside(spectrum, line.f_Hz, f_Hz_));
    }
    out.lines.push_back(line);
  }
  show(spectrum, f_Hz_.front(), out);
  return out;
}

OrderSpectrum order_spectrum(const std::vector<std::pair<std::string, const RecordLines*>>& records) {
  OrderSpectrum out;
  std::size_t looked_at = 0;
  bool all_known = true;
  for (const auto& [id, own] : records) {
    for (const RecordLine& line : own->lines) {
      if (std::isnan(line.over_noise())) continue;
      ++looked_at;
      all_known = all_known && !std::isnan(line.noise_A);
    }
  }
  if (looked_at == 0) return out;
  out.noise_known = all_known;
  const double least = std::sqrt(std::log(static_cast<double>(looked_at) / kFalse));
  for (std::size_t k = 0; k < kOrders.size(); ++k) {
    OrderLine line;
    line.kind = line_kinds()[k];
    double amplitude2 = 0.0, over2 = 0.0, largest = -1.0;
    for (const auto& [id, own] : records) {
      if (own->lines.empty()) continue;
      const RecordLine& there = own->lines[k];
      const double over = there.over_noise();
      if (std::isnan(over)) continue;
      ++line.records;
      line.seen += over > least ? 1u : 0u;
      amplitude2 += square(there.amplitude_A);
      over2 += square(over);
      if (over > largest) largest = over, line.worst_record = id, line.worst = there;
    }
    if (line.records > 0) {
      line.amplitude_A = std::sqrt(amplitude2 / static_cast<double>(line.records));
      line.over_noise = std::sqrt(over2 / static_cast<double>(line.records));
    }
    out.lines.push_back(line);
  }
  return out;
}

}  // namespace imrig::est
