#include "estimators/online/tone.h"

#include <Eigen/Dense>
#include <cmath>

#include "estimators/online/zero_crossings.h"
#include "rig/base/space_vector.h"

namespace imrig::est {

namespace {

using Complex = std::complex<double>;

constexpr std::size_t kRenewed = 512;  // samples after which the rotation starts from an exact angle again
constexpr int kRefinements = 4;
constexpr double kSettled = 1e-9;     // rad per sample: what is left is a thousandth of the last step or less
constexpr double kLargestStep = 0.5;  // of w: further off, the crossings were none

double dirichlet(double x, double n) {
  const double half = 0.5 * x;
  const double below = std::sin(half);
  return std::abs(below) < 1e-12 ? n : std::sin(n * half) / below;
}

struct Moments {
  Complex positive, negative, zero;  // sums of x e^{-jw(k-c)}, x e^{+jw(k-c)}, x
  double energy = 0.0;
};

// Four samples at a time on four rotations, so that no sum waits for another: the passes over a window decide how
// long its estimate takes.
constexpr std::size_t kLanes = 4;

struct Lanes {
  double a[kLanes] = {}, b[kLanes] = {}, d[kLanes] = {}, e[kLanes] = {};  // Re x cos, Im x sin, Re x sin, Im x cos
  double re[kLanes] = {}, im[kLanes] = {}, energy[kLanes] = {};
  double cosine[kLanes], sine[kLanes];
  // Lane l at the angle + l w, w given by its cosine and sine.
  void start(double angle, double w_cosine, double w_sine) {
    cosine[0] = std::cos(angle);
    sine[0] = std::sin(angle);
    for (std::size_t l = 1; l < kLanes; ++l) {
      cosine[l] = cosine[l - 1] * w_cosine - sine[l - 1] * w_sine;
      sine[l] = cosine[l - 1] * w_sine + sine[l - 1] * w_cosine;
    }
  }
  void take(std::size_t l, const Complex& x) {
    a[l] += x.real() * cosine[l];
    b[l] += x.imag() * sine[l];
    d[l] += x.real() * sine[l];
    e[l] += x.imag() * cosine[l];
    re[l] += x.real();
    im[l] += x.imag();
    energy[l] += x.real() * x.real() + x.imag() * x.imag();
  }
  void turn(double step_cosine, double step_sine) {
    for (std::size_t l = 0; l < kLanes; ++l) {
      const double c = cosine[l] * step_cosine - sine[l] * step_sine;
      sine[l] = cosine[l] * step_sine + sine[l] * step_cosine;
      cosine[l] = c;
    }
  }
};

double sum(const double (&x)[kLanes]) { return (x[0] + x[1]) + (x[2] + x[3]); }

Moments moments(std::span<const Complex> x, double w) {
  const double c = 0.5 * (static_cast<double>(x.size()) - 1.0);
  const double w_cosine = std::cos(w), w_sine = std::sin(w);
  const double step_cosine = std::cos(kLanes * w), step_sine = std::sin(kLanes * w);
  Lanes lanes;
  for (std::size_t first = 0; first < x.size(); first += kRenewed) {
    lanes.start(w * (static_cast<double>(first) - c), w_cosine, w_sine);
    const std::size_t end = std::min(first + kRenewed, x.size()), whole = first + (end - first) / kLanes * kLanes;
    for (std::size_t k = first; k < whole; k += kLanes) {
      for (std::size_t l = 0; l < kLanes; ++l) lanes.take(l, x[k + l]);
      lanes.turn(step_cosine, step_sine);
    }
    for (std::size_t k = whole; k < end; ++k) lanes.take(k - whole, x[k]);
  }
  Moments m;
  m.positive = {sum(lanes.a) + sum(lanes.b), sum(lanes.e) - sum(lanes.d)};
  m.negative = {sum(lanes.a) - sum(lanes.b), sum(lanes.e) + sum(lanes.d)};
  m.zero = {sum(lanes.re), sum(lanes.im)};
  m.energy = sum(lanes.energy);
  return m;
}

}  // namespace

Tone fit_tone(std::span<const Complex> x, double w) {
  const auto n = static_cast<double>(x.size());
  const Moments m = moments(x, w);
  const double d1 = dirichlet(w, n), d2 = dirichlet(2.0 * w, n);
  Eigen::Matrix3d gram;
  gram << n, d2, d1, d2, n, d1, d1, d1, n;
  Eigen::Vector3cd sums(m.positive, m.negative, m.zero);
  const Eigen::Matrix3d inverse = gram.inverse();
  const Eigen::Vector3cd fit = inverse * sums;
  const double left = m.energy - fit.dot(sums).real();  // dot conjugates its left side
  return {fit[0], fit[1], fit[2], std::sqrt(std::max(left, 0.0) / n)};
}

std::optional<double> crossing_frequency(std::span<const Complex> x, double amplitude) {
  ZeroCrossings along(ZeroCrossings::kHysteresis * amplitude);
  ZeroCrossings across(ZeroCrossings::kHysteresis * amplitude);
  struct Train {
    double first = 0.0, last = 0.0;
    int count = 0;
    void take(double at) {
      if (count++ == 0) first = at;
      last = at;
    }
    double periods() const { return count > 1 ? count - 1 : 0; }
  } alpha, beta;
  double sense = 0.0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    if (along.take(x[k].real(), static_cast<double>(k))) {
      alpha.take(along.at());
      sense -= x[k].imag();  // a vector that turns from a to b is in -beta when alpha rises
    }
    if (across.take(x[k].imag(), static_cast<double>(k))) {
      beta.take(across.at());
      sense += x[k].real();
    }
  }
  const double periods = alpha.periods() + beta.periods();
  if (periods < 1.0 || std::abs(alpha.count - beta.count) > 1) return std::nullopt;
  const double samples = (alpha.last - alpha.first) + (beta.last - beta.first);
  return std::copysign(2.0 * kPi * periods / samples, sense);
}

std::optional<double> phase_slope_frequency(std::span<const Complex> x, double w) {
  const std::size_t half = x.size() / 2;
  const double apart = static_cast<double>(x.size() - half);  // between the middles of first and last half
  double refined = w;
  for (int i = 0; i < kRefinements; ++i) {
    const Complex first = fit_tone(x.first(half), refined).positive;
    const Complex last = fit_tone(x.last(half), refined).positive;
    const double step = std::arg(last * std::conj(first) * std::polar(1.0, -refined * apart)) / apart;
    refined += step;
    if (std::abs(refined - w) > kLargestStep * std::abs(w)) return std::nullopt;
    if (std::abs(step) < kSettled) break;
  }
  return refined;
}

double frequency_sigma(double amplitude, double noise_rms, std::size_t n) {
  const auto count = static_cast<double>(n);
  return std::sqrt(8.0) * noise_rms / (amplitude * count * std::sqrt(count));
}

}  // namespace imrig::est
