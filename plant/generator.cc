#include "plant/generator.h"

#include <cmath>

#include "rig/base/space_vector.h"

namespace imrig::plant {
namespace {

constexpr double kSmooth_rad_s = 0.2;

double square(double x) { return x * x; }

TwoSlope bend(const GeneratorConfig& c) {
  if (c.saturated_ratio == 1.0) return {};
  return {(1.0 / c.saturated_ratio - 1.0) / (c.L_s_H - c.L_leakage_H), c.knee_Wb, c.softness};
}

}  // namespace

Generator::Generator(const GeneratorConfig& config)
    : config_(config),
      coupled_(config.coupled),
      brakes_(config.coupled &&
              (config.core_loss_W > 0.0 || config.friction_Nm > 0.0 || config.windage_Nms2 > 0.0)),
      p_(config.pole_pairs),
      L_(config.L_s_H),
      M_(config.flux_per_field_A_Wb),
      L_f_(config.L_field_H),
      R_(config.R_a_ohm + config.R_load_ohm),
      R_f_(config.R_field_ohm),
      D_(L_ * L_f_ - 1.5 * M_ * M_),
      dd_(L_f_ / D_),
      df_(M_ / D_),
      ff_(L_ / D_),
      qq_(1.0 / L_),
      L_l_(config.L_leakage_H),
      L_m_(L_ - L_l_),
      n_(M_ / L_m_),
      L_fl_(L_f_ - 1.5 * n_ * M_),
      bend_(bend(config)) {}

// With s = h(|psi_m|)/|psi_m| given, psi_m is linear in the fluxes and shrinks as s grows, while s grows with
// |psi_m|: s - h/|psi_m| rises from negative to positive with slope above 1, and Newton's method, kept within
// the bracket, finds its one zero.
void Generator::bent_currents(double psi_d, double psi_q, double psi_f, Flow& flow) const {
  const double both = 1.0 / L_m_ + 1.0 / L_l_, a_d = both + 1.5 * n_ * n_ / L_fl_;
  const double b_d = psi_d / L_l_ + n_ * psi_f / L_fl_, b_q = psi_q / L_l_;
  double low = 0.0, high = bend_.final_slope(), s = 0.0;
  double m_d = 0.0, m_q = 0.0;
  for (int round = 0; round < 60; ++round) {
    m_d = b_d / (a_d + s), m_q = b_q / (both + s);
    const TwoSlope::Tangent t = bend_.tangent(m_d * m_d + m_q * m_q);
    const double miss = s - t.secant;
    (miss < 0.0 ? low : high) = s;
    const double step = miss / (1.0 + t.rank * (m_d * m_d / (a_d + s) + m_q * m_q / (both + s)));
    if (std::abs(step) <= 1e-14 * both) break;
    s = s - step > low && s - step < high ? s - step : 0.5 * (low + high);
  }
  flow.i_d = (psi_d - m_d) / L_l_;
  flow.i_q = (psi_q - m_q) / L_l_;
  flow.i_f = (psi_f - 1.5 * n_ * m_d) / L_fl_;
}

void Generator::brake(double psi_d, double psi_q, double w_mech, Flow& flow) const {
  const double w_0 = rad_s_of_rpm(config_.core_rpm);
  const double sign = w_mech / std::sqrt(w_mech * w_mech + kSmooth_rad_s * kSmooth_rad_s);
  const double psi2 = square(psi_d - L_l_ * flow.i_d) + square(psi_q - L_l_ * flow.i_q);
  const double k = config_.core_eddy_share;
  const double core_Nm =
      config_.core_loss_W / w_0 * psi2 / square(config_.core_psi_Wb) * ((1.0 - k) * sign + k * w_mech / w_0);
  const double friction_Nm = config_.friction_Nm * sign + config_.windage_Nms2 * w_mech * std::abs(w_mech);
  flow.shaft_Nm -= core_Nm + friction_Nm;
  flow.core_W = core_Nm * w_mech;
  flow.friction_W = friction_Nm * w_mech;
}

double Generator::stored_J(double psi_d, double psi_q, double psi_f, const Flow& flow) const {
  if (bend_.none()) return 0.75 * (psi_d * flow.i_d + psi_q * flow.i_q) + 0.5 * psi_f * flow.i_f;
  const double psi2 = square(psi_d - L_l_ * flow.i_d) + square(psi_q - L_l_ * flow.i_q);
  return 0.75 * L_l_ * (square(flow.i_d) + square(flow.i_q)) + 0.5 * L_fl_ * square(flow.i_f) +
         1.5 * (0.5 * psi2 / L_m_ + bend_.energy(std::sqrt(psi2)));
}

double Generator::open_circuit_field_A(double psi_m_Wb) const {
  const double extra = bend_.none() ? 0.0 : bend_.secant(psi_m_Wb * psi_m_Wb) * psi_m_Wb;
  return psi_m_Wb / M_ + extra / n_;
}

}  // namespace imrig::plant
