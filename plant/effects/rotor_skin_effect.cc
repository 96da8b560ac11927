#include "plant/effects/rotor_skin_effect.h"

#include <algorithm>

namespace imrig::plant {

double RotorSkinEffect::fastest_rate_per_s() const {
  if (!hooks()) return 0.0;
  // Largest eigenvalue of a positive matrix by power iteration, with the bar's current held.
  std::array<double, kLayers> x{1.0, 1.0, 1.0, 1.0};
  double rate = 0.0;
  for (int round = 0; round < 100; ++round) {
    std::array<double, kLayers> y{};
    for (std::size_t k = 0; k < kLayers; ++k) {
      for (std::size_t m = 0; m < kLayers; ++m) {
        for (std::size_t j = std::max(k, m); j < kLayers; ++j) y[k] += kSeries[j] * x[m];
      }
      y[k] /= inductance(static_cast<int>(k)) * tau_s_;
    }
    rate = *std::max_element(y.begin(), y.end());
    for (std::size_t k = 0; k < kLayers; ++k) x[k] = y[k] / rate;
  }
  return rate;
}

void RotorSkinEffect::initial(double* own) const { std::fill(own, own + states(), 0.0); }

// i_{k+1} = i - sum is known from the states but for i itself, whose part is a plain resistance.
void RotorSkinEffect::rotor_drop(const Conditions& at, const double* own, RotorDrop& drop) const {
  const double R = bar_ohm(at);
  Complex bypassed = 0.0;
  for (int k = 0; k < kLayers; ++k) {
    bypassed += layer(own, k);
    const double ohm = R * kSeries[static_cast<std::size_t>(k)];
    drop.R += ohm;
    drop.v_0 -= ohm * bypassed;
  }
}

void RotorSkinEffect::derivatives(const Conditions& at, const double* own, double* d_own) const {
  std::array<Complex, kLayers> inner;  // current past layer k
  Complex bypassed = 0.0;
  for (int k = 0; k < kLayers; ++k) {
    bypassed += layer(own, k);
    inner[static_cast<std::size_t>(k)] = at.i_bar - bypassed;
  }
  // L_k = R_nominal tau/(4k + 3), k from 0, so that over it the warm R is (4k + 3) R/(R_nominal tau).
  const double warm = at.R.R_r / (at.R_r_nominal * tau_s_), w = at.n_p * at.w_mech;
  Complex volts = 0.0;  // over R, across layer k
  for (int k = kLayers - 1; k >= 0; --k) {
    volts += kSeries[static_cast<std::size_t>(k)] * inner[static_cast<std::size_t>(k)];
    const Complex own_k = layer(own, k), rate = volts * (warm * (4.0 * k + 3.0));
    d_own[2 * k] = rate.real() - w * own_k.imag();
    d_own[2 * k + 1] = rate.imag() + w * own_k.real();
  }
}

// The core counts 1.5 drop.R |i|^2; what really burns is 1.5 R |i_{k+1}|^2 in each resistor.
void RotorSkinEffect::losses(const Conditions& at, const double* own, Losses& heat) const {
  const double R = bar_ohm(at);
  Complex bypassed = 0.0;
  for (int k = 0; k < kLayers; ++k) {
    bypassed += layer(own, k);
    heat.rotor_copper_W += 1.5 * R * kSeries[static_cast<std::size_t>(k)] *
                           (std::norm(at.i_bar - bypassed) - std::norm(at.i_bar));
  }
}

void RotorSkinEffect::energy(const Conditions& at, const double* own, double& stored_J) const {
  for (int k = 0; k < kLayers; ++k) {
    const double L = config_.bar_fraction * at.R_r_nominal * tau_s_ * inductance(k);
    stored_J += 0.75 * L * std::norm(layer(own, k));
  }
}

}  // namespace imrig::plant
