#include "estimators/fit/maps/parameter_maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "estimators/fit/assemble.h"
#include "estimators/fit/maps/linear_fit.h"
#include "estimators/fit/maps/magnetizing_fit.h"
#include "estimators/fit/student_t.h"

namespace imrig::est {

namespace {

constexpr int kRounds = 4;                  // L_l, iron and L_m know of each other
constexpr double kStartLeakage = 0.09;      // of the no-load inductance
constexpr double kUnknownLeakage = 0.02;    // relative, when judging what it does to L_m
constexpr double kUnknownResistance = 5e-3;
constexpr double kGoodLm = 5e-3;            // relative sigma up to which a window speaks for L_m ...
constexpr double kGoodLl = 0.05;            // ... and for L_l
constexpr double kUnsaturated = 0.97;       // of L_0: where L_l is looked for
constexpr double kMapError = 1e-2;          // of the L_m map there
constexpr double kSwing = 0.866;            // a current along one axis saturates like a turning one of this part, sqrt(3/4):
                                            // its fundamental sees 3/4 of what the square of its peak takes off
constexpr double kTwoCurrents = 1.5;        // of locked-like sweeps that tell L_l(I) alone
constexpr double kLockedLeakage = 2e-3;     // relative, what a locked-like sweep's L_l may be off
constexpr std::size_t kFewestNoLoad = 8;
constexpr std::size_t kFewest = 6;
constexpr double kSaturatedPart = 0.9;

class Mapping {
 public:
  Mapping(const DataSet& data, const MapOptions& options) : data_(data), options_(options) {}

  ParameterMaps run(const std::vector<std::size_t>& used, const std::vector<ResistancePoint>& dc) {
    gains_ = gain_sigma(data_.accuracy);
    stator(dc);
    collect(used);
    for (int round = 0; round < kRounds; ++round) {
      evaluate();
      magnetizing();
      locked();
      leakage();
      iron();
    }
    out_.notes.insert(out_.notes.end(), out_.locked.notes.begin(), out_.locked.notes.end());
    out_.core = fit_core_loss(iron_points_, data_.pole_pairs);
    evaluate();
    rotor();
    judge();
    return std::move(out_);
  }

 private:
  void stator(const std::vector<ResistancePoint>& dc) {
    out_.R_s = resistance_line(dc, gains_);
    if (out_.R_s.failure.empty()) return;
    double weights = 0.0, sum = 0.0;
    for (const auto& point : dc) {
      const double w = 1.0 / std::max(1e-18, point.sigma_ohm * point.sigma_ohm);
      weights += w;
      sum += w * point.R_s_ohm;
    }
    const double R = weights > 0.0 ? sum / weights : options_.R_s_fallback;
    constant_R_s_ = R;
    out_.notes.push_back(fmt::format("R_s(T): {}; {:.4g} ohm is taken at every temperature", out_.R_s.failure, R));
  }
  double R_s(const SteadyPhasor& p) const {
    return out_.R_s.failure.empty() ? out_.R_s.at(p.stator_C) : constant_R_s_;
  }

  void collect(const std::vector<std::size_t>& used) {
    for (const std::size_t k : used) {
      const RecordKind kind = data_.records[k].kind;
      if (kind == RecordKind::kLockedSweep) {
        locked_records_.push_back(k);
      } else if (kind != RecordKind::kDc && kind != RecordKind::kPoints && kind != RecordKind::kStandstill) {
        for (auto& phasor : running_phasors(data_, k)) {
          MapPoint point;
          point.phasor = phasor;
          no_load_windows_ += kind == RecordKind::kNoLoad ? 1 : 0;
          out_.points.push_back(std::move(point));
        }
      }
    }
    L_l_start_ = options_.L_l_start;
    if (std::isfinite(L_l_start_) || out_.points.empty()) return;
    double largest = 0.0;  // reactance over speed at the lightest point
    for (const auto& point : out_.points)
      largest = std::max(largest, (point.phasor.v / point.phasor.i).imag() / point.phasor.w_e);
    L_l_start_ = kStartLeakage * largest;
  }

