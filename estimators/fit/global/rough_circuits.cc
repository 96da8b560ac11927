#include "estimators/fit/global/rough_circuits.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numeric>

#include "estimators/fit/data_nominal.h"
#include "estimators/fit/start_guess.h"
#include "estimators/fit/steady_windows.h"
#include "estimators/model/steady_state.h"
#include "rig/base/error.h"

namespace imrig::est {

namespace {

using Circuit = MachineParameters<double>;

constexpr std::size_t kMostPoints = 48;                // a start needs no more
constexpr std::size_t kSpread = 6;                     // points over the load that circuits are made from
constexpr double kWorst = 4.0;                         // of one point's mismatch: a bad point must not decide
constexpr double kAlike = 0.1;                         // of every logarithm
constexpr double kUncommon = 0.01;                     // of the squared logarithms, a point
constexpr double kCommonLeakage = 0.08;                // L_l over L_m; R_s and R_r are alike
constexpr std::array kStatorShares{0.01, 0.03, 0.08};  // R_s over Z, where nothing tells it

// Level of the impedance, and the angular frequency it belongs to.
struct Level {
  double Z_ohm = kMissing, w_rad_s = kMissing;
  bool known() const { return std::isfinite(Z_ohm) && Z_ohm > 0.0 && w_rad_s > 0.0; }
};

bool turns(const Record& record) {
  return !record.holdout && record.kind != RecordKind::kDc && record.kind != RecordKind::kStandstill;
}

std::vector<std::size_t> series_of(const DataSet& data) {
  std::vector<std::size_t> out;
  for (std::size_t k = 0; k < data.records.size(); ++k) {
    if (turns(data.records[k]) && data.records[k].kind != RecordKind::kPoints) out.push_back(k);
  }
  return out;
}

bool whole(const SteadyPoint& p) {
  return p.v_peak_V > 0.0 && p.f_Hz > 0.0 && p.i_peak_A > 0.0 && std::isfinite(p.speed_rad_s);
}

std::vector<SteadyPoint> all_points(const DataSet& data, int threads) {
  std::vector<SteadyPoint> all = steady_points(data, series_of(data), threads);
  for (const Record& record : data.records) {
    if (turns(record)) all.insert(all.end(), record.points.begin(), record.points.end());
  }
  std::erase_if(all, [](const SteadyPoint& p) { return !whole(p); });
  for (SteadyPoint& p : all) {
    if (!std::isfinite(p.p_in_W)) p.p_in_W = 1.5 * p.v_peak_V * p.i_peak_A * p.power_factor;
  }
  if (all.size() <= kMostPoints) return all;
  std::vector<SteadyPoint> out;
  for (std::size_t k = 0; k < kMostPoints; ++k) out.push_back(all[k * all.size() / kMostPoints]);
  return out;
}

Level level_of(const std::vector<SteadyPoint>& points) {
  Level out;
  double most = -1.0;
  for (const SteadyPoint& p : points) {
    const double size = std::isfinite(p.p_in_W) ? std::abs(p.p_in_W) : 0.0;
    if (size <= most) continue;
    most = size;
    out = {p.v_peak_V / p.i_peak_A, 2.0 * kPi * p.f_Hz};
  }
  return out;
}

// Where nothing is steady: the middle one of the records' means.
Level level_of_records(const DataSet& data) {
  std::vector<Level> all;
  for (const std::size_t k : series_of(data)) {
    try {
      const MeanConditions c = mean_conditions(to_frame(data.records[k].series, data.pole_pairs));
      const Level level{c.v_peak_V / c.i_peak_A, 2.0 * kPi * std::abs(c.f_Hz)};
      if (level.known()) all.push_back(level);
    } catch (const Error&) {
      // The fit will say what is wrong with it.
    }
  }
  if (all.empty()) return {};
  std::sort(all.begin(), all.end(), [](const Level& a, const Level& b) { return a.Z_ohm < b.Z_ohm; });
  return all[all.size() / 2];
}

std::complex<double> measured_current(const SteadyPoint& p) {
  const double active = p.p_in_W / (1.5 * p.v_peak_V * p.i_peak_A);
  return std::polar(p.i_peak_A, -std::acos(std::clamp(active, -1.0, 1.0)));
}

double mismatch(const Circuit& theta, const std::vector<SteadyPoint>& points, int pole_pairs) {
  double sum = 0.0;
  for (const SteadyPoint& p : points) {
    const auto s =
        steady_state(theta, pole_pairs, p.v_peak_V, 2.0 * kPi * p.f_Hz, pole_pairs * p.speed_rad_s);
    const std::complex<double> model(s.i_s.re, s.i_s.im);
    const double size = std::log(std::abs(model) / p.i_peak_A);
    const double angle = std::isfinite(p.p_in_W) ? std::arg(model / measured_current(p)) : 0.0;
    sum += std::min(kWorst, size * size + angle * angle);
  }
  const double leakage = std::log(theta.L_l / (kCommonLeakage * theta.L_m)),
               resistance = std::log(theta.R_s / theta.R_r);
  return sum + kUncommon * static_cast<double>(points.size()) * (leakage * leakage + resistance * resistance);
}

// Some of the points, spread over the power factor: from no load to locked.
std::vector<SteadyPoint> spread(std::vector<SteadyPoint> points) {
  std::erase_if(points, [](const SteadyPoint& p) { return !std::isfinite(p.p_in_W); });
  std::sort(points.begin(), points.end(), [](const SteadyPoint& a, const SteadyPoint& b) {
    return std::arg(measured_current(a)) < std::arg(measured_current(b));
  });
  std::vector<SteadyPoint> out;
  const std::size_t n = std::min(kSpread, points.size());
  for (std::size_t k = 0; k < n; ++k) out.push_back(points[(2 * k + 1) * points.size() / (2 * n)]);
  return out;
}

std::vector<Circuit> candidates(const std::vector<SteadyPoint>& points, const Level& level, double R_s,
                                int pole_pairs) {
  std::vector<double> resistances;
  for (const double share : kStatorShares) resistances.push_back(share * level.Z_ohm);
  if (std::isfinite(R_s)) resistances = {R_s};
  std::vector<Circuit> all;
  const auto add = [&](const std::vector<Circuit>& more) { all.insert(all.end(), more.begin(), more.end()); };
  const double Z = level.Z_ohm, w = level.w_rad_s;
  for (const double R : resistances) {
    all.push_back({R, 0.03 * Z, 0.18 * Z / w, 2.2 * Z / w});
    add(guesses_from_impedance(Z, w, R));
    for (const SteadyPoint& p : spread(points)) add(guesses_from_point(p, pole_pairs, R));
  }
  return all;
}

void hold(const std::array<double, 4>& held, Circuit& theta) {
  const std::array places{&theta.R_s, &theta.R_r, &theta.L_l, &theta.L_m};
  for (std::size_t m = 0; m < places.size(); ++m) {
    if (std::isfinite(held[m])) *places[m] = held[m];
  }
}

bool alike(const Circuit& a, const Circuit& b) {
  const auto near = [](double x, double y) { return std::abs(std::log(x / y)) < kAlike; };
  return near(a.R_s, b.R_s) && near(a.R_r, b.R_r) && near(a.L_l, b.L_l) && near(a.L_m, b.L_m);
}

}  // namespace

std::vector<MachineParameters<double>> rough_circuits(const DataSet& data, const std::array<double, 4>& held,
                                                      std::size_t most, int threads) {
  const std::vector<SteadyPoint> points = all_points(data, threads);
  Level level = level_of(points);
  if (!level.known()) level = level_of_records(data);
  if (!level.known()) return {};
  std::vector<Circuit> all = candidates(points, level, held[0], data.pole_pairs);
  for (Circuit& theta : all) hold(held, theta);
  std::vector<double> off(all.size());
  for (std::size_t k = 0; k < all.size(); ++k) off[k] = mismatch(all[k], points, data.pole_pairs);
  std::vector<std::size_t> order(all.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return off[a] < off[b]; });
  std::vector<Circuit> best;
  for (const std::size_t k : order) {
    const bool known =
        std::any_of(best.begin(), best.end(), [&](const Circuit& c) { return alike(c, all[k]); });
    if (!known && best.size() < most) best.push_back(all[k]);
  }
  return best;
}

}  // namespace imrig::est
