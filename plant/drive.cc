#include "plant/drive.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "rig/base/error.h"
#include "rig/base/space_vector.h"

namespace imrig::plant {
namespace {

using Complex = std::complex<double>;

// j a x without the general complex product and its test for NaN.
Complex turned(double a, Complex x) { return {-a * x.imag(), a * x.real()}; }

double dot(Complex x, Complex y) { return x.real() * y.real() + x.imag() * y.imag(); }

Complex solve(double ss, double st, double ts, double tt, Complex right) {
  const double determinant = ss * tt - st * ts;
  return {(tt * right.real() - st * right.imag()) / determinant,
          (ss * right.imag() - ts * right.real()) / determinant};
}

double stator_leakage(const MachineConfig& machine) { return machine.L_s_H - machine.L_m_H; }

// The machine without the rotor leakage that effects carry in their own states.
MachineConfig without_carried_leakage(const PlantConfig& config) {
  MachineConfig machine = config.machine;
  for (const auto& effect : config.effects) {
    const double carried_H = effect->rotor_leakage_H(config.machine.R_r_ohm);
    machine.L_r_H -= carried_H;
    if (carried_H > 0.0 && machine.L_r_H < config.machine.L_m_H) {
      throw Error(
          "plant " + config.name,
          "effect " + effect->name() + " carries more leakage than the rotor has (L_r - L_m, T circuit)",
          "a shallower bar, or less of the rotor's resistance in it");
    }
  }
  return machine;
}

// The fixed step of order four follows rate x step up to 2.8; the error-controlled one divides the sample.
void check_rates(const PlantConfig& config) {
  const double most = config.integrator.kind == IntegratorConfig::Kind::kRk4 ? 2.5 : 25.0;
  for (const auto& effect : config.effects) {
    const double rate = effect->settling_rate_per_s(config.machine.R_s_ohm, stator_leakage(config.machine));
    if (rate * static_cast<double>(config.sample_time_ns) * 1e-9 <= most) continue;
    throw Error("plant " + config.name, "effect " + effect->name() + " settles faster than the sample time",
                "a shorter sample_time_ns, or slower parameters (a deeper bar)");
  }
}

// On the motor's shaft, positive drives.
double load_Nm(const Conditions& at) {
  return at.coupling.rigid ? at.generator_Nm : at.coupling.torque_on_motor_Nm;
}

MagneticLaws magnetic_laws(const PlantConfig& config) {
  MagneticLaws laws;
  for (const auto& effect : config.effects) effect->magnetics(laws);
  return laws;
}

}  // namespace

Drive::Drive(const PlantConfig& config)
    : dc_link_V(config.inverter.dc_link_V),
      cycle_s(static_cast<double>(config.pwm_time_ns) * 1e-9),
      circuit_(without_carried_leakage(config)),
      magnetics_(without_carried_leakage(config), magnetic_laws(config)),
      generator_(config.generator),
      mechanics_(config.mechanics),
      effects_(config.effects),
      base_{config.machine.R_s_ohm, config.machine.R_r_ohm, 0.0},
      sample_s_(static_cast<double>(config.sample_time_ns) * 1e-9),
      per_J_(1.0 / config.mechanics.J_kgm2),
      n_p_(config.machine.pole_pairs),
      L_m_(config.machine.L_m_H),
      L_ls_(stator_leakage(config.machine)) {
  check_rates(config);
  shape_ = Shape::kUsual;
  if (!effects_.currents().empty() || !effects_.shunt().empty() || !effects_.coupling().empty()) {
    shape_ = Shape::kAny;
  } else if (magnetics_.linear() && effects_.states() == 0 && effects_.temperatures().empty() &&
             effects_.resistances().empty() && effects_.rotor_drop().empty() &&
             effects_.applied_voltage().empty()) {
    shape_ = Shape::kBare;
  }
  for (const auto& effect : config.effects) break_away_Nm_ += effect->break_away_Nm();
  if (!magnetics_.linear() &&
      magnetics_.fastest_rate(base_.R_s, base_.R_r) * static_cast<double>(config.sample_time_ns) * 1e-9 >
          1.0) {
    throw Error("plant " + config.name, "the saturated motor settles faster than the sample time",
                "a shorter sample_time_ns or a higher saturated ratio");
  }
  if (!effects_.shunt().empty() && !(L_ls_ > 0.0)) {
    throw Error("plant " + config.name, "shorted turns need leakage of the stator",
                "L_s_H above L_m_H in the T circuit, or circuit = \"inverse-gamma\"");
  }
  if (size() > kMaxStates)
    throw Error("plant " + config.name, "its effects have more states than the plant can carry");
}

State Drive::initial() const {
  State x{};
  if (mechanics_.held_speed_rpm) x[kSpeed] = rad_s_of_rpm(*mechanics_.held_speed_rpm);
  for (const auto& slot : effects_.with_states()) slot.effect->initial(&x[kOwn + slot.offset]);
  return x;
}

template <Drive::Shape kShape>
void Drive::set_currents(const double* own, MagneticCircuit::Known* near, Conditions& at) const {
  if (magnetics_.linear()) {
    at.i = circuit_.currents(at.psi_s, at.psi_r);
  } else {
    at.i = near ? magnetics_.follow(at.psi_s, at.psi_r, *near).i : magnetics_.solve(at.psi_s, at.psi_r).i;
  }
  if constexpr (kShape != Shape::kAny) return;
  for (const auto& slot : effects_.currents()) slot.effect->currents(at, own + slot.offset, at.i);
  for (const auto& slot : effects_.shunt()) {
    Shunt branch;
    slot.effect->shunt(at, own + slot.offset, branch);
    at.i.s += branch.i;
  }
}

Currents Drive::currents(const Conditions& at, const double* own) const {
  Conditions there = at;
  set_currents<Shape::kAny>(own, nullptr, there);
  return there.i;
}

// Currents through the bars and, where there is iron loss, through a conductance G across the rotor's flux
// linkage, all of which link psi_r:
//   i_r = i_bar - G e,   e = d psi_r/dt = j w psi_r - (R i_bar + R_conj conj(i_bar) + v_0).
template <Drive::Shape kShape>
void Drive::rotor_flow(Conditions& at, const double* own) const {
  at.drop = {at.R.R_r, 0.0, 0.0};
  if constexpr (kShape != Shape::kBare)
    for (const auto& slot : effects_.rotor_drop()) slot.effect->rotor_drop(at, own + slot.offset, at.drop);
  const RotorDrop& drop = at.drop;
  const double G = at.R.G_iron;
  const Complex motion = turned(n_p_ * at.w_mech, at.psi_r) - drop.v_0;
  if (G == 0.0) {
    at.i_bar = at.i.r;
  } else if (drop.R_conj == 0.0) {
    at.i_bar = (at.i.r + G * motion) * (1.0 / (1.0 + drop.R * G));
  } else {  // i_bar + G (R i_bar + R_conj conj(i_bar)) = i_r + G motion, as two real equations
    const double a = drop.R_conj.real(), b = drop.R_conj.imag();
    at.i_bar = solve(1.0 + G * (drop.R + a), G * b, G * b, 1.0 + G * (drop.R - a), at.i.r + G * motion);
  }
  at.dpsi_r = motion - drop.R * at.i_bar;
  if (drop.R_conj != 0.0) at.dpsi_r -= drop.R_conj * std::conj(at.i_bar);
  at.torque_Nm = -1.5 * n_p_ * (at.psi_r.real() * at.i_bar.imag() - at.psi_r.imag() * at.i_bar.real());
}

Losses Drive::losses(const Conditions& at, const double* own) const {
  Losses heat;
  const Complex i_s = at.i.s - at.shunt.i;
  heat.stator_copper_W =
      1.5 * (at.R.R_s * std::norm(i_s) + (at.R.R_s_conj * std::conj(i_s) * std::conj(i_s)).real());
  heat.rotor_copper_W = 1.5 * (at.drop.R * std::norm(at.i_bar) +
                               (at.drop.R_conj * std::conj(at.i_bar) * std::conj(at.i_bar)).real());
  heat.iron_W = 1.5 * at.R.G_iron * std::norm(at.dpsi_r);
  heat.friction_W = at.drag_Nm * at.w_mech;
  for (const auto& slot : effects_.losses()) slot.effect->losses(at, own + slot.offset, heat);
  return heat;
}

// How the stator's current answers its fluxes: known of the magnetic circuit, else, where an effect bends the
// currents behind it, by central differences around the point.
Drive::Sensitivity Drive::sensitivity(const Conditions& at, const double* own) const {
  if (effects_.currents().empty() && magnetics_.linear()) {
    const double g = 1.0 / circuit_.transient_inductance();
    return {g, 0.0, 0.0, g, -g * circuit_.coupling() * at.dpsi_r};
  }
  if (effects_.currents().empty()) {
    const auto [ss, sr, rr] = magnetics_.incremental(at.psi_s, at.psi_r);
    const double x = at.dpsi_r.real(), y = at.dpsi_r.imag();
    return {ss.xx, ss.xy, ss.yx, ss.yy, {sr.xx * x + sr.xy * y, sr.yx * x + sr.yy * y}};
  }
  const auto slope = [&](Complex d_psi_s, Complex d_psi_r, double unit) {
    Conditions up = at, down = at;
    up.psi_s += d_psi_s, down.psi_s -= d_psi_s;
    up.psi_r += d_psi_r, down.psi_r -= d_psi_r;
    return (currents(up, own).s - currents(down, own).s) / (2.0 * unit);
  };
  const double step = 1e-5;  // Wb
  const double speed = std::abs(at.dpsi_r);
  const Complex s = slope({step, 0.0}, 0.0, step), t = slope({0.0, step}, 0.0, step);
  const Complex along = speed > 0.0 ? slope(0.0, at.dpsi_r * (step / speed), step / speed) : Complex(0.0);
  return {s.real(), t.real(), s.imag(), t.imag(), along};
}

// The voltage at which the current at the terminals does not change; with a branch beside the winding that
// current is the sum of both.
Complex Drive::holding_voltage(const Conditions& at, const double* own) const {
  const Sensitivity d = sensitivity(at, own);
  const Complex drop = stator_drop(at);
  if (effects_.shunt().empty()) return solve(d.ss, d.st, d.ts, d.tt, -d.along) + drop;
  const Shunt& s = at.shunt;
  const Complex from_drop(d.ss * drop.real() + d.st * drop.imag(), d.ts * drop.real() + d.tt * drop.imag());
  return solve(d.ss + s.xx, d.st + s.xy, d.ts + s.xy, d.tt + s.yy, from_drop - d.along - s.rate);
}

// Of the winding, without what is beside it.
Complex Drive::stator_drop(const Conditions& at) const {
  const Complex i = at.i.s - at.shunt.i;
  return at.R.R_s * i + at.R.R_s_conj * std::conj(i);
}

// With the gates off.
[[gnu::noinline]] Complex Drive::diodes_voltage(const Conditions& at, const double* own) const {
  switch (terminals.kind) {
    case Terminals::Kind::kInverter:
    case Terminals::Kind::kClamped:
      return terminals.v_s;
    case Terminals::Kind::kPair: {
      // Only the rate of the current along the axis has to vanish: add to the known rate what its answer
      // along the axis needs.
      const Sensitivity d = sensitivity(at, own);
      const Complex axis = terminals.axis;
      const Shunt& s = at.shunt;
      const auto answer = [&](Complex rate) {
        return dot(axis, {d.ss * rate.real() + d.st * rate.imag(), d.ts * rate.real() + d.tt * rate.imag()});
      };
      const auto beside = [&](Complex v) {
        return dot(axis, {s.xx * v.real() + s.xy * v.imag(), s.xy * v.real() + s.yy * v.imag()});
      };
      const Complex across = terminals.v_s - dot(terminals.v_s, axis) * axis;
      const double known = answer(across - stator_drop(at)) + beside(across) + dot(axis, d.along + s.rate);
      const double along = -known / (answer(axis) + beside(axis));
      return across + along * axis;
    }
    case Terminals::Kind::kOpen:
      return holding_voltage(at, own);
  }
  return 0.0;
}

Drive::Flow Drive::flow(const State& x) const {
  Flow flow;
  settle(x.data(), nullptr, flow);
  turn(x.data(), flow);
  connect(x.data(), flow);
  return flow;
}

// Hooks that nobody overrides are left out where the code is made: a loop that might call, even over nothing,
// sends every quantity through memory.
template <class F>
void Drive::shaped(F&& f) const {
  switch (shape_) {
    case Shape::kBare:
      return f(std::integral_constant<Shape, Shape::kBare>());
    case Shape::kUsual:
      return f(std::integral_constant<Shape, Shape::kUsual>());
    case Shape::kAny:
      return f(std::integral_constant<Shape, Shape::kAny>());
  }
}

template <Drive::Shape kShape>
void Drive::settle_as(const double* x, MagneticCircuit::Known* near, Flow& flow) const {
  Conditions& at = flow.at;
  const double* own = x + kOwn;
  at.n_p = n_p_, at.L_m = L_m_, at.L_ls = L_ls_, at.dc_link_V = dc_link_V, at.cycle_s = cycle_s;
  at.psi_s = {x[kPsiS], x[kPsiS + 1]};
  at.psi_r = {x[kPsiR], x[kPsiR + 1]};
  at.w_mech = x[kSpeed];
  at.angle = x[kAngle];
  at.psi_d = x[kPsiD], at.psi_q = x[kPsiQ], at.psi_f = x[kPsiF];
  at.R_r_nominal = base_.R_r;
  at.R = base_;
  if constexpr (kShape == Shape::kBare) {
    at.i = circuit_.currents(at.psi_s, at.psi_r);
  } else {
    at.temperature = {};
    for (const auto& slot : effects_.temperatures())
      slot.effect->temperatures(at, own + slot.offset, at.temperature);
    set_currents<kShape>(own, near, at);
  }
  if (terminals.kind == Terminals::Kind::kOpen) at.i.s = 0.0;  // what is left is rounding
  if constexpr (kShape != Shape::kBare) {
    for (const auto& slot : effects_.resistances()) slot.effect->resistances(at, own + slot.offset, at.R);
  }
  at.shunt = {};
  if constexpr (kShape == Shape::kAny) {
    for (const auto& slot : effects_.shunt()) slot.effect->shunt(at, own + slot.offset, at.shunt);
  }
  rotor_flow<kShape>(at, own);
}

template <Drive::Shape kShape>
void Drive::turn_as(const double* x, Flow& flow, Motion as) const {
  Conditions& at = flow.at;
  const double* own = x + kOwn;
  at.coupling = {};
  at.coupling.w_generator = at.w_mech;
  if constexpr (kShape == Shape::kAny) {
    for (const auto& slot : effects_.coupling()) slot.effect->coupling(at, own + slot.offset, at.coupling);
  }
  generator_.flow(x[kPsiD], x[kPsiQ], x[kPsiF], at.coupling.w_generator, field_V, flow.generator);
  at.generator_Nm = flow.generator.shaft_Nm;
  at.motion = as;
  double drag_Nm = 0.0;
  for (const auto& slot : effects_.drag()) drag_Nm += slot.effect->drag_Nm(at, own + slot.offset);
  at.drag_Nm = drag_Nm;
  if (as == Motion::kResting) at.drag_Nm = at.torque_Nm + load_Nm(at);  // it holds
}

template <Drive::Shape kShape>
void Drive::connect_as(const double* x, Flow& flow) const {
  Conditions& at = flow.at;
  at.v_s = terminals.v_s;
  if (terminals.kind != Terminals::Kind::kInverter) {
    at.v_s = diodes_voltage(at, x + kOwn);
  } else if constexpr (kShape != Shape::kBare) {
    for (const auto& slot : effects_.applied_voltage())
      slot.effect->applied_voltage(at, x + kOwn + slot.offset, at.v_s);
  }
  const Complex i_s = at.i.s - at.shunt.i;
  flow.dpsi_s = at.v_s - at.R.R_s * i_s;
  if (kShape != Shape::kBare && at.R.R_s_conj != 0.0) flow.dpsi_s -= at.R.R_s_conj * std::conj(i_s);
}

void Drive::settle(const double* x, MagneticCircuit::Known* near, Flow& flow) const {
  shaped([&](auto shape) { settle_as<shape()>(x, near, flow); });
}

void Drive::turn(const double* x, Flow& flow, Motion as) const {
  shaped([&](auto shape) { turn_as<shape()>(x, flow, as); });
}

void Drive::connect(const double* x, Flow& flow) const {
  shaped([&](auto shape) { connect_as<shape()>(x, flow); });
}

double Drive::pull_at_rest_Nm(const State& x, const Flow& now) const {
  Conditions at = now.at;
  at.motion = Motion::kBySpeed;
  double pull_Nm = at.torque_Nm + load_Nm(at);
  for (const auto& slot : effects_.drag()) pull_Nm -= slot.effect->drag_Nm(at, own(x, slot));
  return pull_Nm;
}

// Those of the motor's fluxes: nothing of the shaft enters.
void Drive::flux_rates(const Flow& now, double* __restrict dx) {
  dx[kPsiS] = now.dpsi_s.real(), dx[kPsiS + 1] = now.dpsi_s.imag();
  dx[kPsiR] = now.at.dpsi_r.real(), dx[kPsiR + 1] = now.at.dpsi_r.imag();
}

template <Drive::Shape kShape>
void Drive::other_rates(const double* x, Flow& now, double* __restrict dx, const double* held) const {
  const double torque = now.at.torque_Nm + load_Nm(now.at) - now.at.drag_Nm;
  const bool fixed = shaft_is_held() || shaft == Motion::kResting;
  dx[kSpeed] = fixed ? 0.0 : torque * per_J_;
  dx[kAngle] = now.at.w_mech;
  dx[kPsiD] = now.generator.d_psi_d, dx[kPsiQ] = now.generator.d_psi_q, dx[kPsiF] = now.generator.d_psi_f;
  if constexpr (kShape == Shape::kBare) return;
  const bool asks_slow = !held && !effects_.slow().empty();
  if (asks_slow || effects_.quick_reads_losses()) now.at.losses = losses(now.at, x + kOwn);
  for (const auto& slot : effects_.quick()) {
    slot.effect->derivatives(now.at, x + kOwn + slot.offset, dx + kOwn + slot.offset);
  }
  for (const auto& slot : effects_.slow()) {
    const std::size_t first = kOwn + slot.offset;
    if (asks_slow) {
      slot.effect->derivatives(now.at, x + first, dx + first);
    } else {
      std::copy_n(held + first, slot.effect->states(), dx + first);
    }
  }
}

void Drive::rates(const double* x, Flow& now, double* dx, const double* held) const {
  flux_rates(now, dx);
  shaped([&](auto shape) { other_rates<shape()>(x, now, dx, held); });
}

// The innermost function of the plant: everything it calls is taken into it.
template <Drive::Shape kShape>
[[gnu::flatten]] void Drive::derivatives_as(const double* __restrict x, double* __restrict dx,
                                            Memory& memory) const {
  settle_as<kShape>(x, &memory.magnetics, memory.flow);
  connect_as<kShape>(x, memory.flow);
  flux_rates(memory.flow,
             dx);  // before a hook of the shaft is called: what a call follows goes through memory
  turn_as<kShape>(x, memory.flow, shaft);
  other_rates<kShape>(x, memory.flow, dx, memory.held);
}

void Drive::derivatives(const double* x, double* dx, Memory& memory) const {
  shaped([&](auto shape) { derivatives_as<shape()>(x, dx, memory); });
}

void Drive::derivatives(const double* x, double* dx) const {
  Flow now;
  settle(x, nullptr, now);
  turn(x, now, shaft);
  connect(x, now);
  rates(x, now, dx);
}

Complex Drive::stator_current(const State& x) const {
  Conditions at;
  at.n_p = n_p_, at.L_m = L_m_, at.L_ls = L_ls_;
  at.psi_s = {x[kPsiS], x[kPsiS + 1]};
  at.psi_r = {x[kPsiR], x[kPsiR + 1]};
  at.w_mech = x[kSpeed], at.angle = x[kAngle];
  return currents(at, &x[kOwn]).s;
}

void Drive::set_stator_current(State& x, Complex i_s) const {
  // One step is exact in the linear circuit; Newton's method needs a few where an effect bends it.
  for (int round = 0; round < (effects_.currents().empty() && magnetics_.linear() ? 1 : 8); ++round) {
    Conditions at;
    at.n_p = n_p_, at.L_m = L_m_, at.L_ls = L_ls_;
    at.psi_s = {x[kPsiS], x[kPsiS + 1]};
    at.psi_r = {x[kPsiR], x[kPsiR + 1]};
    at.w_mech = x[kSpeed], at.angle = x[kAngle];
    const Complex error = i_s - currents(at, &x[kOwn]).s;
    const Sensitivity d = sensitivity(at, &x[kOwn]);
    const Complex change = solve(d.ss, d.st, d.ts, d.tt, error);
    x[kPsiS] += change.real(), x[kPsiS + 1] += change.imag();
  }
}

double Drive::magnetic_J(const Conditions& at, const State& x) const {
  // Of the circuit alone: effects that bend its currents, or stand beside it, add their own part.
  const bool alone = effects_.currents().empty() && effects_.shunt().empty();
  const Currents i = alone ? at.i : circuit_.currents(at.psi_s, at.psi_r);
  double stored_J = magnetics_.linear() ? 0.5 * (power_W(at.psi_s, i.s) + power_W(at.psi_r, i.r))
                                        : magnetics_.energy_J(at.psi_s, at.psi_r);
  for (const auto& slot : effects_.energy()) slot.effect->energy(at, own(x, slot), stored_J);
  return stored_J;
}

}  // namespace imrig::plant