  double leakage_at(double I) const { return out_.L_l.known() ? out_.L_l.at(I) : L_l_start_; }
  double R_c(double w_e, double psi) const {
    return iron_ ? iron_->R_c(w_e, psi) : std::numeric_limits<double>::infinity();
  }
  bool no_load(const MapPoint& point) const {
    return data_.records[point.phasor.record].kind == RecordKind::kNoLoad;
  }
  double slip(const MapPoint& point) const { return point.phasor.slip_rad_s() / point.phasor.w_e; }

  void evaluate() {
    for (auto& point : out_.points) {
      const SteadyPhasor& p = point.phasor;
      const double L_l = leakage_at(std::abs(p.i));
      const double psi = circuit_state(p, R_s(p), L_l).psi_r_Wb;
      point.state = circuit_state(p, R_s(p), L_l, R_c(p.w_e, psi));
      if (out_.L_m.known()) point.kappa = rotor_share(point.state.L_m_H, out_.L_m.L_0.value, L_l);
    }
  }

  // Relative sigma of L_m at a window from what is not known of L_l and R_s.
  double doubt_of_L_m(const MapPoint& point) const {
    const SteadyPhasor& p = point.phasor;
    const double L_l = leakage_at(std::abs(p.i)), R = R_s(p);
    const double by_L = circuit_state(p, R, L_l * (1.0 + kUnknownLeakage)).L_m_H / point.state.L_m_H - 1.0;
    const double by_R = circuit_state(p, R * (1.0 + kUnknownResistance), L_l).L_m_H / point.state.L_m_H - 1.0;
    return std::hypot(by_L, by_R);
  }

  void magnetizing() {
    std::vector<MagnetizingSample> samples;
    for (auto& point : out_.points) {
      const bool light = no_load_windows_ >= kFewestNoLoad ? no_load(point) : std::abs(slip(point)) < options_.slip_rule;
      const double doubt = doubt_of_L_m(point);
      point.for_L_m = light && point.state.L_m_H > 0.0 && doubt < kGoodLm;
      if (point.for_L_m) samples.push_back({point.state.I_d_A, point.state.L_m_H, doubt, point.phasor.record});
    }
    out_.L_m = fit_magnetizing(samples, gains_);
  }

  // L_l for which the window's L_m is the map's, by secant steps.
  std::optional<double> leakage_of(const MapPoint& point) const {
    const SteadyPhasor& p = point.phasor;
    const auto off = [&](double L_l) {
      const CircuitState c = circuit_state(p, R_s(p), L_l);
      return c.L_m_H / out_.L_m.at(c.I_d_A) - 1.0;
    };
    double a = leakage_at(std::abs(p.i)), b = 1.02 * a, f_a = off(a), f_b = off(b);
    for (int round = 0; round < 20 && std::abs(f_b) > 1e-9; ++round) {
      if (f_a == f_b) return std::nullopt;
      const double next = b - f_b * (b - a) / (f_b - f_a);
      a = b, f_a = f_b, b = next, f_b = off(b);
    }
    return std::abs(f_b) < 1e-6 && b > 0.0 ? std::optional(b) : std::nullopt;
  }

  double doubt_of_L_l(const MapPoint& point, double L_l) const {
    const SteadyPhasor& p = point.phasor;
    const auto L_m = [&](double R, double L) { return circuit_state(p, R, L).L_m_H; };
    const double here = L_m(R_s(p), L_l);
    const double per_L = (L_m(R_s(p), 1.01 * L_l) / here - 1.0) / 0.01;
    const double by_R = L_m(R_s(p) * (1.0 + kUnknownResistance), L_l) / here - 1.0;
    return std::hypot(kMapError, by_R) / std::abs(per_L);
  }

