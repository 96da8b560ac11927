#include "estimators/fit/points_fit.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "estimators/fit/points_problem.h"
#include "estimators/fit/points_search.h"
#include "estimators/model/output.h"
#include "rig/base/error.h"

namespace imrig::est {

namespace {

using Theta = MachineParameters<double>;
using Values = std::array<double, 4>;

constexpr std::array<const char*, 4> kNames{"R_s", "R_r", "L_l", "L_m"};
constexpr double kFlat = 0.25;  // relative sigma from which a parameter counts as not seen
constexpr int kMostPolePairs = 12;

Values as_array(const Theta& p) { return {p.R_s, p.R_r, p.L_l, p.L_m}; }

// Guesses from the least loaded point (its reactance is L_s) and the most loaded one (its slip and power give
// R_r).
std::vector<Theta> starts_from(const std::vector<SteadyPoint>& points, int pole_pairs, double R_s) {
  const auto slip = [&](const SteadyPoint& p) {
    return 1.0 - pole_pairs * p.speed_rad_s / (2.0 * kPi * p.f_Hz);
  };
  const auto by_slip = [&](const SteadyPoint& a, const SteadyPoint& b) {
    return std::abs(slip(a)) < std::abs(slip(b));
  };
  const auto [idle, loaded] = std::minmax_element(points.begin(), points.end(), by_slip);
  const auto current = [](const SteadyPoint& p) {
    return std::max(1e-6, p.i_peak_A > 0.0 ? p.i_peak_A : std::abs(p.p_in_W) / (1.5 * p.v_peak_V * 0.8));
  };
  const double L_s = idle->v_peak_V / current(*idle) / (2.0 * kPi * idle->f_Hz);
  const double Z = loaded->v_peak_V / current(*loaded);
  const double R_r = std::max(1e-3, std::abs(slip(*loaded))) * Z;
  std::vector<Theta> all;
  for (const double leakage : {0.04, 0.1, 0.22}) {
    for (const double stator : {0.01, 0.05}) {
      all.push_back({std::isfinite(R_s) ? R_s : stator * Z, R_r, leakage * L_s, (1.0 - leakage) * L_s});
    }
  }
  return all;
}

bool usable(const SteadyPoint& p) {
  const bool driven = p.v_peak_V > 0.0 && p.f_Hz > 0.0 && std::isfinite(p.speed_rad_s);
  const bool seen = p.i_peak_A > 0.0 || std::isfinite(p.p_in_W);
  return driven && seen;
}

// Throws when another number of pole pairs explains the speeds and the given one does not.
void check_pole_pairs(const std::vector<SteadyPoint>& points, int pole_pairs) {
  const auto typical_slip = [&](int candidate) {
    std::vector<double> slips;
    for (const auto& p : points) {
      const double w_e = 2.0 * kPi * p.f_Hz;
      if (std::abs(pole_pairs * p.speed_rad_s) > 0.1 * w_e)
        slips.push_back(std::abs(1.0 - candidate * p.speed_rad_s / w_e));
    }
    if (slips.empty()) return 0.0;
    std::sort(slips.begin(), slips.end());
    return slips[slips.size() / 2];
  };
  if (typical_slip(pole_pairs) < 0.15) return;
  for (int candidate = 1; candidate <= kMostPolePairs; ++candidate) {
    if (typical_slip(candidate) < 0.1) {
      throw Error("pole pairs",
                  fmt::format("the speeds contradict {} (typical slip {:.0f} %)", pole_pairs,
                              100.0 * typical_slip(pole_pairs)),
                  fmt::format("they fit pole_pairs = {} (typical slip {:.1f} %)", candidate,
                              100.0 * typical_slip(candidate)));
    }
  }
}

void add_sigmas(const PointsProblem& problem, bool fit_R_s, PointsFit& fit) {
  const PointsLinearization here = problem.linearize(fit.theta);
  const Values v = as_array(fit.theta);
  const Eigen::Index first = fit_R_s ? 0 : 1;
  const Eigen::Index n = 4 - first;
  const Eigen::Vector4d scale(v[0], v[1], v[2], v[3]);
  const Eigen::Matrix4d relative = scale.asDiagonal() * here.normal * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(relative.bottomRightCorner(n, n));
  const Eigen::VectorXd values = solver.eigenvalues().cwiseMax(1e-12 * solver.eigenvalues().maxCoeff());
  const Eigen::MatrixXd covariance =
      solver.eigenvectors() * values.cwiseInverse().asDiagonal() * solver.eigenvectors().transpose();
  const double dof = std::max(1.0, static_cast<double>(here.residuals) - static_cast<double>(n));
  fit.chi2_per_dof = here.error / dof;
  for (Eigen::Index a = 0; a < n; ++a) {
    const auto m = static_cast<std::size_t>(a + first);
    fit.sigma[m] = v[m] * std::sqrt(covariance(a, a) * std::max(1.0, fit.chi2_per_dof));
  }
  if (fit_R_s) return;
  const Eigen::VectorXd by_R_s = -covariance * relative.col(0).tail(3);
  for (std::size_t m = 1; m < 4; ++m) fit.per_R_s[m] = by_R_s[static_cast<Eigen::Index>(m - 1)] * v[m] / v[0];
}

void add_misfit(const PointsProblem& problem, PointsFit& fit) {
  double largest = 0.0, sum = 0.0;
  std::size_t n = 0;
  for (const auto& p : problem.points())
    largest = std::max(largest, std::isfinite(p.p_in_W) ? std::abs(p.p_in_W) : 0.0);
  for (const auto& measured : problem.points()) {
    PointMisfit m;
    m.speed_shift_rad_s = problem.speed_shift(fit.theta, measured);
    SteadyPoint shifted = measured;
    shifted.speed_rad_s += m.speed_shift_rad_s;
    m.predicted = predict_point(fit.theta, problem.pole_pairs(), shifted);
    m.current = (m.predicted.i_peak_A - measured.i_peak_A) / measured.i_peak_A;
    m.power = (m.predicted.p_in_W - measured.p_in_W) / largest;
    m.shaft_W =
        m.predicted.p_out_W -
        (std::isfinite(measured.p_out_W) ? measured.p_out_W : measured.torque_Nm * measured.speed_rad_s);
    for (const double relative : {m.current, m.power}) {
      if (!std::isfinite(relative)) continue;
      sum += relative * relative;
      ++n;
    }
    fit.misfit.push_back(m);
  }
  fit.nrmse = n > 0 ? std::sqrt(sum / static_cast<double>(n)) : kMissing;
}

// Friction and stray loss only take from the shaft: a circuit that leaves less than was measured there has
// too large a stator resistance.
void add_shaft_note(const PointsProblem& problem, bool fit_R_s, PointsFit& fit) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const auto& m : fit.misfit) {
    if (!std::isfinite(m.shaft_W)) continue;
    low = std::min(low, m.shaft_W);
    high = std::max(high, m.shaft_W);
  }
  if (low > high) return;
  fit.notes.push_back(fmt::format(
      "shaft power is not fitted where input power is known; predicted minus measured is {:.0f} to {:.0f} W",
      low, high));
  if (fit_R_s && low < -3.0 * problem.noise().power_W) {
    fit.notes.push_back(
        "more shaft power was measured than the fitted circuit leaves, so its R_s is too large to be true: "
        "losses that the circuit lacks "
        "have gone into it; give R_s by a dc record or a model");
  }
}

