#pragma once
// The yardstick: motor, generator and shaft as bare arithmetic, without hooks, effects or sensors, by the classical
// Runge-Kutta formula of order four. The same equations as the plant with friction alone (docs/plant.md), written
// down a second time and not shared:
//   D i_s = L_r psi_s - L_m psi_r,  D i_r = L_s psi_r - L_m psi_s,  D = L_s L_r - L_m^2
//   d psi_s/dt = v_s - R_s i_s,     d psi_r/dt = -R_r i_r + j n_p w psi_r
//   J dw/dt = -(3/2) n_p Im(conj(psi_r) i_r) + T_generator - T_c sgn w - b w
// The friction at rest holds what pulls, up to T_c.
// Generator: plant/generator.h's equations in its own dq frame.

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

#include "plant/plant_config.h"

namespace imrig::bench {

struct BareFriction {
  double coulomb_Nm, viscous_Nms;
};

class BareMotor {
 public:
  // psi_s, psi_r (real, imaginary), w, theta, generator's psi_d, psi_q, psi_f
  using State = std::array<double, 9>;

  BareMotor(const plant::PlantConfig& c, const BareFriction& friction)
      : R_s_(c.machine.R_s_ohm),
        R_r_(c.machine.R_r_ohm),
        n_p_(c.machine.pole_pairs),
        J_inverse_(1.0 / c.mechanics.J_kgm2),
        friction_(friction),
        p_(c.generator.pole_pairs),
        R_(c.generator.R_a_ohm + c.generator.R_load_ohm),
        R_f_(c.generator.R_field_ohm) {
    const double D = c.machine.L_s_H * c.machine.L_r_H - c.machine.L_m_H * c.machine.L_m_H;
    s_ = c.machine.L_r_H / D, r_ = c.machine.L_s_H / D, m_ = c.machine.L_m_H / D;
    const plant::GeneratorConfig& g = c.generator;
    const double D_g = g.L_s_H * g.L_field_H - 1.5 * g.flux_per_field_A_Wb * g.flux_per_field_A_Wb;
    dd_ = g.L_field_H / D_g, df_ = g.flux_per_field_A_Wb / D_g;
    qq_ = 1.0 / g.L_s_H, ff_ = g.L_s_H / D_g;
  }

  static State at_rest() { return {}; }
  std::complex<double> v_s = 0.0;
  double field_V = 0.0;

  std::complex<double> current(const State& x) const { return {current_x(x), current_y(x)}; }

  void step(State& x, double h) const {
    const State k1 = rate(x), k2 = rate(moved(x, 0.5 * h, k1)), k3 = rate(moved(x, 0.5 * h, k2)),
                k4 = rate(moved(x, h, k3));
    for (std::size_t k = 0; k < x.size(); ++k) x[k] += h / 6.0 * (k1[k] + 2.0 * (k2[k] + k3[k]) + k4[k]);
  }

 private:
  double current_x(const State& x) const { return s_ * x[0] - m_ * x[2]; }
  double current_y(const State& x) const { return s_ * x[1] - m_ * x[3]; }

  static State moved(const State& x, double h, const State& slope) {
    State to;
    for (std::size_t k = 0; k < x.size(); ++k) to[k] = x[k] + h * slope[k];
    return to;
  }

  State rate(const State& x) const {
    const double i_sx = current_x(x), i_sy = current_y(x);
    const double i_rx = r_ * x[2] - m_ * x[0], i_ry = r_ * x[3] - m_ * x[1];
    const double w = x[4], w_e = n_p_ * w, w_g = p_ * w;
    const double i_d = dd_ * x[6] - df_ * x[8], i_q = qq_ * x[7], i_f = ff_ * x[8] - 1.5 * df_ * x[6];
    const double pull = -1.5 * n_p_ * (x[2] * i_ry - x[3] * i_rx) + 1.5 * p_ * (x[6] * i_q - x[7] * i_d);
    const double T_c = friction_.coulomb_Nm;
    const double dry = w > 0.0 ? T_c : w < 0.0 ? -T_c : std::clamp(pull, -T_c, T_c);
    const double torque = pull - dry - friction_.viscous_Nms * w;
    return {v_s.real() - R_s_ * i_sx,    v_s.imag() - R_s_ * i_sy,
            -R_r_ * i_rx - w_e * x[3],   -R_r_ * i_ry + w_e * x[2],
            torque * J_inverse_,         w,
            -R_ * i_d + w_g * x[7],      -R_ * i_q - w_g * x[6],
            field_V - R_f_ * i_f};
  }

  double R_s_, R_r_, n_p_, J_inverse_;
  double s_, r_, m_;
  BareFriction friction_;
  double p_, R_, R_f_;
  double dd_, df_, qq_, ff_;
};

}  // namespace imrig::bench
