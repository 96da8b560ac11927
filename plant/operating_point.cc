#include "plant/operating_point.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <memory>

#include "plant/drive.h"
#include "plant/matrix2.h"
#include "plant/plant_config.h"
#include "rig/base/error.h"
#include "rig/base/space_vector.h"

namespace imrig::plant {
namespace {

using Complex = std::complex<double>;

constexpr double kStill = 1e-11;          // relative change of the rotor's flux from window to window
constexpr double kWindow_s = 0.1;         // at least, whole periods
constexpr double kTimeConstants = 25.0;   // L_r/R_r, at most
constexpr double kNoRotorCurrent = 1e-4;  // of the stator's: below it the rotor's answer is asked elsewhere
constexpr double kProbeSlip = 5e-3;

// Holds the temperatures whatever the plant's thermal states say.
class HeldTemperatures final : public Effect {
 public:
  explicit HeldTemperatures(const Temperatures& held) : held_(held) {}
  std::string name() const override { return "held_temperatures"; }
  unsigned hooks() const override { return kTemperatures; }
  std::vector<Parameter> parameters() const override { return {}; }
  void temperatures(const Conditions&, const double*, Temperatures& at) const override { at = held_; }

 private:
  Temperatures held_;
};

PlantConfig held(const PlantConfig& config, const PointRequest& request) {
  PlantConfig c = config;
  c.mechanics.locked = true;
  c.mechanics.held_speed_rpm.reset();
  c.generator.coupled = false;
  const Drive start(c);
  Temperatures at = start.flow(start.initial()).at.temperature;
  if (request.stator_C) at.stator_C = *request.stator_C;
  if (request.rotor_C) at.rotor_C = *request.rotor_C;
  c.effects.push_back(std::make_shared<HeldTemperatures>(at));
  return c;
}

// Means over a window; space vectors in the frame of the voltage.
struct Means {
  Complex i_s, i_w, i_r, i_bar, psi_s, psi_r;  // i_w: in the winding, without what is beside it
  double torque_Nm = 0.0, drag_Nm = 0.0, in_W = 0.0, R_s = 0.0, R_bar = 0.0, G_iron = 0.0;
  Losses losses;

  void add(const Conditions& at, const Losses& heat, Complex back, double weight) {
    const Complex f = back * weight;
    i_w += f * (at.i.s - at.shunt.i);
    i_s += f * at.i.s, i_r += f * at.i.r, i_bar += f * at.i_bar, psi_s += f * at.psi_s, psi_r += f * at.psi_r;
    torque_Nm += weight * at.torque_Nm, drag_Nm += weight * at.drag_Nm;
    in_W += weight * power_W(at.v_s, at.i.s);
    R_s += weight * at.R.R_s, R_bar += weight * at.drop.R, G_iron += weight * at.R.G_iron;
    losses.stator_copper_W += weight * heat.stator_copper_W;
    losses.rotor_copper_W += weight * heat.rotor_copper_W;
    losses.iron_W += weight * heat.iron_W, losses.stray_W += weight * heat.stray_W;
    losses.friction_W += weight * heat.friction_W;
  }
};

// The drive on an ideal supply with its shaft held, Runge-Kutta of order four.
class Run {
 public:
  Run(const PlantConfig& config, const PointRequest& request)
      : drive_(held(config, request)),
        x_(drive_.initial()),
        w_(2.0 * kPi * request.f_Hz),
        V_(request.v_V),
        n_p_(config.machine.pole_pairs),
        longest_s_(kTimeConstants * config.machine.L_r_H / config.machine.R_r_ohm) {
    const double period_s = 1.0 / request.f_Hz;
    double longest_step_s = static_cast<double>(config.sample_time_ns) * 1e-9;
    for (const auto& effect : config.effects) {  // within what the formula follows
      longest_step_s = std::min(
          longest_step_s, 2.0 / effect->settling_rate_per_s(config.machine.R_s_ohm,
                                                            config.machine.L_s_H - config.machine.L_m_H));
    }
    steps_ = std::ceil(period_s / longest_step_s);
    h_ = period_s / steps_;
    periods_ = std::ceil(kWindow_s * request.f_Hz);
  }

  const Drive& drive() const { return drive_; }
  const Temperatures& temperature() const { return temperature_; }

  Means at_slip(double slip) {
    x_[kSpeed] = w_ * (1.0 - slip) / n_p_;
    Means last = window();
    for (double t = 0.0; t < longest_s_; t += periods_ * steps_ * h_) {
      const Means now = window();
      const bool still = std::abs(now.psi_r - last.psi_r) < kStill * std::abs(now.psi_r);
      last = now;
      if (still) break;
    }
    return last;
  }