  void leakage() {
    std::vector<LeakageRow> rows;
    for (std::size_t g = 0; g < out_.locked.bar.sweeps.size() && out_.locked.bar.known(); ++g) {
      const DeepBar::Sweep& sweep = out_.locked.bar.sweeps[g];
      const double sigma = std::hypot(sweep.L_l_sigma_H, kLockedLeakage * sweep.L_l_H);
      rows.push_back({kSwing * out_.locked.sweeps[g].current_A, sweep.L_l_H, sigma, data_.records.size() + g});
    }
    for (auto& point : out_.points) {
      point.for_L_l = false;
      point.L_l_H = kMissing;
      if (!out_.L_m.known() || out_.L_m.at(point.state.I_d_A) < kUnsaturated * out_.L_m.L_0.value || no_load(point)) continue;
      const auto L_l = leakage_of(point);
      if (!L_l) continue;
      const double doubt = doubt_of_L_l(point, *L_l);
      if (!(doubt < kGoodLl)) continue;
      point.L_l_H = *L_l;
      point.for_L_l = true;
      rows.push_back({std::abs(point.phasor.i), *L_l, doubt * *L_l, point.phasor.record});
    }
    fit_leakage(rows);
  }

  struct LeakageRow {
    double I_A, L_l_H, sigma_H;
    std::size_t cluster;
  };

  void fit_leakage(const std::vector<LeakageRow>& rows) {
    const bool two_currents = std::any_of(rows.begin(), rows.end(), [&](const LeakageRow& row) {
      return row.I_A > kTwoCurrents * rows.front().I_A && out_.locked.bar.known();
    });
    if (rows.size() < kFewest && !two_currents) return;
    LeakageMap map;
    map.lowest_A = std::numeric_limits<double>::infinity();
    map.highest_A = 0.0;
    const auto n = static_cast<Eigen::Index>(rows.size());
    Eigen::MatrixXd A(n, 2);
    Eigen::VectorXd y(n), sigma(n);
    std::vector<std::size_t> cluster;
    for (Eigen::Index k = 0; k < n; ++k) {
      const LeakageRow& row = rows[static_cast<std::size_t>(k)];
      A.row(k) << row.I_A, 1.0;
      y[k] = row.L_l_H;
      sigma[k] = row.sigma_H;
      cluster.push_back(row.cluster);
      map.lowest_A = std::min(map.lowest_A, row.I_A);
      map.highest_A = std::max(map.highest_A, row.I_A);
    }
    const LinearFit fit = linear_fit(A, y, sigma, cluster);
    const auto parameter = [&](Eigen::Index k, const char* unit) {
      const double half = std::hypot(fit.t_975() * std::sqrt(fit.covariance(k, k)), kNormal975 * gains_ * fit.c[k]);
      return Parameter{fit.c[k], fit.c[k] - half, fit.c[k] + half, unit, fmt::format("steady phasors and locked-like sweeps, {} points", n)};
    };
    map.k_4 = parameter(0, "H/A");
    map.k_5 = parameter(1, "H");
    map.misfit = std::sqrt(fit.residual.cwiseQuotient(y).squaredNorm() / static_cast<double>(n));
    out_.L_l = map;
  }

  void iron() {
    std::vector<NoLoadPoint> points;
    for (const auto& point : out_.points) {
      if (!no_load(point)) continue;
      const SteadyPhasor& p = point.phasor;
      NoLoadPoint row;
      row.record = p.record;
      row.w_e = p.w_e;
      row.w_s = p.slip_rad_s();
      row.slip_sigma = p.slip_sigma;
      row.psi_r_Wb = point.state.psi_r_Wb;
      row.I_A = std::abs(p.i);
      row.kappa = out_.L_m.known() ? rotor_share(point.state.L_m_H, out_.L_m.L_0.value, leakage_at(row.I_A)) : 1.0;
      row.input_W = p.input_W();
      row.P_rotor_W = row.input_W - 1.5 * R_s(p) * row.I_A * row.I_A;
      points.push_back(row);
    }
    iron_points_ = std::move(points);
    iron_ = fit_core_law(iron_points_, data_.pole_pairs);
  }

