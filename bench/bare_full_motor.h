#pragma once
// The second yardstick: models/plants/proca_5hp_full.toml as bare arithmetic, without hooks, sensors or
// control of the step, by the classical Runge-Kutta formula of order four. The same equations as the plant's
// effects (docs/plant/), written down a second time: both kinds of saturation, deep bar, iron loss, dead
// time, friction, windage, stray load loss, heat, generator. Newton's method for the air-gap flux starts
// where the last evaluation ended and stops where the next step would leave microamperes; temperatures move
// at the rate of the step's start.

#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <string>

#include "plant/effects/effect.h"
#include "plant/plant_config.h"
#include "rig/base/error.h"

namespace imrig::bench {

// Names and units as in the file.
struct BareFullConfig {
  double R_s_ohm, R_r_ohm, L_ls_H, L_lr_H, L_m_H, n_p, J_kgm2;  // T circuit
  double main_ratio, main_knee_Wb, leakage_ratio, leakage_knee_A, main_softness, leakage_softness;
  double bar_height_m, resistivity_ohm_m, bar_fraction;
  double hysteresis_W, eddy_W, rated_psi_Wb, rated_f_Hz;
  double coulomb_Nm, viscous_Nms, quadratic_Nms2;
  double stray_W, stray_A, stray_rad_s;  // exponent 1.5
  double gap_V, drop_ohm, width_A;
  std::array<double, 3> J_per_K, W_per_K;  // stator, rotor, iron; stator-iron, rotor-iron, iron-ambient
  double fan, fan_rad_s;
  double p_g, R_g_ohm, R_f_ohm, L_g_H, L_f_H, M_g_H;
};

class BareFullMotor {
 public:
  using Complex = std::complex<double>;
  static constexpr std::size_t kStates = 21;
  // psi_s, psi_r, w, theta, generator's psi_d, psi_q, psi_f, four currents of the bar's layers, iron's e^2,
  // T_s, T_r, T_f
  using State = std::array<double, kStates>;

  explicit BareFullMotor(const BareFullConfig& config)
      : c(config),
        tau_(4e-7 * kPi * c.bar_height_m * c.bar_height_m / c.resistivity_ohm_m),
        main_(1.0 / c.L_m_H, c.main_ratio, c.main_knee_Wb, c.main_softness),
        stator_(1.0 / c.L_ls_H, c.leakage_ratio, c.L_ls_H * c.leakage_knee_A, c.leakage_softness),
        rotor_(1.0 / bare_L_lr(), c.leakage_ratio, bare_L_lr() * c.leakage_knee_A, c.leakage_softness) {
    const double w_0 = 2.0 * kPi * c.rated_f_Hz;
    eddy_S_ = c.eddy_W / (1.5 * w_0 * w_0 * c.rated_psi_Wb * c.rated_psi_Wb);
    hysteresis_ = c.hysteresis_W / (1.5 * w_0 * c.rated_psi_Wb * c.rated_psi_Wb);
    const double D = c.L_g_H * c.L_f_H - 1.5 * c.M_g_H * c.M_g_H;
    dd_ = c.L_f_H / D, df_ = c.M_g_H / D, ff_ = c.L_g_H / D, qq_ = 1.0 / c.L_g_H;
  }

  static State at_rest() {
    State x{};
    x[kWarm] = x[kWarm + 1] = x[kWarm + 2] = 25.0;
    return x;
  }

  Complex v_s = 0.0;
  double field_V = 0.0;

  Complex current(const State& x) { return currents({x[0], x[1]}, {x[2], x[3]})[0]; }

  void step(State& x, double h) {
    State k1, k2, k3, k4;
    rate(x, k1, true);
    rate(moved(x, 0.5 * h, k1), k2, false);
    rate(moved(x, 0.5 * h, k2), k3, false);
    rate(moved(x, h, k3), k4, false);
    for (std::size_t k = 0; k < kWarm; ++k) x[k] += h / 6.0 * (k1[k] + 2.0 * (k2[k] + k3[k]) + k4[k]);
    for (std::size_t k = kWarm; k < kStates; ++k) x[k] += h * k1[k];
  }

