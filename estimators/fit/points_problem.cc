#include "estimators/fit/points_problem.h"

#include <ceres/jet.h>

#include <cmath>

namespace imrig::est {

namespace {

constexpr int kSpeed = 4;  // the derivative after R_s, R_r, L_l, L_m
using Jet = ceres::Jet<double, 5>;
constexpr int kSpeedSteps = 8;

// Residuals of one point at theta and a speed shift, in units of the noise.
struct PointResiduals {
  std::vector<Jet> r;
  void add(const Jet& predicted, double measured, double sigma) {
    if (std::isfinite(measured)) r.push_back((predicted - measured) / sigma);
  }
};

double measured_power(const SteadyPoint& p) {
  if (std::isfinite(p.p_in_W)) return p.p_in_W;
  return 1.5 * p.v_peak_V * p.i_peak_A * p.power_factor;  // NaN when one is missing
}

PointResiduals residuals(const MachineParameters<double>& theta, const SteadyPoint& point, double shift,
                         const Noise& noise, int pole_pairs) {
  const MachineParameters<Jet> p{Jet(theta.R_s, 0), Jet(theta.R_r, 1), Jet(theta.L_l, 2), Jet(theta.L_m, 3)};
  Jet w_r(pole_pairs * (point.speed_rad_s + shift));
  w_r.v[kSpeed] = pole_pairs;
  const auto s = steady_state(p, pole_pairs, point.v_peak_V, 2.0 * kPi * point.f_Hz, w_r);
  const double power = measured_power(point);
  PointResiduals out;
  out.add(s.current_A, point.i_peak_A, noise.current_A);
  out.add(s.p_in_W, power, noise.power_W);
  if (!std::isfinite(power) || !std::isfinite(point.i_peak_A)) out.add(s.q_var, point.q_var, noise.power_W);
  if (!std::isfinite(power)) {
    if (std::isfinite(point.torque_Nm)) {
      out.add(s.torque_Nm, point.torque_Nm, noise.torque_Nm);
    } else {
      out.add(s.p_mech_W, point.p_out_W, noise.power_W);
    }
  }
  Jet own(shift / noise.speed_rad_s);
  own.v[kSpeed] = 1.0 / noise.speed_rad_s;
  out.r.push_back(own);
  return out;
}

}  // namespace

PointsProblem::PointsProblem(std::vector<SteadyPoint> points, const Noise& noise, int pole_pairs)
    : points_(std::move(points)), noise_(noise), pole_pairs_(pole_pairs) {}

double PointsProblem::speed_shift(const MachineParameters<double>& theta, const SteadyPoint& point) const {
  double shift = 0.0;
  for (int step = 0; step < kSpeedSteps; ++step) {
    double slope = 0.0, curvature = 0.0;
    for (const Jet& r : residuals(theta, point, shift, noise_, pole_pairs_).r) {
      slope += r.v[kSpeed] * r.a;
      curvature += r.v[kSpeed] * r.v[kSpeed];
    }
    const double move = -slope / curvature;
    shift += move;
    if (std::abs(move) < 1e-9 * noise_.speed_rad_s) break;
  }
  return shift;
}

PointsLinearization PointsProblem::linearize(const MachineParameters<double>& theta) const {
  PointsLinearization out;
  for (const auto& point : points_) {
    const auto at = residuals(theta, point, speed_shift(theta, point), noise_, pole_pairs_);
    Eigen::Vector4d cross = Eigen::Vector4d::Zero();
    double curvature = 0.0;
    for (const Jet& r : at.r) {
      const Eigen::Vector4d row = r.v.head<4>();
      out.error += r.a * r.a;
      out.normal += row * row.transpose();
      out.gradient += row * r.a;
      cross += row * r.v[kSpeed];
      curvature += r.v[kSpeed] * r.v[kSpeed];
    }
    out.normal -= cross * cross.transpose() / curvature;
    out.residuals += at.r.size() - 1;
  }
  return out;
}

}  // namespace imrig::est
