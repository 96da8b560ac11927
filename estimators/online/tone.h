#pragma once
// One rotating vector in noise: its frequency and phasor.
//
//   x_k = X+ e^{jw(k-c)} + X- e^{-jw(k-c)} + X0 + noise,   k = 0..N-1,  c = (N-1)/2,  w in rad per sample
//
// Least squares for X+, X-, X0. With the time counted from the window's middle the Gram matrix is real and
// made of Dirichlet sums D(x) = sin(N x/2)/sin(x/2):  <+,+> = N, <+,-> = D(2w), <+,0> = D(w). Frequency:
// phase step of X+ between the window's halves, w += (arg X+_2 - arg X+_1)/(N/2), repeated; its variance is
// 4/3 of the Cramer-Rao bound for one vector in white noise (Kay 1993, section 15). Harmonics -5, 7,
// -11, 13... beat with the fundamental at multiples of 6w and drop out of a window, or half a window, of
// whole sixths of a period.

#include <complex>
#include <optional>
#include <span>

namespace imrig::est {

struct Tone {
  std::complex<double> positive, negative, zero;  // at the window's middle
  double residual_rms = 0.0;                      // of the complex residual
};

// w != 0, |w| < pi, at least 4 samples that span half a period or more.
Tone fit_tone(std::span<const std::complex<double>> x, double w);

// rad per sample, signed by the rotation's sense, from the zero crossings of both components with hysteresis
// around zero; each crossing is where a straight line through the samples between the two thresholds is zero.
// amplitude: rms of |x|. Nothing when there are less than two rising crossings of one component, or the
// two components do not cross equally often.
std::optional<double> crossing_frequency(std::span<const std::complex<double>> x, double amplitude);

// Refines w over the window x. Nothing when it does not settle near w.
std::optional<double> phase_slope_frequency(std::span<const std::complex<double>> x, double w);

// One sigma of that frequency in rad per sample, for a vector of the amplitude in white complex noise of the
// given rms.
double frequency_sigma(double amplitude, double noise_rms, std::size_t n);

}  // namespace imrig::est