 private:
  static constexpr double kPi = std::numbers::pi;
  static constexpr std::size_t kBar = 9, kIron = 17, kWarm = 18;
  static constexpr double kLastStep_Wb2 = 1e-8;  // leaves about a microampere
  static constexpr double kSeries[4] = {5.0, 9.0, 13.0, 5.0};

  // i = f(|psi|^2) psi, d f/d |psi|^2 beside it.
  struct Branch {
    Branch(double base_, double ratio, double knee, double r)
        : base(base_), s((1.0 / ratio - 1.0) * base_), K(knee), r2(r * r) {}
    double base, s, K, r2;
    std::array<double, 2> operator()(double u) const {
      const double a = u - K * K, P = std::sqrt(a * a + 4.0 * r2 * K * K * u), S2 = 2.0 * (u + K * K + P);
      const double g = 2.0 * K * s / std::sqrt(S2);
      return {base + s - g, g * (P + a + 2.0 * r2 * K * K) / (S2 * P)};
    }
  };

  static double norm(Complex z) { return z.real() * z.real() + z.imag() * z.imag(); }
  static double root(double x, double width) { return x / std::sqrt(x * x + width * width); }
  double bare_L_lr() const { return c.L_lr_H - c.bar_fraction * c.R_r_ohm * tau_ / 3.0; }

  static State moved(const State& x, double h, const State& slope) {
    State to;
    for (std::size_t k = 0; k < kWarm; ++k) to[k] = x[k] + h * slope[k];
    for (std::size_t k = kWarm; k < kStates; ++k) to[k] = x[k];
    return to;
  }

  // The last step is left to the branches' slopes.
  std::array<Complex, 2> currents(Complex psi_s, Complex psi_r) {
    for (int round = 0;; ++round) {
      const Answer m = answer(main_, psi_m_), s = answer(stator_, psi_s - psi_m_),
                   r = answer(rotor_, psi_r - psi_m_);
      const double xx = m.xx + s.xx + r.xx, xy = m.xy + s.xy + r.xy, yy = m.yy + s.yy + r.yy;
      const Complex rest = s.i + r.i - m.i;
      const double D = 1.0 / (xx * yy - xy * xy);
      const Complex d(D * (yy * rest.real() - xy * rest.imag()), D * (xx * rest.imag() - xy * rest.real()));
      psi_m_ += d;
      if (norm(d) < kLastStep_Wb2 || round == 20) return {s.i - s.along(d), r.i - r.along(d)};
    }
  }

  struct Answer {
    Complex i;
    double xx, xy, yy;  // its slope
    Complex along(Complex d) const { return {xx * d.real() + xy * d.imag(), xy * d.real() + yy * d.imag()}; }
  };
  static Answer answer(const Branch& branch, Complex psi) {
    const auto [f, slope] = branch(norm(psi));
    const double x = psi.real(), y = psi.imag();
    return {{f * x, f * y}, f + 2.0 * slope * x * x, 2.0 * slope * x * y, f + 2.0 * slope * y * y};
  }