void add_notes(const PointsProblem& problem, bool fit_R_s, PointsFit& fit) {
  const Values v = as_array(fit.theta);
  add_shaft_note(problem, fit_R_s, fit);
  for (std::size_t m = 0; m < v.size(); ++m) {
    if (fit.on_bound[m])
      fit.notes.push_back(fmt::format("{} lies on its bound: the table does not show it", kNames[m]));
    if (fit.sigma[m] > kFlat * v[m]) {
      fit.notes.push_back(fmt::format("{} is hardly visible in this table: {:.4g} +- {:.0f} %", kNames[m],
                                      v[m], 196.0 * fit.sigma[m] / v[m]));
    }
  }
  if (fit.chi2_per_dof > 3.0) {
    fit.notes.push_back(fmt::format(
        "the base circuit does not describe the table to its noise (chi^2 per degree of freedom {:.3g}): "
        "it has no iron, friction or stray loss",
        fit.chi2_per_dof));
  }
}

}  // namespace

Noise points_noise(const std::vector<SteadyPoint>& points, const Noise& declared) {
  double power = 0.0, current = 0.0, torque = 0.0;
  for (const auto& p : points) {
    const double own = std::isfinite(p.p_in_W) ? p.p_in_W : 1.5 * p.v_peak_V * p.i_peak_A;
    if (std::isfinite(own)) power = std::max(power, std::abs(own));
    if (std::isfinite(p.i_peak_A)) current = std::max(current, p.i_peak_A);
    if (std::isfinite(p.torque_Nm)) torque = std::max(torque, std::abs(p.torque_Nm));
  }
  Noise noise = declared;
  if (!(noise.current_A > 0.0)) noise.current_A = 0.005 * std::max(current, 1e-9);
  if (!(noise.power_W > 0.0)) noise.power_W = 0.01 * std::max(power, 1e-9);
  if (!(noise.torque_Nm > 0.0)) noise.torque_Nm = 0.01 * std::max(torque, 1e-9);
  if (!(noise.speed_rad_s > 0.0)) noise.speed_rad_s = rad_s_of_rpm(0.5);
  return noise;
}

PointsFit fit_points(const std::vector<SteadyPoint>& points, const PointsOptions& options) {
  PointsFit fit;
  std::vector<SteadyPoint> rows;
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (!usable(points[k])) continue;
    rows.push_back(points[k]);
    fit.used.push_back(k);
  }
  const bool fit_R_s = !std::isfinite(options.R_s);
  if (2 * rows.size() < (fit_R_s ? 4u : 3u)) {
    fit.failure = fmt::format(
        "has {} usable points; at least 2 with voltage, frequency, speed, current and power are needed",
        rows.size());
    return fit;
  }
  check_pole_pairs(rows, options.pole_pairs);
  const PointsProblem problem(rows, points_noise(rows, options.noise), options.pole_pairs);
  auto starts = starts_from(rows, options.pole_pairs, options.R_s);
  starts.insert(starts.end(), options.starts.begin(), options.starts.end());
  PointsSearch search(problem, fit_R_s);
  double least = std::numeric_limits<double>::infinity();
  for (Theta theta : starts) {
    if (!fit_R_s) theta.R_s = options.R_s;
    const double error = search.minimum(theta);
    if (!(error < least)) continue;
    least = error;
    fit.theta = theta;
  }
  if (!std::isfinite(least)) {
    fit.failure = "no start leads to a circuit";
    return fit;
  }
  if (!search.polish(fit.theta)) fit.failure = "the fit did not settle";
  fit.on_bound = search.on_bound(fit.theta);
  add_sigmas(problem, fit_R_s, fit);
  add_misfit(problem, fit);
  add_notes(problem, fit_R_s, fit);
  return fit;
}

}  // namespace imrig::est
