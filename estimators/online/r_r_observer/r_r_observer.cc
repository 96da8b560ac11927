#include "estimators/online/r_r_observer/r_r_observer.h"

#include <cmath>

#include "estimators/online/held_voltage.h"
#include "estimators/online/tone.h"
#include "rig/base/error.h"
#include "rig/base/space_vector.h"

namespace imrig::est {

namespace {

constexpr double kForgotten = 12.0;  // time constants of the filter, exp(-12) = 6e-6
constexpr double kPeriods = 2.0;
const double kMostOff = std::log(3.0);  // from the model's R_r
constexpr double kLevel_s = 0.02;  // of the current's level that the hysteresis goes by

void check(const RotorObserverConfig& c) {
  if (c.pole_pairs < 1) throw Error("rotor observer", "pole pairs must be at least 1");
  if (!(c.sample_time_s >= 5e-6 && c.sample_time_s <= 0.01))
    throw Error("rotor observer", "sample time must be 5 us to 10 ms");
  if (!(c.voltage_filter_s >= 0.0 && c.voltage_filter_s <= 1.0))
    throw Error("rotor observer", "voltage filter must be 0 to 1 s");
  if (!(c.circuit.R_s_ohm > 0.0 && c.circuit.L_m_H > 0.0 && c.circuit.R_r_near_ohm > 0.0 &&
        c.circuit.R_c_ohm >= 0.0))
    throw Error("rotor observer", "R_s, L_m and the rough R_r must be above 0, R_c not below");
  if (!(c.least_slip >= 0.0 && c.least_slip < 1.0))
    throw Error("rotor observer", "least slip must be 0 to 1");
  if (!(c.window_s >= 0.01 && c.longest_s >= c.window_s && c.longest_s <= 100.0))
    throw Error("rotor observer", "window must be 0.01 s at least and not above the longest, 100 s");
}

// rms of what is not the mean.
double scatter(double sum, double square, double n) {
  return std::sqrt(std::max(0.0, square / n - sum * sum / (n * n)));
}

}  // namespace

void RotorObserver::Train::take(double at) {
  if (count++ == 0) first = at;
  last = at;
}

RotorObserver::RotorObserver(const RotorObserverConfig& config)
    : config_(config), tracker_(config.k_6_ohm_s, config.settle_s),
      filter_(config.sample_time_s, config.voltage_filter_s) {
  check(config_);
  interrupt(0);
}

void RotorObserver::interrupt(std::int64_t next_index) {
  next_index_ = next_index;
  filter_.restart();
  level_A_ = 0.0;
  along_ = across_ = ZeroCrossings();
  skip_ = static_cast<std::int64_t>(std::ceil(kForgotten * config_.voltage_filter_s / config_.sample_time_s));
  begin();
}

void RotorObserver::begin() {
  sums_ = {};
  phase_.restart();
  first_index_ = next_index_;
}

void RotorObserver::count_crossings(std::complex<double> i) {
  const double I = std::sqrt(std::norm(i));
  level_A_ += level_A_ > 0.0 ? (I - level_A_) * (config_.sample_time_s / kLevel_s) : I;
  along_.set_threshold(ZeroCrossings::kHysteresis * level_A_);
  across_.set_threshold(ZeroCrossings::kHysteresis * level_A_);
  const auto k = static_cast<double>(next_index_);  // goes on over the windows' borders, as the triggers do
  if (along_.take(i.real(), k)) {
    sums_.alpha.take(along_.at());
    sums_.sense -= i.imag();  // a vector that turns from a to b is in -beta when alpha rises
  }
  if (across_.take(i.imag(), k)) {
    sums_.beta.take(across_.at());
    sums_.sense += i.real();
  }
}

bool RotorObserver::whole() const {
  const double periods = std::min(sums_.alpha.periods(), sums_.beta.periods());
  return periods >= kPeriods &&
         static_cast<double>(sums_.samples) * config_.sample_time_s >= config_.window_s;
}

std::optional<RotorEstimate> RotorObserver::take(std::complex<double> v, std::complex<double> i,
                                                 double speed_rad_s) {
  const std::complex<double> i_f = filter_.take(i);
  if (skip_ > 0) {
    --skip_;
    ++next_index_;
    begin();
    return std::nullopt;
  }
  const double V = std::sqrt(std::norm(v)), I = std::sqrt(std::norm(i_f));
  if (V > 0.0 && I > 0.0) phase_.take(v, i_f);
  sums_.V += V;
  sums_.V2 += V * V;
  sums_.I += I;
  sums_.I2 += I * I;
  sums_.speed += std::isnan(speed_rad_s) ? 0.0 : speed_rad_s;
  sums_.speed_known = sums_.speed_known && !std::isnan(speed_rad_s);
  const int before = sums_.alpha.count;
  count_crossings(i_f);
  ++sums_.samples;
  ++next_index_;
  // Windows end with a crossing of alpha: whole periods, so that the phase's recursion sees every angle
  // alike.
  if (sums_.alpha.count > before && whole()) {
    const RotorEstimate out = close();
    begin();
    return out;
  }
  if (static_cast<double>(sums_.samples) * config_.sample_time_s > config_.longest_s) begin();
  return std::nullopt;
}

// For the steady criterion: sigmas from the scatter within the window.
OperatingPoint RotorObserver::point_of(const RotorEstimate& e) const {
  OperatingPoint p;
  const auto n = static_cast<double>(sums_.samples);
  const double noise_V = scatter(sums_.V, sums_.V2, n), noise_A = scatter(sums_.I, sums_.I2, n);
  p.valid = true;
  p.first_index = e.first_index;
  p.last_index = e.last_index;
  p.frequency_Hz = e.frequency_Hz;
  p.voltage_V = e.voltage_V;
  p.current_A = e.current_A;
  p.slip = sums_.speed_known ? e.slip : std::numeric_limits<double>::quiet_NaN();
  p.sigma_voltage_V = noise_V / std::sqrt(n);
  p.sigma_current_A = noise_A / std::sqrt(n);
  // Crossings use the current near its zeros only: about three times the bound that all samples would allow.
  p.sigma_frequency_Hz = 3.0 * frequency_sigma(e.current_A, noise_A, static_cast<std::size_t>(n)) /
                         (2.0 * kPi * config_.sample_time_s);
  p.sigma_slip = std::abs(p.sigma_frequency_Hz / e.frequency_Hz);
  return p;
}

RotorEstimate RotorObserver::close() {
  RotorEstimate e;
  const auto n = static_cast<double>(sums_.samples);
  e.first_index = first_index_;
  e.last_index = next_index_ - 1;
  const double periods = sums_.alpha.periods() + sums_.beta.periods();
  const double samples = (sums_.alpha.last - sums_.alpha.first) + (sums_.beta.last - sums_.beta.first);
  e.frequency_Hz = std::copysign(periods / (samples * config_.sample_time_s), sums_.sense);
  const double w_e = 2.0 * kPi * e.frequency_Hz;
  e.w_s_rad_s = w_e - config_.pole_pairs * sums_.speed / n;
  e.slip = e.w_s_rad_s / w_e;
  e.voltage_V = sums_.V / n;
  e.current_A = sums_.I / n;
  e.phi_rad = w_e > 0.0 ? phase_.phi_rad() : -phase_.phi_rad();
  if (config_.voltage_held) {
    e.phi_rad += std::abs(w_e) * held_lag_s(config_.sample_time_s, config_.behind_filter_s);
    const std::complex<double> I = std::polar(e.current_A, -e.phi_rad) +
                                   ripple_share(e.voltage_V, std::abs(w_e), config_.sample_time_s, config_.circuit.L_l_H);
    e.current_A = std::abs(I);
    e.phi_rad = -std::arg(I);
  }
  const OperatingPoint point = point_of(e);
  const bool steady = steady_.take(point);
  e.sigma_voltage_V = point.sigma_voltage_V;
  e.sigma_current_A = point.sigma_current_A;
  e.sigma_slip = point.sigma_slip;
  RotorCircuit circuit = config_.circuit;
  circuit.current_A = e.current_A;
  if (const auto R_r = tracker_.R_r_ohm(e.w_s_rad_s)) circuit.R_r_near_ohm = *R_r;
  const RotorResistance found =
      rotor_resistance(circuit, e.voltage_V / e.current_A, e.phi_rad, std::abs(w_e), e.slip);
  e.sensitivity = found.sensitivity;
  e.upper_root = found.upper_root;
  e.status = found.status;
  if (found.status == RotorResistanceStatus::kValid &&
      std::abs(std::log(found.R_r_ohm / config_.circuit.R_r_near_ohm)) > kMostOff)
    e.status = RotorResistanceStatus::kImplausible;
  if (std::abs(e.slip) < config_.least_slip) e.status = RotorResistanceStatus::kSlipTooSmall;
  if (!steady) e.status = RotorResistanceStatus::kNotSteady;
  if (!sums_.speed_known) e.status = RotorResistanceStatus::kNoSpeed;
  if (e.status == RotorResistanceStatus::kValid) {
    e.R_r_ohm = found.R_r_ohm;
    tracker_.take(e.R_r_ohm, e.w_s_rad_s, n * config_.sample_time_s);
  }
  if (const auto R_1 = tracker_.R_1_ohm()) e.R_1_ohm = *R_1;
  return e;
}

}  // namespace imrig::est
