#pragma once
// Lines of the current's error at orders of the supply f, the slip s and the shaft's turns f_r, each against
// the noise at that frequency. In the stationary frame, e = i_measured - i_predicted:
//   X = sum w_k e_k exp(-j (a theta_1 + b theta_r)) / sum w_k       w: Hann window
//   theta_1 = 2 pi f t, theta_r = integral of the measured mechanical speed: a line is followed where the
//   speed changes
// Noise: declared current noise, and voltage and speed noise passed through the model, at that frequency; and
// what stands beside the line in the error's own spectrum, since a misfit without lines is no line. A line
// counts as seen where |X|^2 is above both by ln(number of lines looked at / 0.01), 1 % over all of them.
// Lines nearer than 3 / T to one before them in the list cannot be told from it in a record of length T.

#include <complex>
#include <string>
#include <utility>
#include <vector>

#include "rig/data/record.h"

namespace imrig::est {

struct LineKind {
  const char* name;   // signed frequency in the stationary frame
  const char* order;  // as it shows in power, torque and the turning frame
  const char* hint;   // what makes such a line
};
const std::vector<LineKind>& line_kinds();

struct RecordLine {
  double f_Hz = kMissing;          // stationary frame, signed, mean over the record
  double amplitude_A = kMissing;   // NaN where this record cannot resolve it
  double noise_A = kMissing;       // rms of |X| from noise at that frequency; NaN where noise is not known
  double background_A = kMissing;  // rms of |X| beside the line
  double over_noise() const;       // amplitude over the larger of both
};

struct RecordLines {
  std::vector<RecordLine> lines;  // as line_kinds(); empty: no single frequency, or too short
  // The whole spectrum for the eye: largest amplitude in each of at most 400 steps of frequency.
  std::vector<double> f_Hz, amplitude_A;
};

// Lines of one record; made once, asked for the error and for each draw of noise.
class LineProbe {
 public:
  // first: sample of the series that belongs to entry 0 of the signals. pole_pairs > 0.
  LineProbe(const TimeSeries& series, std::size_t first, std::size_t samples, double f_Hz, int pole_pairs);
  bool useful() const { return !f_Hz_.empty(); }
  // |X|^2 of each line.
  std::vector<double> powers(const std::vector<std::complex<double>>& signal) const;
  // white2: variance of |current noise| per sample; passed2: |X|^2 of passed noise per line. NaN: not known.
  RecordLines lines(const std::vector<std::complex<double>>& error, double white2,
                    const std::vector<double>& passed2) const;

 private:
  int pole_pairs_;
  double sample_time_s_, filter_s_;
  std::vector<double> window_;                         // sums to 1
  std::vector<std::complex<double>> back_1_, back_r_;  // exp(-j theta_1), exp(-j theta_r)
  std::vector<double> f_Hz_;                           // of each line
  std::vector<bool> resolved_;
};

// One line over all records.
struct OrderLine {
  LineKind kind;
  std::size_t records = 0, seen = 0;  // resolved in, seen in
  double amplitude_A = kMissing;      // rms over the records
  double over_noise = kMissing;       // likewise, of amplitude over noise
  std::string worst_record;
  RecordLine worst;  // there
};

struct OrderSpectrum {
  std::vector<OrderLine> lines;  // as line_kinds(); empty without a time series that has one frequency
  bool noise_known = false;      // else sizes stand over what lies beside each line
};

OrderSpectrum order_spectrum(const std::vector<std::pair<std::string, const RecordLines*>>& records);

}  // namespace imrig::est
