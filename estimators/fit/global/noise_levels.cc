#include "estimators/fit/global/noise_levels.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "estimators/fit/global/driven_record.h"
#include "rig/base/error.h"

namespace imrig::est {

namespace {

constexpr std::size_t kStretch = 64;
constexpr Eigen::Index kDifferences = kStretch - 2;
constexpr double kLeastOfCurrent = 5e-4;  // no model and no sensor is better; simulations have no noise
constexpr double kLine = 8.0;           // times what noise puts into a line, on average
constexpr double kLeastOfNoise = 1e-5;  // share of second differences that lies at a line, over the mean
constexpr double kMostColour = 3.0;     // beyond that a constant current is not constant

double median(std::vector<double>& x) {
  if (x.empty()) return 0.0;
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  std::nth_element(x.begin(), middle, x.end());
  return *middle;
}

double square(std::complex<double> x) { return 0.5 * std::norm(x); }  // of each component
double square(double x) { return x * x; }

// Harmonics of the supply that are fast enough to look like noise from sample to sample: six pulses a period
// make lines at multiples of six in the frame of the supply.
class Harmonics {
 public:
  // w_T: how far the supply turns in a sample, rad.
  explicit Harmonics(double w_T) {
    for (const int order : {-6, 6, -12, 12, -18, 18}) {
      const double turn = order * w_T, white = std::pow(2.0 - 2.0 * std::cos(turn), 2) / 6.0;
      if (std::abs(turn) > kPi || white < kLeastOfNoise) continue;
      Eigen::VectorXcd line(kDifferences);
      for (Eigen::Index k = 0; k < kDifferences; ++k)
        line[k] = std::polar(1.0, turn * static_cast<double>(k));
      lines_.push_back({std::move(line), white});
    }
  }

  // A line goes when it holds much more of a stretch's second differences than noise would. Returns how much
  // noise goes with those that did, in values.
  double remove(std::vector<std::complex<double>>& d) const {
    Eigen::Map<Eigen::VectorXcd> all(d.data(), kDifferences);
    const double power = all.squaredNorm();
    Eigen::MatrixXcd basis(kDifferences, static_cast<Eigen::Index>(lines_.size()));
    Eigen::Index found = 0;
    double noise = 0.0;
    for (const Line& line : lines_) {
      if (std::norm(line.turning.dot(all)) <= kLine * line.white * power) continue;
      basis.col(found++) = line.turning;
      noise += line.white;
    }
    if (found == 0) return 0.0;
    const Eigen::MatrixXcd used = basis.leftCols(found);
    const Eigen::VectorXcd in_lines = used * used.householderQr().solve(Eigen::VectorXcd(all));
    all -= in_lines;
    return noise;
  }
  double remove(const std::vector<double>&) const { return 0.0; }  // of a speed