 private:
  Complex voltage(double steps) const { return std::polar(V_, w_ * h_ * steps); }
  void slope(const State& x, double steps, State& out) {
    drive_.terminals = {Terminals::Kind::kClamped, voltage(steps), 1.0};
    drive_.derivatives(x.data(), out.data());
  }
  void step(double k) {
    const std::size_t n = drive_.size();
    State at = x_;
    slope(x_, k, k1_);
    for (std::size_t j = 0; j < n; ++j) at[j] = x_[j] + 0.5 * h_ * k1_[j];
    slope(at, k + 0.5, k2_);
    for (std::size_t j = 0; j < n; ++j) at[j] = x_[j] + 0.5 * h_ * k2_[j];
    slope(at, k + 0.5, k3_);
    for (std::size_t j = 0; j < n; ++j) at[j] = x_[j] + h_ * k3_[j];
    slope(at, k + 1.0, k4_);
    for (std::size_t j = 0; j < n; ++j) x_[j] += h_ / 6.0 * (k1_[j] + 2.0 * (k2_[j] + k3_[j]) + k4_[j]);
  }
  // Starts and ends at a whole period, so that steps count from it.
  Means window() {
    Means means;
    const double n = periods_ * steps_;
    for (double k = 0.0; k < n; k += 1.0) {
      step(k);
      drive_.terminals = {Terminals::Kind::kClamped, voltage(k + 1.0), 1.0};
      const Conditions at = drive_.flow(x_).at;
      means.add(at, drive_.losses(at, x_), std::polar(1.0, -w_ * h_ * (k + 1.0)), 1.0 / n);
      temperature_ = at.temperature;
    }
    return means;
  }

  Drive drive_;
  State x_, k1_{}, k2_{}, k3_{}, k4_{};
  Temperatures temperature_;
  double w_, V_, n_p_, longest_s_;
  double steps_ = 0.0, h_ = 0.0, periods_ = 0.0;
};

// Shaft torque rises with slip up to the breakdown; the secant starts at no load.
double slip_of_load(Run& run, double load_Nm) {
  const auto missing = [&](double slip) {
    const Means at = run.at_slip(slip);
    return at.torque_Nm - at.drag_Nm - load_Nm;
  };
  double a = 0.0, b = load_Nm >= 0.0 ? 0.002 : -0.002;
  double f_a = missing(a), f_b = missing(b);
  for (int round = 0; round < 30; ++round) {
    if (std::abs(f_b) <= 1e-6 * std::max(1.0, std::abs(load_Nm))) return b;
    const double rise = (f_b - f_a) / (b - a);
    const double next = b - f_b / rise;
    if (!(rise > 0.0) || !(std::abs(next) < 1.0)) break;
    a = b, f_a = f_b, b = next, f_b = missing(b);
  }
  throw Error("load_Nm",
              fmt::format("{} is more than this motor carries at this voltage and frequency", load_Nm),
              "less load, or slip= instead");
}

// Does the rotor carry enough current to show its impedance?
bool answers(const Means& at) { return std::abs(at.i_bar) > kNoRotorCurrent * std::abs(at.i_s); }

IncrementalInductance minus(const IncrementalInductance& a, const IncrementalInductance& b) {
  return {a.dd - b.dd, a.dq - b.dq, a.qq - b.qq};
}

IncrementalInductance symmetric(const Matrix2& m) { return {m.xx, 0.5 * (m.xy + m.yx), m.yy}; }

// psi_s and psi_r in the frame of the rotor's flux.
void incremental(const MagneticCircuit& circuit, OperatingPoint& p) {
  const MachineConfig& m = circuit.machine();
  if (circuit.linear()) {
    const double main = m.L_m_H * m.L_m_H / m.L_r_H, leak = m.L_s_H - main;
    p.L_l_incremental = {leak, 0.0, leak}, p.L_m_incremental = {main, 0.0, main};
    p.L_mT_incremental = {m.L_m_H, 0.0, m.L_m_H};
    return;
  }
  const auto [ss, sr, rr] = circuit.incremental(p.psi_s, p.psi_r);
  const Matrix2 r = inverse(rr);
  const Matrix2 whole = inverse(ss - sr * r * transposed(sr));
  p.L_l_incremental = symmetric(inverse(ss));
  p.L_m_incremental = minus(symmetric(whole), p.L_l_incremental);
  p.L_mT_incremental = symmetric(-1.0 * (whole * sr * r));
}

double ratio(Complex psi, Complex i, double without_current) {
  return std::norm(i) > 0.0 ? (psi * std::conj(i)).real() / std::norm(i) : without_current;
}

void secant(const Drive& drive, const Means& at, Complex i_w, const Means& rotor, double w_probe,
            OperatingPoint& p) {
  const MachineConfig& m = drive.magnetics().machine();
  const double leak_s = m.L_s_H - m.L_m_H, leak_r = m.L_r_H - m.L_m_H;
  p.psi_m =
      drive.magnetics().linear() ? p.psi_s - leak_s * i_w : drive.magnetics().solve(p.psi_s, p.psi_r).psi_m;
  p.L_m_H = ratio(p.psi_m, i_w + p.i_r, m.L_m_H);
  p.L_ls_H = ratio(p.psi_s - p.psi_m, i_w, leak_s);
  p.L_lr_H = answers(at) ? ratio(p.psi_r - p.psi_m, p.i_r, leak_r) : leak_r;
  const Complex Z = Complex(0.0, -w_probe) * rotor.psi_r / rotor.i_bar;
  p.R_s_ohm = at.R_s, p.R_r_ohm = Z.real(), p.L_x_H = Z.imag() / w_probe;
  const double k = p.L_m_H / (p.L_m_H + p.L_lr_H + p.L_x_H);
  p.secant = {p.R_s_ohm, k * k * p.R_r_ohm, p.L_ls_H + (1.0 - k) * p.L_m_H, k * p.L_m_H};
  if (at.G_iron > 0.0) p.R_c_ohm = k * k / at.G_iron;
}

std::optional<double>* field(PointRequest& request, const std::string& key) {
  if (key == "slip") return &request.slip;
  if (key == "load_Nm") return &request.load_Nm;
  if (key == "stator_C") return &request.stator_C;
  if (key == "rotor_C") return &request.rotor_C;
  return nullptr;
}

double number(const std::string& pair, const std::string& text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    throw Error("--at", "'" + pair + "' holds no number", "as in f_Hz=60,v_V=180,slip=0.03");
  return value;
}

void check(const std::string& key, double value, double low, double high) {
  if (value >= low && value <= high) return;
  throw Error("--at", fmt::format("{} is {}", key, value),
              fmt::format("it must lie between {} and {}", low, high));
}

void check(const PointRequest& request) {
  check("f_Hz", request.f_Hz, 0.5, 1000.0);
  check("v_V", request.v_V, 1e-3, 1e5);
  if (request.slip.has_value() == request.load_Nm.has_value())
    throw Error("--at", "gives not exactly one of slip and load_Nm", "as in f_Hz=60,v_V=180,slip=0.03");
  if (request.slip) check("slip", *request.slip, -2.0, 2.0);
  if (request.stator_C) check("stator_C", *request.stator_C, -60.0, 400.0);
  if (request.rotor_C) check("rotor_C", *request.rotor_C, -60.0, 600.0);
}

}  // namespace

PointRequest parse_point_request(const std::string& text) {
  PointRequest request;
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t to = std::min(text.find(',', from), text.size());
    const std::string pair = text.substr(from, to - from);
    const std::size_t equals = std::min(pair.find('='), pair.size());
    const std::string key = pair.substr(0, equals);
    const double value = number(pair, equals < pair.size() ? pair.substr(equals + 1) : "");
    if (key == "f_Hz") {
      request.f_Hz = value;
    } else if (key == "v_V") {
      request.v_V = value;
    } else if (auto* place = field(request, key)) {
      *place = value;
    } else {
      throw Error("--at", "'" + key + "' is not known",
                  "known are f_Hz, v_V, slip, load_Nm, stator_C, rotor_C");
    }
    from = to + 1;
  }
  check(request);
  return request;
}