  void locked() {
    if (locked_records_.empty()) {
      out_.locked.failure = "no locked-like sweep";
      return;
    }
    ResistanceLine R = out_.R_s;
    if (!R.failure.empty()) {
      R.R_20.value = constant_R_s_;
      R.alpha.value = 0.0;
    }
    const double L_m = out_.L_m.known()                     ? out_.L_m.L_0.value
                       : std::isfinite(options_.L_m_given) ? options_.L_m_given
                                                           : std::numeric_limits<double>::infinity();
    out_.locked = fit_locked_sweeps(data_, locked_records_, R, L_m, gains_);
  }

  void rotor() {
    RotorMap& map = out_.R_r;
    const LockedResult& locked = out_.locked;
    if (locked.k_6.known()) {
      map.k_6 = locked.k_6;
    } else {
      out_.notes.push_back("k_6: " + locked.failure + "; R_r is taken as free of skin effect");
    }
    map.bar = locked.bar;
    std::vector<const MapPoint*> rows;
    for (auto& point : out_.points) {
      point.for_R_r = std::abs(slip(point)) > options_.slip_rule && point.state.R_r_ohm > 0.0;
      if (point.for_R_r) rows.push_back(&point);
    }
    if (!locked.R_1.known() && rows.size() < kFewest) {
      if (!locked.sweeps.empty() && locked.sweeps.front().R_1.known()) {
        map.R_1 = map.bar.known() ? locked.sweeps.front().R_1_bar : locked.sweeps.front().R_1;
        map.reference_C = locked.sweeps.front().stator_C;
      }
      return;
    }
    if (rows.size() >= kFewest) return fit_rotor(rows);
    map.R_1 = locked.R_1;
    map.per_K = locked.per_K;
    map.reference_C = locked.reference_C;
  }

  void fit_rotor(const std::vector<const MapPoint*>& rows) {
    if (rows.size() < kFewest) return;
    RotorMap& map = out_.R_r;
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const auto* point : rows) {
      if (!std::isfinite(point->phasor.stator_C)) continue;
      low = std::min(low, point->phasor.stator_C);
      high = std::max(high, point->phasor.stator_C);
    }
    // What the temperature does comes from sweeps where there are several; else from the running motor, whose cage
    // is warmer than its winding. R_1 itself is the running motor's, (14): a straight line over 5 to 120 Hz of a
    // bar's curve passes below its end at small slip, and what is left of a bar's bend at running slips is small.
    const bool given = out_.locked.per_K.known();
    const bool warms = !given && high - low > kLeastSpread_C;
    map.reference_C = std::isfinite(low) ? low : kMissing;
    const auto n = static_cast<Eigen::Index>(rows.size());
    Eigen::MatrixXd A = Eigen::MatrixXd::Ones(n, warms ? 2 : 1);
    Eigen::VectorXd y(n), sigma(n);
    std::vector<std::size_t> cluster;
    for (Eigen::Index k = 0; k < n; ++k) {
      const MapPoint& point = *rows[static_cast<std::size_t>(k)];
      y[k] = point.state.R_r_ohm / point.kappa;
      y[k] -= map.skin_ohm(point.phasor.slip_rad_s(), y[k]);
      if (given && std::isfinite(point.phasor.stator_C))
        y[k] /= 1.0 + out_.locked.per_K.value * (point.phasor.stator_C - low);
      sigma[k] = std::hypot(5e-3 * y[k], y[k] * point.phasor.slip_sigma / std::abs(point.phasor.slip_rad_s()));
      if (warms) A(k, 1) = std::isfinite(point.phasor.stator_C) ? point.phasor.stator_C - low : 0.0;
      cluster.push_back(point.phasor.record);
    }
    const LinearFit fit = linear_fit(A, y, sigma, cluster);
    const std::string found = fmt::format("steady phasors, {} windows", n);
    const double R = fit.c[0];
    const double half = std::hypot(fit.t_975() * std::sqrt(fit.covariance(0, 0)), kNormal975 * gains_ * R);
    map.R_1 = {R, R - half, R + half, "ohm", found};
    map.misfit = std::sqrt(fit.residual.cwiseQuotient(y).squaredNorm() / static_cast<double>(n));
    if (given) map.per_K = out_.locked.per_K;
    if (!warms) return;
    const double slope = fit.c[1] / R, wide = fit.t_975() * std::sqrt(fit.covariance(1, 1)) / R;
    map.per_K = {slope, slope - wide, slope + wide, "1/K", found};
  }

