#include "estimators/online/estimator.h"

#include <algorithm>
#include <cmath>

#include "rig/base/space_vector.h"

namespace imrig::est {

namespace {

OperatingPointConfig point_config(const EstimatorConfig& c) {
  OperatingPointConfig point = c.point;
  point.pole_pairs = c.follower.motor.pole_pairs;
  point.voltage_held = c.follower.voltage_held;
  point.leakage_H = c.follower.motor.base.L_l;
  return point;
}

}  // namespace

Estimator::Estimator(const EstimatorConfig& config, Sink sink)
    : config_(config),
      sink_(std::move(sink)),
      follower_(config.follower),
      model_(config.follower.motor),
      point_(point_config(config), [this](const OperatingPoint& point) {
        closed_ = point;
        has_closed_ = true;
        sink_(estimate(point, true));
      }) {
  behind_.reserve(kPiece);
}

bool Estimator::feed(const SampleBlock& block) {
  std::size_t taken = 0;
  while (taken < block.size()) {
    const std::size_t piece = std::min(block.size() - taken, kPiece), n = feed_piece(block.part(taken, piece), taken == 0);
    taken += n;
    if (n < piece) break;
  }
  return taken > 0;
}

// How many samples were taken. Whatever ends a run of samples does so at a block's first sample: alone it leaves no
// window open that could end within a part. The operating point goes through the whole piece first, since its estimate
// is waited for; an estimate takes from the follower what it found kEvery samples before, so the follower may come
// behind by as much.
std::size_t Estimator::feed_piece(const SampleBlock& piece, bool begins) {
  behind_.clear();
  std::size_t from = 0;
  while (from < piece.size()) {
    const std::int64_t at = piece.first_index + static_cast<std::int64_t>(from);
    std::size_t most = from == 0 && begins ? 1 : std::max<std::size_t>(point_.least_to_end(), 1);
    const std::int64_t silence = told_index_ + longest_ + 1 - at;
    if (silence > 0) most = std::min(most, static_cast<std::size_t>(silence));
    const std::size_t n = std::min(piece.size() - from, most);
    if (!feed_part(piece.part(from, n))) break;
    from += n;
    if (has_closed_ && closed_.steady) behind_.push_back({from, closed_.voltage_zero_V, closed_.current_zero_A});
  }
  std::size_t followed = 0;
  for (const Zero& zero : behind_) {
    if (zero.after > followed) follower_.take(piece.part(followed, zero.after - followed));
    followed = zero.after;
    follower_.suggest_zero(zero.voltage_V, zero.current_A);
  }
  if (from > followed) follower_.take(piece.part(followed, from - followed));
  return from;
}

bool Estimator::feed_part(const SampleBlock& part) {
  has_closed_ = false;
  const std::int64_t ends = part.first_index + static_cast<std::int64_t>(part.size()), read = point_.read_index();
  const bool adjoins = part.boot_id == boot_id_ && part.first_index == read;
  sample_time_s_ = 1e-9 * static_cast<double>(part.sample_time_ns);
  stator_C_ = part.stator_C;
  if (!point_.feed(part)) return false;
  const bool rebooted = part.boot_id != boot_id_;
  if (rebooted) conditions_.clear();
  boot_id_ = part.boot_id;
  if (!adjoins) told_index_ = part.first_index - 1;
  if (!adjoins && !rebooted) missing_ += part.first_index - read;
  longest_ = static_cast<std::int64_t>(kLongest_s / sample_time_s_);
  if (!has_closed_ && ends - 1 - told_index_ >= longest_) sink_(estimate(without_window(part), false));
  return true;
}

OperatingPoint Estimator::without_window(const SampleBlock& last) const {
  OperatingPoint p;
  p.boot_id = last.boot_id;
  p.first_index = told_index_ + 1;
  p.last_index = last.first_index + static_cast<std::int64_t>(last.size()) - 1;
  p.utime = p.last_index * last.sample_time_ns / 1000;
  p.frequency_Hz = p.slip = kUnknown;
  return p;
}

MotorEstimate Estimator::estimate(const OperatingPoint& point, bool window) {
  MotorEstimate out;
  out.point = point;
  out.window = window;
  told_index_ = point.last_index;
  out.sample_time_s = sample_time_s_;
  out.missing_samples = missing_;
  out.findings = follower_.before(point.last_index + 1 - MotorFollower::kEvery);
  out.w_elsewhere_rad_s = config_.w_elsewhere_rad_s;
  if (point.valid) electrical(out);
  rotor(out);
  if (point.valid && !std::isnan(point.slip)) against_model(out);
  return out;
}

void Estimator::electrical(MotorEstimate& out) const {
  const OperatingPoint& p = out.point;
  const FollowerConfig& c = config_.follower;
  const std::int64_t at = p.last_index;
  const double noise_V = p.sigma_voltage_V / p.voltage_V, noise_A = p.sigma_current_A / p.current_A;
  const double share_V = std::hypot(noise_V, c.voltage_gain_sigma), share_A = std::hypot(noise_A, c.current_gain_sigma);
  out.frequency_Hz = {p.frequency_Hz, p.sigma_frequency_Hz, at};
  if (!std::isnan(p.slip)) out.slip = {p.slip, p.sigma_slip, at};
  out.voltage_V = quantity(p.voltage_V, 0.0, share_V, at);
  out.current_A = quantity(p.current_A, 0.0, share_A, at);
  out.phi_rad = {p.phi_rad, std::hypot(noise_V, noise_A), at};
  const double reactive_W = 1.5 * p.voltage_V * p.current_A * std::sin(p.phi_rad);
  out.input_power_W = quantity(p.input_power_W, reactive_W * out.phi_rad.sigma, std::hypot(share_V, share_A), at);

  const double w_e = 2.0 * kPi * std::abs(p.frequency_Hz);
  const Quantity R_s = out.findings.R_s_ohm.known() ? out.findings.R_s_ohm
                                                    : Quantity{c.motor.base.R_s, c.motor.sigma.R_s * c.motor.base.R_s, at};
  const std::complex<double> I = p.current_A, V = std::polar(p.voltage_V, p.phi_rad);
  const std::complex<double> psi_s = (V - R_s.value * I) / std::complex<double>(0.0, w_e);
  const std::complex<double> psi_r = psi_s - c.motor.base.L_l * I;
  const double flux_noise = std::hypot(share_V * p.voltage_V, R_s.sigma * p.current_A) / w_e;
  out.stator_flux_Wb = {std::abs(psi_s), flux_noise, at};
  out.rotor_flux_Wb = {std::abs(psi_r), std::hypot(flux_noise, c.motor.sigma.L_l * c.motor.base.L_l * p.current_A), at};
  // Along the current only: T = (3/2) n_p (P_in - copper)/w_e.
  const double per_W = 1.5 * c.motor.pole_pairs / w_e;
  const double torque = (p.frequency_Hz < 0.0 ? -1.0 : 1.0) * 1.5 * c.motor.pole_pairs * (std::conj(psi_s) * I).imag();
  out.torque_Nm = {torque,
                   per_W * std::hypot(out.input_power_W.sigma / 1.5, R_s.sigma * p.current_A * p.current_A,
                                      2.0 * share_A * R_s.value * p.current_A * p.current_A),
                   at};
}

void Estimator::rotor(MotorEstimate& out) const {
  const MotorKnowledge& m = config_.follower.motor;
  const Quantity& R_1 = out.findings.R_1_ohm;
  if (!R_1.known()) return;
  const auto at_slip = [&](double w_s) {
    return Quantity{R_1.value + m.k_6_ohm_s * w_s, std::hypot(R_1.sigma, m.k_6_sigma * w_s), R_1.last_index};
  };
  out.R_r_elsewhere_ohm = at_slip(std::abs(config_.w_elsewhere_rad_s));
  if (out.slip.known()) out.R_r_here_ohm = at_slip(std::abs(2.0 * kPi * out.point.frequency_Hz * out.point.slip));
  out.rotor_C = {m.rotor_C(R_1.value), std::hypot(R_1.sigma / R_1.value, m.sigma.R_r) / m.R_1_per_K, R_1.last_index};
}

void Estimator::against_model(MotorEstimate& out) {
  const OperatingPoint& p = out.point;
  const MotorKnowledge& m = config_.follower.motor;
  const double w_e = 2.0 * kPi * std::abs(p.frequency_Hz), w_r = w_e * (1.0 - p.slip);
  const auto drawn = model_.current(p.voltage_V, w_e, w_r, stator_C_);
  if (!drawn) return;
  const std::complex<double> measured = std::polar(p.current_A, -p.phi_rad), misfit = (measured - *drawn) / measured;
  // The base circuit's sensitivities carry the parameters' doubts, and the gain and the slip their own.
  const auto base_current = [&](const MachineParameters<double>& q, double speed) {
    return plain(steady_state(q, m.pole_pairs, p.voltage_V, w_e, speed).i_s);
  };
  const std::complex<double> centre = base_current(m.base, w_r);
  double size = 0.0, angle = 0.0;
  const auto add = [&](const std::complex<double>& moved) {
    const std::complex<double> ratio = moved / centre;
    size += std::pow(std::abs(ratio) - 1.0, 2);
    angle += std::pow(std::arg(ratio), 2);
  };
  MachineParameters<double> q = m.base;
  const std::pair<double MachineParameters<double>::*, double> doubts[] = {{&MachineParameters<double>::R_s, m.sigma.R_s},
                                                                          {&MachineParameters<double>::R_r, m.sigma.R_r},
                                                                          {&MachineParameters<double>::L_l, m.sigma.L_l},
                                                                          {&MachineParameters<double>::L_m, m.sigma.L_m}};
  for (const auto& [member, share] : doubts) {
    q.*member *= 1.0 + share;
    add(base_current(q, w_r));
    q.*member = m.base.*member;
  }
  add(base_current(m.base, w_r + w_e * p.sigma_slip));
  size += std::pow(config_.follower.voltage_gain_sigma, 2);
  const double amperes = std::abs(*drawn);
  out.model_current_A = {amperes, amperes * std::sqrt(size), p.last_index};
  out.model_phi_rad = {-std::arg(*drawn), std::sqrt(angle), p.last_index};
  const double doubt = std::sqrt(size + angle + std::pow(out.current_A.sigma / p.current_A, 2));
  out.residual_share = {std::abs(misfit), doubt, p.last_index};
  out.condition = condition_of(p.frequency_Hz, p.voltage_V, w_e * p.slip);
  if (!p.steady) return;
  const auto& cell = conditions_.take(out.condition, misfit, p.last_index);
  out.windows_here = cell.windows;
  out.residual_here = cell.mean();
  out.drift_here = cell.drift();
}

}  // namespace imrig::est