OperatingPoint find_operating_point(const PlantConfig& config, const PointRequest& request) {
  check(request);
  Run run(config, request);
  const double slip = request.slip ? *request.slip : slip_of_load(run, *request.load_Nm);
  const double w = 2.0 * kPi * request.f_Hz;
  const Means at = run.at_slip(slip);
  const Complex back = std::conj(at.psi_r) / std::abs(at.psi_r);
  OperatingPoint p{};
  p.f_Hz = request.f_Hz, p.v_V = request.v_V, p.slip = slip, p.w_slip_rad_s = slip * w;
  p.speed_rpm = rpm_of_rad_s(w * (1.0 - slip) / config.machine.pole_pairs);
  p.v_s = back * request.v_V, p.i_s = back * at.i_s, p.i_r = back * at.i_r, p.i_bar = back * at.i_bar;
  p.psi_s = back * at.psi_s, p.psi_r = back * at.psi_r;
  p.torque_Nm = at.torque_Nm, p.shaft_Nm = at.torque_Nm - at.drag_Nm, p.in_W = at.in_W;
  p.power_factor = at.in_W / (1.5 * request.v_V * std::abs(at.i_s));
  p.losses = at.losses, p.temperature = run.temperature();
  // Without current the rotor does not say what its resistance is: asked at a slip close by.
  const bool silent = !answers(at);
  const double near = silent ? kProbeSlip : slip;
  secant(run.drive(), at, back * at.i_w, silent ? run.at_slip(near) : at, near * w, p);
  incremental(run.drive().magnetics(), p);
  return p;
}

}  // namespace imrig::plant