  void rate(const State& x, State& dx, bool heat) {
    const Complex psi_s(x[0], x[1]), psi_r(x[2], x[3]);
    const double w = x[4], w_e = c.n_p * w, w_g = c.p_g * w;
    const auto [i_s, i_r] = currents(psi_s, psi_r);
    const double R_s = c.R_s_ohm * (235.0 + x[kWarm]) / 260.0,
                 R_r = c.R_r_ohm * (225.0 + x[kWarm + 1]) / 250.0;
    const double bar = c.bar_fraction * R_r, e = std::sqrt(std::max(x[kIron], 0.0) + 1.0);
    const double G = eddy_S_ + hysteresis_ * std::sqrt(norm(psi_r)) / e;
    // Bar: v = R i + sum of what each layer's resistor takes.
    std::array<Complex, 4> passed;
    Complex v_0 = 0.0, sum = 0.0;
    for (std::size_t k = 0; k < 4; ++k) {
      sum += Complex(x[kBar + 2 * k], x[kBar + 2 * k + 1]);
      passed[k] = sum, v_0 -= bar * kSeries[k] * sum;
    }
    const double R = R_r + 32.0 * bar;
    const Complex motion = Complex(-w_e * psi_r.imag(), w_e * psi_r.real()) - v_0;
    const Complex i_bar = (i_r + G * motion) * (1.0 / (1.0 + R * G)), e_r = motion - R * i_bar;
    Complex volts = 0.0;
    const double per_layer = R_r / (c.R_r_ohm * tau_);
    for (std::size_t k = 4; k-- > 0;) {
      volts += kSeries[k] * (i_bar - passed[k]);
      const double f = per_layer * (4.0 * static_cast<double>(k) + 3.0);
      dx[kBar + 2 * k] = f * volts.real() - w_e * x[kBar + 2 * k + 1];
      dx[kBar + 2 * k + 1] = f * volts.imag() + w_e * x[kBar + 2 * k];
    }
    dx[kIron] = (norm(e_r) - x[kIron]) / 0.002;
    // Dead time.
    const double half = -0.5 * i_s.real(), quadrature = 0.5 * std::sqrt(3.0) * i_s.imag();
    const double a = root(i_s.real(), c.width_A), b = root(half + quadrature, c.width_A),
                 d = root(half - quadrature, c.width_A);
    const Complex lost =
        c.gap_V * Complex((2.0 * a - b - d) / 3.0, (b - d) / std::sqrt(3.0)) + c.drop_ohm * i_s;
    const Complex d_s = v_s - lost - R_s * i_s;
    // Generator and shaft.
    const double i_d = dd_ * x[6] - df_ * x[8], i_q = qq_ * x[7], i_f = ff_ * x[8] - 1.5 * df_ * x[6];
    const double fast = std::sqrt(std::abs(w) / c.stray_rad_s);
    const double stray =
        c.stray_W / c.stray_rad_s * norm(i_s) / (c.stray_A * c.stray_A) * fast * root(w, 0.2);
    const double friction = c.coulomb_Nm * (w > 0.0   ? 1.0
                                            : w < 0.0 ? -1.0
                                                      : 0.0) +
                            (c.viscous_Nms + c.quadratic_Nms2 * std::abs(w)) * w;
    const double air_gap = -1.5 * c.n_p * (psi_r.real() * i_bar.imag() - psi_r.imag() * i_bar.real());
    const double pull = air_gap + 1.5 * c.p_g * (x[6] * i_q - x[7] * i_d);
    dx[0] = d_s.real(), dx[1] = d_s.imag(), dx[2] = e_r.real(), dx[3] = e_r.imag();
    dx[4] = w == 0.0 && std::abs(pull) < c.coulomb_Nm ? 0.0 : (pull - friction - stray) / c.J_kgm2;
    dx[5] = w;
    dx[6] = -c.R_g_ohm * i_d + w_g * x[7], dx[7] = -c.R_g_ohm * i_q - w_g * x[6],
    dx[8] = field_V - c.R_f_ohm * i_f;
    if (!heat) return;
    double bars = (R_r - bar) * norm(i_bar) + bar * norm(i_bar);
    for (std::size_t k = 0; k < 4; ++k) bars += bar * kSeries[k] * norm(i_bar - passed[k]);
    const double from_s = c.W_per_K[0] * (x[kWarm] - x[kWarm + 2]),
                 from_r = c.W_per_K[1] * (x[kWarm + 1] - x[kWarm + 2]);
    const double out = c.W_per_K[2] * (1.0 + c.fan * std::abs(w) / c.fan_rad_s) * (x[kWarm + 2] - 25.0);
    dx[kWarm] = (1.5 * R_s * norm(i_s) - from_s) / c.J_per_K[0];
    dx[kWarm + 1] = (1.5 * bars - from_r) / c.J_per_K[1];
    dx[kWarm + 2] = (1.5 * G * norm(e_r) + (stray + friction) * w + from_s + from_r - out) / c.J_per_K[2];
  }

