#include "estimators/online/motor_follower.h"

#include <algorithm>
#include <cmath>

#include "rig/base/space_vector.h"

namespace imrig::est {

namespace {

constexpr double kThermocouple_K = 1.0;  // one sigma of what it shows against the winding's mean
constexpr double kAnchor = 0.01;         // relative sigma of R_s by temperature, a second's worth
constexpr double kHeldFlux_Wb = 1.0;     // one sigma of a flux that nothing is known about

JointFilterConfig joint_config(const MotorKnowledge& motor) {
  JointFilterConfig c;
  c.start = motor.base;
  // The doubt covers temperature: both resistances may be 40 % up.
  c.sigma = {0.2, 0.3, 0.0, std::max(0.1, motor.sigma.L_m)};
  c.drift = {0.002, 0.005, 0.0, 0.005};
  c.iron = {motor.saturation, motor.eddy_S, motor.hysteresis_S_rad_s, motor.iron_place};
  return c;
}

// Central difference of ln R_r by a relative or absolute step of one argument.
template <class Of>
double slope(const Of& ln_R, double step) {
  return (ln_R(step) - ln_R(-step)) / (2.0 * step);
}

}  // namespace

MotorFollower::MotorFollower(const FollowerConfig& config)
    : config_(config), joint_(joint_config(config.motor)), standing_(config.motor), model_(config.motor) {
  circuit_ = config_.motor.circuit(config_.motor.base.R_s, config_.motor.R_1_ohm, 2.0 * kPi * 50.0);
}

const Findings& MotorFollower::before(std::int64_t index) const {
  for (std::size_t back = 0; back < kKept; ++back) {
    const Findings& one = kept_[(newest_ + kKept - back) % kKept];
    if (one.next_index <= index) return one;
  }
  return kept_[(newest_ + 1) % kKept];
}

void MotorFollower::take(const SampleBlock& block) {
  for (std::size_t from = 0; from < block.size();) {
    const std::int64_t at = block.first_index + static_cast<std::int64_t>(from);
    const std::size_t n = std::min(block.size() - from, static_cast<std::size_t>(kEvery - at % kEvery));
    work(block.part(from, n));
    from += n;
    if ((at + static_cast<std::int64_t>(n)) % kEvery == 0) keep(at + static_cast<std::int64_t>(n));
  }
}

void MotorFollower::begin(const Chunk& chunk) {
  if (chunk.sample_time_s != sample_time_s_ || chunk.voltage_filter_s != filter_s_) {
    sample_time_s_ = chunk.sample_time_s;
    filter_s_ = chunk.voltage_filter_s;
    RotorObserverConfig c;
    c.pole_pairs = config_.motor.pole_pairs;
    c.sample_time_s = sample_time_s_;
    c.circuit = circuit_;
    c.k_6_ohm_s = config_.motor.k_6_ohm_s;
    c.settle_s = config_.settle_s;
    c.least_slip = config_.least_slip;
    c.behind_filter_s = filter_s_;
    c.voltage_held = config_.voltage_held;
    observer_ = std::make_unique<RotorObserver>(c);
  }
  observer_->interrupt(chunk.first_index);
  standing_.interrupt();
  model_.restart();
  joint_running_ = false;
}

void MotorFollower::work(const SampleBlock& block) {
  if (block.boot_id != boot_id_) {
    boot_id_ = block.boot_id;
    now_ = {};
    kept_ = {};
  }
  const Chunk& c = intake_.take(block);
  if (c.fresh) begin(c);
  const double h = c.sample_time_s;
  const int poles = config_.motor.pole_pairs;
  renew_stator(c.stator_C, c.first_index + static_cast<std::int64_t>(c.n) - 1);
  if (!c.gates_on) return;
  for (std::size_t k = c.cold; k < c.n; ++k) {
    const std::int64_t index = c.first_index + static_cast<std::int64_t>(k);
    const double w_r = poles * c.speed_rad_s[k];
    if (c.at_rest[k]) {
      if (const auto R_s = standing_.take(c.v[k], c.i[k], h, index)) measured_stator(*R_s, index);
    } else if (standing_.kind() != StandingMotor::Kind::kNone) {
      standing_.interrupt();
    }
    if (config_.observe) {
      if (const auto e = observer_->take(c.v[k], c.i[k], c.speed_rad_s[k])) found_rotor(*e);
    }
    if (config_.simulate) model_.take(c.v[k], c.i[k], w_r, c.stator_C, h);
    const bool drive_joint = config_.joint && !std::isnan(w_r) && !c.at_rest[k];
    if (drive_joint) {
      if (!joint_running_) joint_.lose_flux(kHeldFlux_Wb);
      joint_.take(c.v[k], c.i[k], w_r, h);
      joint_index_ = index;
    }
    joint_running_ = drive_joint;
  }
}

void MotorFollower::renew_stator(double stator_C, std::int64_t index) {
  const MotorKnowledge& m = config_.motor;
  stator_C_ = stator_C;
  const bool warm_known = !std::isnan(stator_C);
  const bool measured = now_.R_s_source == StatorSource::kDirect;
  if (warm_known) now_.stator_C = {stator_C, kThermocouple_K, index};
  if (measured && (!warm_known || std::isnan(measured_at_C_))) {
    circuit_.R_s_ohm = now_.R_s_ohm.value;  // as measured; its age shows
    return;
  }
  circuit_.R_s_ohm = level_ * m.R_s_ohm(stator_C);
  const double from_level = measured ? level_sigma_ : m.sigma.R_s;
  now_.R_s_ohm = quantity(circuit_.R_s_ohm, warm_known ? m.base.R_s * m.R_s_per_K * kThermocouple_K : 0.0, from_level, index);
  if (!measured) now_.R_s_source = warm_known ? StatorSource::kThermocouple : StatorSource::kModel;
  if (observer_) observer_->set_circuit(circuit_);
}

void MotorFollower::measured_stator(const StandingMotor::Resistance& found, std::int64_t index) {
  const double R_s = found.ohm;
  const MotorKnowledge& m = config_.motor;
  measured_at_C_ = stator_C_;
  level_ = R_s / m.R_s_ohm(stator_C_);
  level_sigma_ = std::hypot(config_.current_gain_sigma, config_.voltage_gain_sigma, found.relative_sigma);
  now_.R_s_source = StatorSource::kDirect;
  now_.R_s_ohm = quantity(R_s, 0.0, level_sigma_, index);
  if (std::isnan(stator_C_))
    now_.stator_C = {m.stator_C(R_s), std::hypot(level_sigma_, m.sigma.R_s) / m.R_s_per_K, index};
  circuit_.R_s_ohm = R_s;
  observer_->set_circuit(circuit_);
}

void MotorFollower::found_rotor(const RotorEstimate& e) {
  now_.rotor_status = e.status;
  w_e_ = 2.0 * kPi * std::abs(e.frequency_Hz);
  circuit_ = config_.motor.circuit(circuit_.R_s_ohm, config_.motor.R_1_ohm, w_e_);
  observer_->set_circuit(circuit_);
  if (e.status != RotorResistanceStatus::kValid) return;
  const double share = rotor_sigma(e);
  now_.R_r_ohm = quantity(e.R_r_ohm, 0.0, share, e.last_index);
  now_.R_1_ohm = quantity(e.R_1_ohm, std::hypot(share * e.R_r_ohm, config_.motor.k_6_sigma * std::abs(e.w_s_rad_s)),
                          0.0, e.last_index);
}

// Relative, of R_r: gains and noise of V and I, their phase, the slip, and the model's R_s and L_m.
double MotorFollower::rotor_sigma(const RotorEstimate& e) const {
  const double Z = e.voltage_V / e.current_A, w = 2.0 * kPi * std::abs(e.frequency_Hz);
  const auto ln_R = [&](double dZ, double dphi, double dR_s, double dL_m) {
    RotorCircuit c = circuit_;
    c.current_A = e.current_A;
    c.R_s_ohm *= 1.0 + dR_s;
    c.L_m_H *= 1.0 + dL_m;
    c.R_r_near_ohm = e.R_r_ohm;
    return std::log(rotor_resistance(c, Z * (1.0 + dZ), e.phi_rad + dphi, w, e.slip).R_r_ohm);
  };
  constexpr double kStep = 1e-5;
  const double noise_V = e.sigma_voltage_V / e.voltage_V, noise_A = e.sigma_current_A / e.current_A;
  const double gains = std::hypot(config_.current_gain_sigma, config_.voltage_gain_sigma);
  const double noise = std::hypot(noise_V, noise_A);
  const double parts[] = {
      slope([&](double d) { return ln_R(d, 0, 0, 0); }, kStep) * std::hypot(gains, noise),
      slope([&](double d) { return ln_R(0, d, 0, 0); }, kStep) * noise,
      slope([&](double d) { return ln_R(0, 0, d, 0); }, kStep) * now_.R_s_ohm.sigma / now_.R_s_ohm.value,
      slope([&](double d) { return ln_R(0, 0, 0, d); }, kStep) * config_.motor.sigma.L_m, e.sigma_slip / e.slip};
  double square = 0.0;
  for (const double part : parts) square += part * part;
  return std::sqrt(square);
}

void MotorFollower::keep(std::int64_t next_index) {
  now_.next_index = next_index;
  now_.standing = standing_.kind();
  now_.simulated_rms_A = model_.residual_rms_A();
  if (joint_running_ && now_.R_s_source != StatorSource::kModel)
    joint_.anchor_R_s(circuit_.R_s_ohm, kAnchor, static_cast<double>(kEvery) * sample_time_s_);
  if (joint_.started()) {
    const auto value = joint_.parameters(), sigma = joint_.relative_sigma();
    const double gains = std::hypot(config_.current_gain_sigma, config_.voltage_gain_sigma);
    now_.joint_R_r_ohm = quantity(value.R_r, 0.0, std::hypot(sigma.R_r, gains), joint_index_);
    now_.joint_R_s_ohm = quantity(value.R_s, 0.0, std::hypot(sigma.R_s, gains), joint_index_);
    now_.joint_L_m_H = quantity(value.L_m, 0.0, std::hypot(sigma.L_m, gains), joint_index_);
  }
  if (standing_.tones_known()) {
    const auto p = standing_.parameters(), s = standing_.relative_sigma();
    const double values[] = {p.R_s, p.R_r, p.L_l, p.L_m}, sigmas[] = {s.R_s, s.R_r, s.L_l, s.L_m};
    const double gains = std::hypot(config_.current_gain_sigma, config_.voltage_gain_sigma);
    for (std::size_t k = 0; k < 4; ++k)
      now_.standing_parameters[k] = quantity(values[k], 0.0, std::hypot(sigmas[k], gains), standing_.tones_index());
  }
  newest_ = (newest_ + 1) % kKept;
  kept_[newest_] = now_;
}

}  // namespace imrig::est
