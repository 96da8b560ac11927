#include "estimators/online/running_model.h"

#include <Eigen/Dense>

#include "estimators/model/effects/registry.h"
#include "estimators/model/steady_state.h"

namespace imrig::est {

namespace {

using State = EffectState<double>;
using Vector = Eigen::Matrix<double, 6, 1>;

constexpr int kRounds = 12;
constexpr double kSettledShare = 1e-9;

std::unique_ptr<EffectMachine<double>> machine_of(const MotorKnowledge& motor) {
  return motor.has_effects ? std::make_unique<EffectMachine<double>>(motor.shared, neutral_local()) : nullptr;
}

State ahead(const State& x, double h, const State& d) {
  return {x.psi_s + scaled(h, d.psi_s), x.psi_r + scaled(h, d.psi_r), x.i_b + scaled(h, d.i_b)};
}

Vector vector_of(const State& x) {
  Vector y;
  y << x.psi_s.re, x.psi_s.im, x.psi_r.re, x.psi_r.im, x.i_b.re, x.i_b.im;
  return y;
}
State state_of(const Vector& y) { return {{y[0], y[1]}, {y[2], y[3]}, {y[4], y[5]}}; }

double measured_or_unknown(double stator_C) { return std::isnan(stator_C) ? kUnknown_C : stator_C; }

}  // namespace

RunningModel::RunningModel(const MotorKnowledge& motor)
    : base_(motor.base), machine_(machine_of(motor)), settle_s_(kSettled * motor.base.L_m / motor.base.R_r) {}

State RunningModel::derivative(const State& x, std::complex<double> v, double w_r) const {
  if (machine_) return machine_->derivative(x, v, w_r, at_);
  const FluxState<double> d = base_.derivative({x.psi_s, x.psi_r}, v, w_r, 0.0);
  return {d.psi_s, d.psi_r, {}};
}

std::complex<double> RunningModel::current(const State& x, std::complex<double> v, double w_r) const {
  return machine_ ? plain(machine_->inside(x, v, w_r, at_).i) : plain(base_.current({x.psi_s, x.psi_r}));
}

void RunningModel::take(std::complex<double> v, std::complex<double> i, double w_r, double stator_C, double h) {
  if (std::isnan(w_r)) w_r = w_r_;  // the encoder has dropped out
  at_.stator_C = measured_or_unknown(stator_C);
  at_.w_k = w_r;  // the iron's frequency, near enough: the frame itself stands, since its speed is left out below
  if (begun_) {
    // The derivative is that of a frame turning with at_.w_k; its turning is taken out again.
    const auto standing = [&](const State& x, std::complex<double> volts, double w) {
      State d = derivative(x, volts, w);
      if (!machine_) return d;
      d.psi_s = d.psi_s + turned(at_.w_k, x.psi_s);
      d.psi_r = d.psi_r + turned(at_.w_k, x.psi_r);
      d.i_b = d.i_b + turned(at_.w_k, x.i_b);
      return d;
    };
    const State first = standing(x_, v_, w_r_), second = standing(ahead(x_, h, first), v, w_r);
    x_ = ahead(ahead(x_, 0.5 * h, first), 0.5 * h, second);
  }
  begun_ = true;
  v_ = v;
  w_r_ = w_r;
  seen_s_ += h;
  const double miss = std::norm(i - current(x_, v, w_r));
  square_ += (miss - square_) * (h / kWindow_s);
}

SteadyModel::SteadyModel(const MotorKnowledge& motor) : motor_(motor), machine_(machine_of(motor)) {}

std::optional<std::complex<double>> SteadyModel::current(double V, double w_e, double w_r, double stator_C) const {
  const SteadyState<double> base = steady_state(motor_.base, motor_.pole_pairs, V, w_e, w_r);
  if (!machine_) return plain(base.i_s);
  Instant at;
  at.w_k = w_e;
  at.stator_C = measured_or_unknown(stator_C);
  const auto derivative = [&](const Vector& y) { return vector_of(machine_->derivative(state_of(y), V, w_r, at)); };
  Vector y = vector_of({base.psi_s, base.psi_r, {}});
  for (int round = 0; round < kRounds; ++round) {
    const Vector miss = derivative(y);
    Eigen::Matrix<double, 6, 6> slope;
    for (int k = 0; k < 6; ++k) {
      Vector moved = y;
      const double step = 1e-6 * (std::abs(y[k]) + 0.01);
      moved[k] += step;
      slope.col(k) = (derivative(moved) - miss) / step;
    }
    for (int k = 4; k < 6; ++k) {
      if (slope.row(k).cwiseAbs().maxCoeff() == 0.0) slope(k, k) = 1.0;  // no deep layer: i_b stays where it is
    }
    const Vector step = slope.partialPivLu().solve(miss);
    y -= step;
    if (!y.allFinite()) return std::nullopt;
    if (step.norm() < kSettledShare * y.norm()) return plain(machine_->inside(state_of(y), V, w_r, at).i);
  }
  return std::nullopt;
}

}  // namespace imrig::est
