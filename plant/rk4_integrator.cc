#include "plant/rk4_integrator.h"

#include <cmath>
#include <cstring>

namespace imrig::plant {
namespace {

// None of the arrays overlaps another. The rates were stored one by one, and a vector read back from such
// stores waits for them: worth it only with many states.
void line(std::size_t n, const double* __restrict x, double h, const double* __restrict slope,
          double* __restrict to) {
  if (n == kOwn) {
#pragma GCC unroll 9
    for (std::size_t k = 0; k < kOwn; ++k) to[k] = x[k] + h * slope[k];
  } else {
    for (std::size_t k = 0; k < n; ++k) to[k] = x[k] + h * slope[k];
  }
}

void mean(std::size_t n, const double* __restrict k1, const double* __restrict k2,
          const double* __restrict k3, const double* __restrict k4, double sixth, const double* __restrict x,
          double* __restrict to) {
  for (std::size_t k = 0; k < n; ++k) to[k] = x[k] + sixth * (k1[k] + 2.0 * (k2[k] + k3[k]) + k4[k]);
}

// apart(k): what two rates of state k differ by.
template <class Apart>
bool bends(double h, const Apart& apart) {
  const auto of = [&](std::size_t k) { return std::abs(apart(k)); };
  return h * (of(kPsiS) + of(kPsiS + 1)) > Rk4Integrator::kBendStator_Wb ||
         h * (of(kPsiR) + of(kPsiR + 1)) > Rk4Integrator::kBendRotor_Wb ||
         h * of(kSpeed) > Rk4Integrator::kBend_rad_s;
}

}  // namespace

// With the gates off diodes hold currents at exactly zero, which takes the currents to the last bit.
bool Rk4Integrator::followed() const { return drive_.terminals.kind == Terminals::Kind::kInverter; }

bool Rk4Integrator::settled(const State& x) const {
  const Conditions& at = flow_.at;
  return known_ && drive_.terminals.kind == known_terminals_.kind && at.dc_link_V == drive_.dc_link_V &&
         at.cycle_s == drive_.cycle_s && std::memcmp(x.data(), known_x_.data(), n_ * sizeof(double)) == 0;
}

const Drive::Flow& Rk4Integrator::flow(const State& x) {
  const Terminals& now = drive_.terminals;
  const bool anew = !settled(x);
  if (anew) {
    drive_.settle(x.data(), followed() ? &memory_.magnetics : nullptr, flow_);
    std::memcpy(known_x_.data(), x.data(), n_ * sizeof(double));
    known_ = true;
  }
  if (anew || drive_.field_V != known_field_V_ || drive_.shaft != flow_.at.motion) {
    drive_.turn(x.data(), flow_);
    known_field_V_ = drive_.field_V;
  }
  if (anew || now.v_s != known_terminals_.v_s || now.axis != known_terminals_.axis) {
    drive_.connect(x.data(), flow_);
    known_terminals_ = now;
  }
  return flow_;
}

void Rk4Integrator::derivatives(const State& x, State& dx) {
  if (followed()) {
    drive_.derivatives(x.data(), dx.data(), memory_);
  } else {
    drive_.derivatives(x.data(), dx.data());
  }
}

void Rk4Integrator::stage(const State& x, double h, const State& slope, State& out) {
  line(n_, x.data(), h, slope.data(), at_.data());
  derivatives(at_, out);
}

void Rk4Integrator::advance(State& x, double h, bool /*fresh*/) {
  State k1;
  memory_.held = slow_.data();
  if (settled(x)) {
    flow(x);
    drive_.rates(x.data(), flow_, k1.data(), slow_.data());
  } else {
    derivatives(x, k1);
  }
  known_ = false;
  if (h <= short_s_ && followed()) return midpoint(x, k1, h);
  step(x, k1, h, 0);
}

// Whether the step may stand: the rates that make it are then in k2_, k3_, k4_.
bool Rk4Integrator::smooth(const State& x, const State& k1, double h, bool must) {
  memory_.held = nullptr;
  stage(x, 0.5 * h, k1, k2_);
  memory_.held = k2_.data();
  stage(x, 0.5 * h, k2_, k3_);
  if (!must && bends(h / 3.0, [&](std::size_t k) { return k2_[k] - k3_[k]; })) return false;
  stage(x, h, k3_, k4_);
  if (must) return true;
  return !bends(h / 6.0, [&](std::size_t k) { return k1[k] - k2_[k] - k3_[k] + k4_[k]; });
}

// A stretch between two switching instants so short that the midpoint's rate is enough.
void Rk4Integrator::midpoint(State& x, const State& k1, double h) {
  memory_.held = slow_.data();
  stage(x, 0.5 * h, k1, k2_);
  line(n_, x.data(), h, k2_.data(), at_.data());
  std::memcpy(x.data(), at_.data(), n_ * sizeof(double));
}

void Rk4Integrator::step(State& x, const State& k1, double h, int halvings) {
  if (!smooth(x, k1, h, halvings == kMostHalvings)) {
    step(x, k1, 0.5 * h, halvings + 1);
    State middle;
    memory_.held = slow_.data();
    derivatives(x, middle);
    step(x, middle, 0.5 * h, halvings + 1);
    return;
  }
  mean(n_, k1.data(), k2_.data(), k3_.data(), k4_.data(), h / 6.0, x.data(), at_.data());
  for (const auto& slot : drive_.effects().slow()) {
    const std::size_t first = kOwn + slot.offset;
    for (std::size_t k = first; k < first + slot.effect->states(); ++k) {
      at_[k] = x[k] + h * k2_[k];
      slow_[k] = k2_[k];
    }
  }
  std::memcpy(x.data(), at_.data(), n_ * sizeof(double));
}

}  // namespace imrig::plant