 private:
  struct Line {
    Eigen::VectorXcd turning;
    double white;  // mean square of second differences of white noise at this line, over that of all
  };
  std::vector<Line> lines_;
};

// Mean square of second differences over each stretch, divided by six.
template <class X>
void add_stretches(const std::vector<X>& x, const Harmonics& harmonics, std::vector<double>& out) {
  std::vector<X> d(kDifferences);
  for (std::size_t from = 0; from + kStretch <= x.size(); from += kStretch) {
    for (std::size_t k = 0; k < d.size(); ++k) d[k] = x[from + k + 2] - 2.0 * x[from + k + 1] + x[from + k];
    const double gone = harmonics.remove(d);
    double sum = 0.0;
    for (const X& value : d) sum += square(value);
    out.push_back(sum / (6.0 * (static_cast<double>(d.size()) - gone)));
  }
}

// Of averages of `by` neighbours of a constant, lines removed from each stretch: mean square of one sample's
// deviation over each, as if the noise were white.
template <class X>
void add_averages(const std::vector<X>& x, std::size_t by, std::vector<double>& out) {
  const std::size_t length = kStretch * by;
  for (std::size_t from = 0; from + length <= x.size(); from += length) {
    X mean{}, slope{};
    std::vector<X> block(kStretch);
    const double middle = 0.5 * static_cast<double>(kStretch - 1);
    double spread = 0.0;
    for (std::size_t b = 0; b < kStretch; ++b) {
      for (std::size_t m = 0; m < by; ++m) block[b] += x[from + b * by + m];
      block[b] *= 1.0 / static_cast<double>(by);
      const double u = static_cast<double>(b) - middle;
      mean += block[b] * (1.0 / static_cast<double>(kStretch));
      slope += block[b] * u;
      spread += u * u;
    }
    double sum = 0.0;
    for (std::size_t b = 0; b < kStretch; ++b)
      sum += square(block[b] - mean - slope * ((static_cast<double>(b) - middle) / spread));
    out.push_back(sum * static_cast<double>(by) / static_cast<double>(kStretch - 2));
  }
}

// What averages over kThinnedTime_s keep of the noise of constant currents and voltages; 0: no such records.
struct Kept {
  double current_A = 0.0, voltage_V = 0.0;
};
Kept kept_by_averages(const DataSet& data) {
  std::vector<double> current, voltage;
  for (const Record& record : data.records) {
    const TimeSeries& s = record.series;
    if (record.kind != RecordKind::kDc || !(s.sample_time_s > 0.0) || s.v.size() != s.i.size()) continue;
    const std::size_t by = most_averaged(s.sample_time_s, kThinnedTime_s);
    add_averages(s.i, by, current);
    add_averages(s.v, by, voltage);
  }
  return {std::sqrt(median(current)), std::sqrt(median(voltage))};
}

// Median over the records of the current's root mean square.
double typical_current_A(const DataSet& data) {
  std::vector<double> rms;
  for (const Record& record : data.records) {
    double sum = 0.0, n = 0.0;
    for (const SpaceVector& i : record.series.i) {
      if (std::isfinite(std::norm(i))) sum += std::norm(i), n += 1.0;
    }
    if (n > 0.0) rms.push_back(std::sqrt(sum / n));
  }
  return median(rms);
}

double either(double declared, double seen) { return std::isfinite(declared) ? declared : seen; }

}  // namespace

NoiseEstimate noise_levels(const DataSet& data) {
  std::vector<double> current, voltage, speed;
  for (const Record& record : data.records) {
    if (record.kind == RecordKind::kPoints || record.kind == RecordKind::kDc) continue;
    try {
      TimeSeries series = record.series;
      series.voltage_filter_s = 0.0;  // the sensors' own noise, before the matched filter
      const FrameRecord frame = to_frame(series, data.pole_pairs);
      const Harmonics harmonics(frame.w_k * frame.sample_time_s);
      add_stretches(frame.i, harmonics, current);
      add_stretches(frame.v, harmonics, voltage);
      add_stretches(frame.w_r, harmonics, speed);
    } catch (const Error&) {
      continue;  // cannot be fitted either
    }
  }
  NoiseEstimate out;
  out.seen = {std::sqrt(median(current)), std::sqrt(median(voltage)), std::sqrt(median(speed))};
  out.declared = std::isfinite(data.noise.current_A) && data.noise.current_A > 0.0;
  out.levels = {either(data.noise.current_A, out.seen.current_A),
                either(data.noise.voltage_V, out.seen.voltage_V),
                either(data.noise.speed_rad_s * data.pole_pairs, out.seen.speed_rad_s)};
  if (current.empty()) return out;  // steady points alone show no noise
  const double least_A = kLeastOfCurrent * typical_current_A(data);
  const Kept kept = kept_by_averages(data);
  const auto colour_of = [](double averaged, double seen) {
    return averaged > kBelieved * seen && seen > 0.0 ? std::min(kMostColour, averaged / seen) : 1.0;
  };
  out.colour = colour_of(kept.current_A, out.seen.current_A);
  const double current_A = out.colour * out.seen.current_A;
  // What a regulator does to the voltage is no noise: it is coloured no more than the current.
  const double voltage_V =
      std::min(out.colour, colour_of(kept.voltage_V, out.seen.voltage_V)) * out.seen.voltage_V;
  // Filtered data look quiet from sample to sample: less than was declared takes a constant current to
  // believe.
  const bool constant = kept.current_A > 0.0;
  if (out.declared) {
    out.declared_factor = current_A / data.noise.current_A;
    if (!constant) out.declared_factor = std::max(1.0, out.declared_factor);
    if (out.declared_factor > kBelieved || out.declared_factor < 1.0 / kBelieved)
      out.levels.current_A = current_A;
  } else {
    out.levels.current_A = current_A;
  }
  // Ripple of the supply is voltage, and looks like noise: more than was declared is believed where it is the
  // colour that makes it more, or as far as the current's was declared too small; less is.
  const double declared = data.noise.voltage_V;
  const bool quieter = constant && voltage_V * kBelieved < declared;
  const bool coloured = out.colour > 1.0 && out.seen.voltage_V < kBelieved * declared;
  if (!std::isfinite(declared) || quieter || coloured)
    out.levels.voltage_V = voltage_V;
  else if (out.declared_factor > kBelieved)
    out.levels.voltage_V = std::max(declared, std::min(voltage_V, declared * out.declared_factor));
  out.levels.current_A = std::max(out.levels.current_A, least_A);
  return out;
}

}  // namespace imrig::est
