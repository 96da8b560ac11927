#include "estimators/fit/losses/core_loss.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <set>

#include "estimators/fit/maps/linear_fit.h"

namespace imrig::est {

namespace {

constexpr std::size_t kFewestPoints = 12;
constexpr std::size_t kFolds = 5;
constexpr double kPowerPart = 3e-3;  // what gains and phase leave of a power
constexpr double kSlipPart = 1e-2;   // likewise of the torque that the slip says
constexpr double kFloor_W = 0.1;
constexpr const char* kHeldAtZero = "held at its bound, zero: it came out negative";
constexpr std::array<double, 5> kFluxExponents{1.6, 1.8, 2.0, 2.2, 2.4};
constexpr std::array<double, 3> kDragExponents{1.0, 1.5, 2.0};
constexpr std::array<double, 5> kRiseExponents{2.0, 2.5, 3.0, 3.5, 4.0};
enum Column : Eigen::Index {
  kHysteresis,
  kEddy,
  kCoulomb,
  kViscous,
  kWindage,
  kDrag,
  kConductance,
  kColumns
};

double shaft_rad_s(const NoLoadPoint& p, int pole_pairs) { return (p.w_e - p.w_s) / pole_pairs; }

struct Rows {
  Eigen::MatrixXd A;
  Eigen::VectorXd y, sigma;
  std::vector<std::size_t> cluster;
};

// Two rows a point, both in watts: the power, and the torque that the slip says times synchronous speed.
Rows rows_of(const std::vector<NoLoadPoint>& points, int pole_pairs, const CoreLossLaw& law) {
  const auto n = static_cast<Eigen::Index>(points.size());
  Rows rows{Eigen::MatrixXd::Zero(2 * n, kColumns), Eigen::VectorXd::Zero(2 * n), Eigen::VectorXd(2 * n), {}};
  for (Eigen::Index k = 0; k < n; ++k) {
    const NoLoadPoint& p = points[static_cast<std::size_t>(k)];
    const double w_M = shaft_rad_s(p, pole_pairs), synchronous = p.w_e / pole_pairs;
    const double w = p.w_e / law.w_0, psi = law.iron_share(p.psi_r_Wb);
    Eigen::RowVectorXd torque = Eigen::RowVectorXd::Zero(kColumns);
    torque[kCoulomb] = synchronous;
    torque[kViscous] = synchronous * w_M;
    torque[kWindage] = synchronous * w_M * w_M;
    torque[kDrag] = synchronous * p.I_A * p.I_A * std::pow(w_M, law.drag_exponent - 1.0);
    rows.A.row(2 * k) = torque;
    rows.A(2 * k, kHysteresis) = w * std::pow(psi, law.exponent);
    rows.A(2 * k, kEddy) = w * w * psi * psi;
    rows.y[2 * k] = p.P_rotor_W;
    rows.sigma[2 * k] = std::hypot(kFloor_W, kPowerPart * p.input_W);
    const double per_slip = 1.5 * p.w_e * p.psi_r_Wb * p.psi_r_Wb / p.kappa;
    rows.A.row(2 * k + 1) = torque;
    rows.A(2 * k + 1, kConductance) = -per_slip * p.w_s;
    // In watts of air-gap power, with a typical R_r such that the power's own size sets the scale.
    const double watts_per_slip = p.w_s != 0.0 ? p.P_rotor_W / std::abs(p.w_s) : 0.0;
    rows.sigma[2 * k + 1] =
        std::hypot(kFloor_W, std::hypot(kSlipPart * p.P_rotor_W, watts_per_slip * p.slip_sigma));
    rows.cluster.insert(rows.cluster.end(), 2, static_cast<std::size_t>(k));
  }
  return rows;
}

struct Solution {
  std::array<double, kColumns> value{};
  std::array<double, kColumns> half{};  // of the 95 % interval
  double chi2 = std::numeric_limits<double>::infinity();
};

// Least squares whose coefficients may not be negative: what comes out most negative goes, and again.
std::optional<Solution> solve(const Rows& rows) {
  std::vector<Eigen::Index> in(kColumns);
  std::iota(in.begin(), in.end(), 0);
  while (!in.empty()) {
    Eigen::MatrixXd A(rows.A.rows(), static_cast<Eigen::Index>(in.size()));
    for (std::size_t k = 0; k < in.size(); ++k) A.col(static_cast<Eigen::Index>(k)) = rows.A.col(in[k]);
    LinearFit fit;
    try {
      fit = linear_fit(A, rows.y, rows.sigma, rows.cluster);
    } catch (const std::exception&) {
      return std::nullopt;
    }
    Eigen::Index worst = 0;
    Eigen::VectorXd share = fit.c;
    for (Eigen::Index k = 0; k < share.size(); ++k) share[k] *= A.col(k).cwiseAbs().mean();
    if (share.minCoeff(&worst) < 0.0) {
      in.erase(in.begin() + worst);
      continue;
    }
    Solution out;
    out.chi2 = fit.residual.cwiseQuotient(rows.sigma).squaredNorm();
    for (std::size_t k = 0; k < in.size(); ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      out.value[static_cast<std::size_t>(in[k])] = fit.c[at];
      out.half[static_cast<std::size_t>(in[k])] = fit.t_975() * std::sqrt(fit.covariance(at, at));
    }
    return out;
  }
  return std::nullopt;
}

void take(CoreLossLaw& law, const Solution& s, std::size_t records) {
  const auto parameter = [&](Column c, const char* unit) {
    const auto k = static_cast<std::size_t>(c);
    if (!(s.half[k] > 0.0)) return Parameter{0.0, kMissing, kMissing, unit, kHeldAtZero};
    return Parameter{s.value[k], std::max(0.0, s.value[k] - s.half[k]), s.value[k] + s.half[k], unit,
                     fmt::format("no-load power and slip, {} records", records)};
  };
  law.hysteresis_W = parameter(kHysteresis, "W");
  law.eddy_W = parameter(kEddy, "W");
  law.coulomb_Nm = parameter(kCoulomb, "Nm");
  law.viscous_Nms = parameter(kViscous, "Nm s");
  law.windage_Nms2 = parameter(kWindage, "Nm s^2");
  law.drag = parameter(kDrag, "Nm/A^2");
  const double g = s.value[kConductance], half = s.half[kConductance];
  law.R_r = {};
  if (g > half) law.R_r = {1.0 / g, 1.0 / (g + half), 1.0 / (g - half), "ohm", law.drag.found};
}

// 1/kappa = 1 + g (psi/psi_0)^n.
void fit_rise(const std::vector<NoLoadPoint>& points, CoreLossLaw& law) {
  double least = std::numeric_limits<double>::infinity();
  for (const double n : kRiseExponents) {
    double xx = 0.0, xy = 0.0, yy = 0.0;
    for (const auto& p : points) {
      const double x = std::pow(p.psi_r_Wb / law.psi_0, n), y = 1.0 / p.kappa - 1.0;
      xx += x * x, xy += x * y, yy += y * y;
    }
    const double g = std::max(0.0, xy / xx), left = yy - 2.0 * g * xy + g * g * xx;
    if (!(left < least)) continue;
    least = left;
    law.rise = g;
    law.rise_exponent = n;
  }
}

std::optional<CoreLossLaw> physical_fit(const std::vector<NoLoadPoint>& points, int pole_pairs) {
  CoreLossLaw law;
  law.synchronous_per_w_e = 1.0 / pole_pairs;
  for (const auto& p : points) {
    law.w_0 = std::max(law.w_0 == 1.0 ? 0.0 : law.w_0, p.w_e);
    law.psi_0 = std::max(law.psi_0 == 1.0 ? 0.0 : law.psi_0, p.psi_r_Wb);
  }
  fit_rise(points, law);
  double least = std::numeric_limits<double>::infinity();
  std::optional<CoreLossLaw> best;
  for (const double a : kFluxExponents) {
    for (const double p : kDragExponents) {
      law.exponent = a;
      law.drag_exponent = p;
      const auto solution = solve(rows_of(points, pole_pairs, law));
      if (!solution || solution->chi2 >= least) continue;
      least = solution->chi2;
      take(law, *solution, points.size());
      best = law;
    }
  }
  return best;
}

TanhNetwork network_of(const std::vector<NoLoadPoint>& points) {
  Eigen::MatrixXd x(static_cast<Eigen::Index>(points.size()), 2);
  Eigen::VectorXd y(x.rows());
  for (Eigen::Index k = 0; k < x.rows(); ++k) {
    const NoLoadPoint& p = points[static_cast<std::size_t>(k)];
    x.row(k) << p.psi_r_Wb, p.w_e;
    y[k] = p.P_rotor_W;
  }
  return train(x, y);
}

// Folds go through the points in turn, so that each holds all frequencies and fluxes.
HeldOut held_out(const std::vector<NoLoadPoint>& points, int pole_pairs) {
  double network2 = 0.0, physics2 = 0.0, network_part2 = 0.0, physics_part2 = 0.0;
  for (std::size_t fold = 0; fold < kFolds; ++fold) {
    std::vector<NoLoadPoint> seen, unseen;
    for (std::size_t k = 0; k < points.size(); ++k) (k % kFolds == fold ? unseen : seen).push_back(points[k]);
    const auto law = physical_fit(seen, pole_pairs);
    if (!law) return {};
    const TanhNetwork net = network_of(seen);
    for (const auto& p : unseen) {
      const double by_net = net.at(p.psi_r_Wb, p.w_e) - p.P_rotor_W;
      const double by_law = law->rotor_W(p, pole_pairs) - p.P_rotor_W;
      network2 += by_net * by_net;
      physics2 += by_law * by_law;
      network_part2 += std::pow(by_net / p.P_rotor_W, 2);
      physics_part2 += std::pow(by_law / p.P_rotor_W, 2);
    }
  }
  const double n = static_cast<double>(points.size());
  return {std::sqrt(network2 / n), std::sqrt(physics2 / n), std::sqrt(network_part2 / n),
          std::sqrt(physics_part2 / n)};
}

// (20) over the points whose core loss stands out of the map, and its network.
void map_R_c(CoreLossResult& out) {
  std::vector<std::array<double, 3>> rows;
  for (const auto& p : out.points) {
    const double core = p.P_rotor_W - out.network.at(0.0, p.w_e);
    if (core > 0.02 * p.P_rotor_W)
      rows.push_back({p.psi_r_Wb, p.w_e, 1.5 * std::pow(p.w_e * p.psi_r_Wb, 2) / core});
  }
  if (rows.size() < kFewestPoints) return;
  Eigen::MatrixXd x(static_cast<Eigen::Index>(rows.size()), 2);
  Eigen::VectorXd y(x.rows());
  for (Eigen::Index k = 0; k < x.rows(); ++k) {
    const auto& row = rows[static_cast<std::size_t>(k)];
    x.row(k) << row[0], row[1];
    y[k] = std::log(row[2]);
  }
  out.R_c_network = train(x, y);
  out.has_R_c_network = true;
}

std::string unfit(const std::vector<NoLoadPoint>& points) {
  if (points.size() < kFewestPoints)
    return fmt::format("{} steady no-load records; {} over frequency and voltage are needed", points.size(),
                       kFewestPoints);
  std::set<long> frequencies;
  double low = std::numeric_limits<double>::infinity(), high = 0.0;
  for (const auto& p : points) {
    frequencies.insert(std::lround(p.w_e));
    low = std::min(low, p.psi_r_Wb);
    high = std::max(high, p.psi_r_Wb);
  }
  if (frequencies.size() < 2)
    return "the no-load records have one frequency: friction cannot be told from windage";
  if (high < 1.5 * low) return "the no-load records have one flux: core loss cannot be told from friction";
  return "";
}

}  // namespace

std::optional<CoreLossLaw> fit_core_law(const std::vector<NoLoadPoint>& points, int pole_pairs) {
  return unfit(points).empty() ? physical_fit(points, pole_pairs) : std::nullopt;
}

double CoreLossLaw::iron_share(double psi) const {
  const double x = psi / psi_0;
  return x * std::sqrt(1.0 + rise * std::pow(x, rise_exponent));
}

double CoreLossLaw::core_W(double w_e, double psi) const {
  const double w = w_e / w_0, x = iron_share(psi);
  return hysteresis_W.value * w * std::pow(x, exponent) + eddy_W.value * w * w * x * x;
}

double CoreLossLaw::R_c(double w_e, double psi) const {
  const double core = core_W(w_e, psi);
  return core > 0.0 ? 1.5 * w_e * w_e * psi * psi / core : std::numeric_limits<double>::infinity();
}

double CoreLossLaw::friction_Nm(double w_M) const {
  return coulomb_Nm.value + w_M * (viscous_Nms.value + w_M * windage_Nms2.value);
}

double CoreLossLaw::rotor_W(const NoLoadPoint& p, int pole_pairs) const {
  const double w_M = shaft_rad_s(p, pole_pairs);
  const double T = friction_Nm(w_M) + drag.value * p.I_A * p.I_A * std::pow(w_M, drag_exponent - 1.0);
  return core_W(p.w_e, p.psi_r_Wb) + T * p.w_e / pole_pairs;
}

CoreLossResult fit_core_loss(const std::vector<NoLoadPoint>& points, int pole_pairs) {
  CoreLossResult out;
  out.points = points;
  out.failure = unfit(points);
  if (!out.failure.empty()) return out;
  const auto law = physical_fit(points, pole_pairs);
  if (!law) {
    out.failure = "the no-load records do not separate core loss from friction";
    return out;
  }
  out.physics = *law;
  const std::array<std::pair<const char*, const Parameter*>, 6> parts{{{"hysteresis", &law->hysteresis_W},
                                                                       {"eddy", &law->eddy_W},
                                                                       {"coulomb", &law->coulomb_Nm},
                                                                       {"viscous", &law->viscous_Nms},
                                                                       {"windage", &law->windage_Nms2},
                                                                       {"drag", &law->drag}}};
  for (const auto& [name, part] : parts) {
    if (part->found == kHeldAtZero) out.notes.push_back(fmt::format("losses: {} is {}", name, kHeldAtZero));
  }
  if (!law->R_r.known()) out.notes.emplace_back("losses: the slip does not determine R_r");
  out.network = network_of(points);
  map_R_c(out);
  double physics2 = 0.0, network2 = 0.0;
  for (const auto& p : points) {
    physics2 += std::pow(law->rotor_W(p, pole_pairs) - p.P_rotor_W, 2);
    network2 += std::pow(out.network.at(p.psi_r_Wb, p.w_e) - p.P_rotor_W, 2);
  }
  const double n = static_cast<double>(points.size());
  out.fitted_physics_W = std::sqrt(physics2 / n);
  out.fitted_network_W = std::sqrt(network2 / n);
  out.held_out = held_out(points, pole_pairs);
  return out;
}

}  // namespace imrig::est
