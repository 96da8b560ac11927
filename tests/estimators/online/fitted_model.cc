#include "tests/estimators/online/fitted_model.h"

#include <Eigen/Dense>
#include <cmath>
#include <complex>
#include <vector>

#include "estimators/online/motor_knowledge.h"
#include "estimators/online/running_model.h"
#include "plant/operating_point.h"
#include "rig/base/space_vector.h"

namespace imrig::test {

namespace {

// Relative half width of the intervals: what a linear part and its saturation trade among each other at equal
// misfit.
constexpr double kDoubt = 0.02;

struct Measured {
  double V, w_e, w_r;
  std::complex<double> i;  // voltage on the real axis
};

plant::OperatingPoint at(const plant::PlantConfig& config, double f_Hz, double V, double slip, double C) {
  plant::PointRequest r;
  r.f_Hz = f_Hz;
  r.v_V = V;
  r.slip = slip;
  r.stator_C = r.rotor_C = C;
  return plant::find_operating_point(config, r);
}

est::Parameter parameter(double value, const char* unit) {
  return {value, value * (1.0 - kDoubt), value * (1.0 + kDoubt), unit, "truth"};
}

// Logarithms: R_r, L_l, L_m, extra, exponent, leakage extra, k_6, eddy, hysteresis, bend.
using Vector = Eigen::VectorXd;
constexpr int kUnknowns = 10;

est::Model model_of(const Vector& x, double R_s_ohm, int pole_pairs, double cold_C, double psi_Wb,
                    double leakage_Wb) {
  const auto p = [&](int k, const char* unit) { return parameter(std::exp(x[k]), unit); };
  const auto fixed = [](double value, const char* unit) {
    return est::Parameter{value, value, value, unit, "chosen"};
  };
  est::Model m;
  m.name = "fitted to truth";
  m.pole_pairs = pole_pairs;
  m.R_s = {R_s_ohm, 0.999 * R_s_ohm, 1.001 * R_s_ohm, "ohm", "truth"};
  m.R_r = p(0, "ohm");
  m.L_l = p(1, "H");
  m.L_m = p(2, "H");
  m.R_s_stator_C = cold_C;
  m.effects.push_back({"magnetizing_saturation",
                       "two slopes, placed",
                       {{"extra", p(3, "1")},
                        {"exponent", p(4, "1")},
                        {"place", fixed(0.5, "1")},
                        {"bend", p(9, "1")},
                        {"psi_ref_Wb", fixed(psi_Wb, "Wb")}}});
  m.effects.push_back(
      {"leakage_saturation",
       "power law",
       {{"extra", p(5, "1")}, {"exponent", fixed(2.0, "1")}, {"psi_ref_Wb", fixed(leakage_Wb, "Wb")}}});
  m.effects.push_back({"rotor_skin_effect", "line", {{"k6_ohm_s", p(6, "ohm s")}}});
  m.effects.push_back(
      {"core_loss",
       "eddy currents and hysteresis",
       {{"eddy_S", p(7, "S")}, {"hysteresis_S_rad_s", p(8, "S rad/s")}, {"place", fixed(0.5, "1")}}});
  return m;
}

}  // namespace

FittedModel fitted_model(const plant::PlantConfig& config, double rated_Hz, double rated_V, double cold_C) {
  std::vector<Measured> points;
  double R_s_ohm = 0.0, psi_Wb = rated_V / (2.0 * kPi * rated_Hz);
  for (const double f : {0.5, 0.75, 1.0}) {
    for (const double flux : {0.5, 0.75, 0.9, 1.0}) {
      for (const double slip_Hz : {0.1, 1.0, 2.0, 3.5, 5.0}) {
        const double f_Hz = f * rated_Hz;
        const plant::OperatingPoint p = at(config, f_Hz, f * flux * rated_V, slip_Hz / f_Hz, cold_C);
        points.push_back({p.v_V, 2.0 * kPi * f_Hz, 2.0 * kPi * (f_Hz - slip_Hz), p.i_s / p.v_s * p.v_V});
        R_s_ohm = p.secant.R_s_ohm;
      }
    }
  }
  const plant::InverseGamma start = plant::inverse_gamma_truth(config);
  Vector x(kUnknowns);
  x << start.R_r_ohm, start.L_l_H, start.L_m_H, 0.3, 6.0, 0.1, 1e-4, 1e-3, 0.3, 1.0;
  x = x.array().log().matrix();
  const auto build = [&](const Vector& y) {
    return model_of(y, R_s_ohm, config.machine.pole_pairs, cold_C, psi_Wb, 30.0 * start.L_l_H);
  };
  const auto misfit = [&](const Vector& y) {
    const est::SteadyModel steady(est::knowledge_of(build(y)));
    Vector r = Vector::Constant(2 * static_cast<Eigen::Index>(points.size()), 1.0);
    for (std::size_t k = 0; k < points.size(); ++k) {
      const auto drawn = steady.current(points[k].V, points[k].w_e, points[k].w_r, cold_C);
      if (!drawn) continue;
      const std::complex<double> d = (*drawn - points[k].i) / std::abs(points[k].i);
      r.segment<2>(2 * static_cast<Eigen::Index>(k)) << d.real(), d.imag();
    }
    return r;
  };
  Vector r = misfit(x);
  double damping = 1e-3;
  for (int round = 0; round < 60; ++round) {
    Eigen::MatrixXd J(r.size(), kUnknowns);
    for (int k = 0; k < kUnknowns; ++k) {
      Vector moved = x;
      moved[k] += 1e-5;
      J.col(k) = (misfit(moved) - r) / 1e-5;
    }
    Eigen::MatrixXd A = J.transpose() * J;
    A.diagonal() *= 1.0 + damping;
    const Vector step = A.ldlt().solve(J.transpose() * r).cwiseMax(-0.5).cwiseMin(0.5), next = x - step,
                 there = misfit(next);
    if (there.squaredNorm() < r.squaredNorm()) {
      const bool done = r.norm() - there.norm() < 1e-6 * r.norm();
      x = next;
      r = there;
      damping *= 0.3;
      if (done) break;
    } else {
      damping *= 5.0;
    }
  }
  FittedModel out;
  out.model = build(x);
  const auto bars = [&](double C) { return at(config, rated_Hz, rated_V, 0.01, C).R_r_ohm; };
  out.model.effects.push_back(
      {"rotor_heating",
       "by winding temperature",
       {{"per_K", parameter((bars(cold_C + 100.0) / bars(cold_C) - 1.0) / 100.0, "1/K")},
        {"reference_C", {cold_C, cold_C, cold_C, "C", "truth"}}}});
  out.rms_share = std::sqrt(r.squaredNorm() / static_cast<double>(points.size()));
  out.points = static_cast<int>(points.size());
  return out;
}

}  // namespace imrig::test