  // What a map over I_d alone leaves under load, and points that no map could use.
  void judge() {
    double sum = 0.0;
    int n = 0;
    for (auto& point : out_.points) {
      if (!point.for_L_m && !point.for_L_l && !point.for_R_r)
        point.left_out = "says too little of any parameter: light load for R_r and L_l, heavy for L_m";
      if (!out_.L_m.known() || point.for_L_m || std::abs(slip(point)) < options_.slip_rule) continue;
      const double map = out_.L_m.at(point.state.I_d_A);
      if (map > kSaturatedPart * out_.L_m.L_0.value) continue;
      sum += point.state.L_m_H / map - 1.0;
      ++n;
    }
    if (n > 0) out_.L_m.load_misfit = sum / n;
    if (out_.points.empty() && out_.locked.points.empty()) out_.failure = "no record holds a steady stretch";
  }

  const DataSet& data_;
  const MapOptions& options_;
  ParameterMaps out_;
  double gains_ = 0.0;
  double constant_R_s_ = kMissing;
  double L_l_start_ = kMissing;
  std::size_t no_load_windows_ = 0;
  std::optional<CoreLossLaw> iron_;
  std::vector<std::size_t> locked_records_;
  std::vector<NoLoadPoint> iron_points_;
};

}  // namespace

double MagnetizingMap::at(double I_d_A) const {
  const double I = std::clamp(I_d_A, lowest_A, highest_A);
  return I <= knee_A ? L_0.value : k_3.value + I * (k_2.value + I * k_1.value);
}

double LeakageMap::at(double I_A) const {
  const double I = std::clamp(I_A, lowest_A, highest_A);
  return k_5.value + (k_4.known() ? k_4.value * I : 0.0);
}

double RotorMap::at(double w_s, double stator_C, double kappa) const {
  const double rise = per_K.known() && std::isfinite(stator_C) ? per_K.value * (stator_C - reference_C) : 0.0;
  const double R = R_1.value * (1.0 + rise);
  return kappa * (R + skin_ohm(w_s, R));
}

double RotorMap::skin_ohm(double w_s, double R) const {
  if (!bar.known()) return k_6.known() ? k_6.value * std::abs(w_s) : 0.0;
  const double R_2 = bar.R_2_at(R), u = w_s * bar.L_2.value / R_2;
  return R_2 * u * u / (1.0 + u * u);
}

double rotor_share(double L_m, double L_m_unsaturated, double L_l) {
  const double leak = 0.5 * L_l;
  const auto share = [leak](double L) {
    const double L_T = 0.5 * (L + std::sqrt(L * L + 4.0 * L * leak));
    return L_T / (L_T + leak);
  };
  const double k = share(L_m) / share(L_m_unsaturated);
  return std::min(1.0, k * k);
}

ParameterMaps map_parameters(const DataSet& data, const std::vector<std::size_t>& used,
                             const std::vector<ResistancePoint>& dc, const MapOptions& options) {
  return Mapping(data, options).run(used, dc);
}

}  // namespace imrig::est
