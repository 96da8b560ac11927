#include "estimators/fit/maps/locked_sweep.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "estimators/fit/maps/linear_fit.h"
#include "estimators/fit/student_t.h"

namespace imrig::est {

namespace {

constexpr std::size_t kFewestPoints = 4;
constexpr std::size_t kFewestForDrift = 8;
constexpr double kLeastTime_s = 1.0;  // that a sweep must take for a drift
constexpr double kSameFrequency = 0.01;

// Solves one point; says why where it cannot.
void solve(LockedPoint& point, const SteadyPhasor& p, double R_s, double L_m) {
  const std::complex<double> Z = p.v / p.i;
  const double a = Z.real() - R_s, x = p.w_e * L_m;
  if (!(a > 0.0)) {
    point.left_out = fmt::format("its resistance {:.4g} ohm is not above R_s", Z.real());
    return;
  }
  if (std::isinf(x)) {
    point.R_r_ohm = a;
    point.L_l_H = Z.imag() / p.w_e;
    return;
  }
  const double root = x * x - 4.0 * a * a;
  if (root < 0.0) {
    point.left_out = "its resistance is above half the magnetizing reactance: no rotor resistance explains it";
    return;
  }
  point.R_r_ohm = x * (x - std::sqrt(root)) / (2.0 * a);
  point.L_l_H = (Z.imag() - x * point.R_r_ohm * point.R_r_ohm / (point.R_r_ohm * point.R_r_ohm + x * x)) / p.w_e;
}

// A sweep ends where a frequency comes again (repeats, taken one after the other, belong together).
std::size_t assign_sweeps(const DataSet& data, std::vector<LockedPoint>& points) {
  std::size_t sweep = 0;
  std::vector<double> seen;
  for (auto& point : points) {
    const bool repeat = !data.records[point.record].repeat_of.empty();
    const bool again = std::any_of(seen.begin(), seen.end(), [&](double w) {
      return std::abs(w - point.w_s) < kSameFrequency * point.w_s;
    });
    if (again && !repeat) {
      ++sweep;
      seen.clear();
    }
    seen.push_back(point.w_s);
    point.sweep = sweep;
  }
  return sweep + 1;
}

struct Columns {
  Eigen::MatrixXd A;
  Eigen::VectorXd y;
  std::vector<std::size_t> cluster;
  std::vector<const LockedPoint*> rows;
};

// Columns: one intercept a sweep, then the drifts, k_6 last.
Columns columns_of(const std::vector<LockedPoint>& points, std::size_t sweeps) {
  Columns c;
  constexpr double kEver = 1e300;
  std::vector<double> t_mean(sweeps, 0.0), first(sweeps, kEver), last(sweeps, -kEver);
  std::vector<std::size_t> count(sweeps, 0);
  for (const auto& p : points) {
    if (!p.left_out.empty()) continue;
    c.rows.push_back(&p);
    t_mean[p.sweep] += p.time_s;
    first[p.sweep] = std::min(first[p.sweep], p.time_s);
    last[p.sweep] = std::max(last[p.sweep], p.time_s);
    ++count[p.sweep];
  }
  std::vector<Eigen::Index> drift(sweeps, -1);
  auto next = static_cast<Eigen::Index>(sweeps);
  for (std::size_t g = 0; g < sweeps; ++g) {
    if (count[g] > 0) t_mean[g] /= static_cast<double>(count[g]);
    const bool timed = last[g] - first[g] > kLeastTime_s;  // imported files have no common clock
    if (count[g] >= kFewestForDrift && timed) drift[g] = next++;
  }
  const auto n = static_cast<Eigen::Index>(c.rows.size());
  c.A = Eigen::MatrixXd::Zero(n, next + 1);
  c.y.resize(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const LockedPoint& p = *c.rows[static_cast<std::size_t>(k)];
    c.A(k, static_cast<Eigen::Index>(p.sweep)) = 1.0;
    if (drift[p.sweep] >= 0) c.A(k, drift[p.sweep]) = p.time_s - t_mean[p.sweep];
    c.A(k, next) = p.w_s;
    c.y[k] = p.R_r_ohm;
    c.cluster.push_back(static_cast<std::size_t>(k));
  }
  return c;
}

// R_1 against the winding's temperature.
void temperature_line(LockedResult& out) {
  const auto R_1 = [&](const LockedSweep& sweep) { return out.bar.known() ? sweep.R_1_bar : sweep.R_1; };
  std::vector<const LockedSweep*> known;
  for (const auto& sweep : out.sweeps) {
    if (std::isfinite(sweep.stator_C) && sweep.R_1.known()) known.push_back(&sweep);
  }
  if (known.size() < 2) return;
  const auto by_temperature = [](const LockedSweep* a, const LockedSweep* b) { return a->stator_C < b->stator_C; };
  const auto [cold, hot] = std::minmax_element(known.begin(), known.end(), by_temperature);
  out.reference_C = (*cold)->stator_C;
  if ((*hot)->stator_C - out.reference_C < kLeastSpread_C) return;
  const auto n = static_cast<Eigen::Index>(known.size());
  Eigen::MatrixXd A(n, 2);
  Eigen::VectorXd y(n), sigma(n);
  std::vector<std::size_t> cluster;
  for (Eigen::Index k = 0; k < n; ++k) {
    const LockedSweep& sweep = *known[static_cast<std::size_t>(k)];
    A.row(k) << 1.0, sweep.stator_C - out.reference_C;
    const Parameter found = R_1(sweep);
    y[k] = found.value;
    sigma[k] = std::max(0.5 * (found.ci95_high - found.ci95_low) / kNormal975, 1e-9 * y[k]);
    cluster.push_back(static_cast<std::size_t>(k));
  }
  const LinearFit fit = linear_fit(A, y, sigma, cluster);
  const std::string found = fmt::format("locked-like sweep, {} temperatures of the winding", n);
  const double R = fit.c[0], slope = fit.c[1];
  const double half_R = kNormal975 * std::sqrt(fit.covariance(0, 0));
  const double half = kNormal975 / R *
                      std::sqrt(std::max(0.0, fit.covariance(1, 1) - 2.0 * slope / R * fit.covariance(0, 1) +
                                                  slope * slope / (R * R) * fit.covariance(0, 0)));
  out.R_1 = {R, R - half_R, R + half_R, "ohm", found};
  out.per_K = {slope / R, slope / R - half, slope / R + half, "1/K", found};
}

}  // namespace

LockedResult fit_locked_sweeps(const DataSet& data, const std::vector<std::size_t>& records,
                               const ResistanceLine& R_s, double L_m, double gain_sigma) {
  LockedResult out;
  std::set<double> frequencies;
  for (const std::size_t k : records) {
    for (const SteadyPhasor& p : standing_phasors(data, k)) {
      LockedPoint point{k, 0, p.w_e, kMissing, kMissing, p.stator_C, p.time_s, std::abs(p.i), ""};
      solve(point, p, R_s.at(p.stator_C), L_m);
      if (point.left_out.empty()) frequencies.insert(std::round(p.w_e));
      out.points.push_back(point);
    }
  }
  if (frequencies.size() < kFewestPoints) {
    out.failure = fmt::format("{} different frequencies at standstill; a line over slip frequency needs {}",
                              frequencies.size(), kFewestPoints);
    return out;
  }
  if (std::isinf(L_m)) {
    out.notes.emplace_back(
        "L_m is not known: the locked-like sweep neglects the magnetizing branch, which makes R_r too small by (R_r/(w L_m))^2");
  }
  const std::size_t sweeps = assign_sweeps(data, out.points);
  const Columns c = columns_of(out.points, sweeps);
  const Eigen::VectorXd even = Eigen::VectorXd::Constant(c.y.size(), 1e-9 * c.y.mean());
  const LinearFit fit = linear_fit(c.A, c.y, even, c.cluster);
  const Eigen::Index last = fit.c.size() - 1;
  const auto parameter = [&](Eigen::Index k, const char* unit, const std::string& found) {
    const double half = std::hypot(fit.t_975() * std::sqrt(fit.covariance(k, k)), kNormal975 * gain_sigma * fit.c[k]);
    return Parameter{fit.c[k], fit.c[k] - half, fit.c[k] + half, unit, found};
  };
  out.k_6 = parameter(last, "ohm s", fmt::format("locked-like sweep, {} records in {} sweeps", c.rows.size(), sweeps));
  out.line_misfit_ohm = std::sqrt(fit.residual.squaredNorm() / static_cast<double>(fit.residual.size()));
  out.bar = fit_deep_bar(c.A, c.rows, sweeps, gain_sigma);
  for (std::size_t g = 0; g < sweeps; ++g) {
    LockedSweep sweep;
    double sum_C = 0.0, sum_A = 0.0;
    for (const auto* p : c.rows) {
      if (p->sweep != g) continue;
      ++sweep.records;
      sum_C += p->stator_C;
      sum_A += p->current_A;
    }
    if (sweep.records > 0) {
      sweep.stator_C = sum_C / static_cast<double>(sweep.records);
      sweep.current_A = sum_A / static_cast<double>(sweep.records);
      sweep.R_1 = parameter(static_cast<Eigen::Index>(g), "ohm", fmt::format("locked-like sweep, {} records", sweep.records));
    }
    if (out.bar.known()) sweep.R_1_bar = out.bar.sweeps[g].R_1;
    out.sweeps.push_back(sweep);
  }
  temperature_line(out);
  return out;
}

}  // namespace imrig::est
