#include "plant/rk4_integrator.h"

#include <algorithm>
#include <cmath>

namespace imrig::plant {

// With the gates off diodes hold currents at exactly zero, which takes the currents to the last bit.
Drive::Memory* Rk4Integrator::memory() {
  return drive_.terminals.kind == Terminals::Kind::kInverter ? &memory_ : nullptr;
}

bool Rk4Integrator::settled(const State& x) const {
  const Conditions& at = known_flow_.at;
  return any_known_ && drive_.terminals.kind == known_terminals_.kind && at.dc_link_V == drive_.dc_link_V &&
         at.cycle_s == drive_.cycle_s && std::equal(x.begin(), x.begin() + static_cast<long>(n_), known_.begin());
}

const Drive::Flow& Rk4Integrator::flow(const State& x) {
  const Terminals& now = drive_.terminals;
  if (!settled(x)) {
    drive_.settle(x.data(), memory(), known_flow_);
    std::copy_n(x.begin(), n_, known_.begin());
  } else if (now.v_s == known_terminals_.v_s && now.axis == known_terminals_.axis &&
             drive_.field_V == known_field_V_ && drive_.shaft == known_flow_.at.motion) {
    return known_flow_;
  }
  drive_.answer(x.data(), known_flow_);
  known_terminals_ = now, known_field_V_ = drive_.field_V, any_known_ = true;
  return known_flow_;
}

void Rk4Integrator::stage(const State& x, double h, const State& slope, State& out) {
  for (std::size_t k = 0; k < n_; ++k) at_[k] = x[k] + h * slope[k];
  drive_.derivatives(at_.data(), out.data(), memory());
}

void Rk4Integrator::advance(State& x, double h, bool /*fresh*/) {
  State k1;
  flow(x);
  drive_.rates(x.data(), known_flow_, k1.data());
  step(x, k1, h, 0);
}

bool Rk4Integrator::bends(const State& k1, double h) const {
  const auto apart = [&](std::size_t k) {
    return h / 3.0 * std::abs(k2_[k] - k3_[k]) + h / 6.0 * std::abs(k1[k] - k2_[k] - k3_[k] + k4_[k]);
  };
  return apart(kPsiS) + apart(kPsiS + 1) > kBend_Wb || apart(kSpeed) > kBend_rad_s;
}

void Rk4Integrator::step(State& x, const State& k1, double h, int halvings) {
  stage(x, 0.5 * h, k1, k2_);
  stage(x, 0.5 * h, k2_, k3_);
  stage(x, h, k3_, k4_);
  if (halvings < kMostHalvings && bends(k1, h)) {
    step(x, k1, 0.5 * h, halvings + 1);
    State middle;
    drive_.derivatives(x.data(), middle.data(), memory());
    step(x, middle, 0.5 * h, halvings + 1);
    return;
  }
  for (std::size_t k = 0; k < n_; ++k) x[k] += h / 6.0 * (k1[k] + 2.0 * (k2_[k] + k3_[k]) + k4_[k]);
}

}  // namespace imrig::plant