  BareFullConfig c;
  double tau_;
  Branch main_, stator_, rotor_;
  double eddy_S_, hysteresis_;
  double dd_, df_, ff_, qq_;
  Complex psi_m_ = 0.0;
};

// From a plant that has exactly these effects.
inline BareFullConfig bare_full_config(const plant::PlantConfig& plant) {
  const auto of = [&](const std::string& effect, const std::string& name) {
    for (const auto& e : plant.effects) {
      if (e->name() != effect) continue;
      for (const auto& p : e->parameters()) {
        if (p.name == name) return p.value;
      }
    }
    throw Error("plant " + plant.name, "has no " + effect + " " + name);
  };
  const double rpm = 2.0 * std::numbers::pi / 60.0;
  const plant::MachineConfig& m = plant.machine;
  const plant::GeneratorConfig& g = plant.generator;
  const double gap_V = plant.inverter.dc_link_V * of("inverter_dead_time", "dead_time_s") /
                       (1e-9 * static_cast<double>(plant.pwm_time_ns));
  return {.R_s_ohm = m.R_s_ohm,
          .R_r_ohm = m.R_r_ohm,
          .L_ls_H = m.L_s_H - m.L_m_H,
          .L_lr_H = m.L_r_H - m.L_m_H,
          .L_m_H = m.L_m_H,
          .n_p = static_cast<double>(m.pole_pairs),
          .J_kgm2 = plant.mechanics.J_kgm2,
          .main_ratio = of("magnetizing_saturation", "saturated_ratio"),
          .main_knee_Wb = of("magnetizing_saturation", "knee_Wb"),
          .leakage_ratio = of("leakage_saturation", "stator_saturated_ratio"),
          .leakage_knee_A = of("leakage_saturation", "stator_knee_A"),
          .main_softness = of("magnetizing_saturation", "softness"),
          .leakage_softness = of("leakage_saturation", "softness"),
          .bar_height_m = of("rotor_skin_effect", "bar_height_m"),
          .resistivity_ohm_m = of("rotor_skin_effect", "resistivity_ohm_m"),
          .bar_fraction = of("rotor_skin_effect", "bar_fraction"),
          .hysteresis_W = of("iron_loss", "hysteresis_W"),
          .eddy_W = of("iron_loss", "eddy_W"),
          .rated_psi_Wb = of("iron_loss", "rated_psi_Wb"),
          .rated_f_Hz = of("iron_loss", "rated_f_Hz"),
          .coulomb_Nm = of("friction", "coulomb_Nm"),
          .viscous_Nms = of("friction", "viscous_Nms"),
          .quadratic_Nms2 = of("windage", "quadratic_Nms2"),
          .stray_W = of("stray_load_loss", "loss_W"),
          .stray_A = of("stray_load_loss", "rated_A"),
          .stray_rad_s = rpm * of("stray_load_loss", "rated_rpm"),
          .gap_V = gap_V + of("inverter_dead_time", "drop_V"),
          .drop_ohm = of("inverter_dead_time", "drop_ohm"),
          .width_A = of("inverter_dead_time", "width_A"),
          .J_per_K = {of("thermal", "stator_J_per_K"), of("thermal", "rotor_J_per_K"),
                      of("thermal", "iron_J_per_K")},
          .W_per_K = {of("thermal", "stator_iron_W_per_K"), of("thermal", "rotor_iron_W_per_K"),
                      of("thermal", "iron_ambient_W_per_K")},
          .fan = of("thermal", "fan"),
          .fan_rad_s = rpm * of("thermal", "fan_rpm"),
          .p_g = static_cast<double>(g.pole_pairs),
          .R_g_ohm = g.R_a_ohm + g.R_load_ohm,
          .R_f_ohm = g.R_field_ohm,
          .L_g_H = g.L_s_H,
          .L_f_H = g.L_field_H,
          .M_g_H = g.flux_per_field_A_Wb};
}

}  // namespace imrig::bench
