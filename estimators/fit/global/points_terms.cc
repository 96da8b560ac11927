#include "estimators/fit/global/points_terms.h"

#include <ceres/jet.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "estimators/model/effects/effect_machine.h"
#include "rig/base/error.h"

namespace imrig::est {

namespace {

constexpr int kLanes = 40;
constexpr int kState = 6;
constexpr int kRounds = 40;

struct Setting {
  double v = 0.0, w_r = 0.0;
  Instant at;
};

Setting setting_of(const SteadyPoint& p, int pole_pairs) {
  if (!(p.v_peak_V > 0.0) || !(std::abs(p.f_Hz) >= 0.0) || !std::isfinite(p.speed_rad_s)) {
    throw Error("operating point", "lacks voltage, frequency or speed",
                "the model needs all three to predict the rest");
  }
  Setting s;
  s.v = p.v_peak_V;
  s.w_r = pole_pairs * p.speed_rad_s;
  s.at.w_k = 2.0 * kPi * p.f_Hz;
  s.at.voltage_rate = std::complex<double>(0.0, s.at.w_k * p.v_peak_V);
  if (std::isfinite(p.stator_C)) s.at.stator_C = p.stator_C;
  return s;
}

template <class T>
SharedVector<T> without_ripple(const SharedVector<T>& shared) {
  // Negative sequences and offsets make no fundamental.
  SharedVector<T> out = shared;
  for (std::size_t k = 0; k < kEffects; ++k) {
    const std::string_view name = kEffectInfos[k].name;
    if (name != "current_offset" && name != "current_gain" && name != "supply_unbalance" &&
        name != "stator_unbalance" && name != "inverter_dead_time")
      continue;
    for (std::size_t e = kSharedPlace[k]; e < kSharedPlace[k + 1]; ++e) {
      if (kEffectInfos[k].shared[e - kSharedPlace[k]].role == Role::kAmplitude) out[e] = T(0.0);
    }
  }
  return out;
}

LocalVector<double> resting() {
  LocalVector<double> out{};
  for (std::size_t k = 0; k < kEffects; ++k) {
    for (std::size_t e = kLocalPlace[k]; e < kLocalPlace[k + 1]; ++e)
      out[e] = kEffectInfos[k].local[e - kLocalPlace[k]].neutral;
  }
  return out;
}

template <class T>
std::array<T, kState> flat(const EffectState<T>& x) {
  return {x.psi_s.re, x.psi_s.im, x.psi_r.re, x.psi_r.im, x.i_b.re, x.i_b.im};
}
template <class T>
EffectState<T> state_of(const std::array<T, kState>& x) {
  return {{x[0], x[1]}, {x[2], x[3]}, {x[4], x[5]}};
}

// Newton's method from zero flux with the saturating parts coming in by themselves; damped.
std::array<double, kState> steady_state_of(const SharedVector<double>& shared,
                                           const LocalVector<double>& local, const Setting& s,
                                           Eigen::Matrix<double, kState, kState>& jacobian) {
  using Jet = ceres::Jet<double, kState>;
  SharedVector<Jet> p;
  LocalVector<Jet> q;
  for (std::size_t k = 0; k < kShared; ++k) p[k] = Jet(shared[k]);
  for (std::size_t k = 0; k < kLocal; ++k) q[k] = Jet(local[k]);
  const EffectMachine<Jet> seeded(p, q);
  std::array<double, kState> x{};
  // The flux that the voltage asks for: a start on the right branch.
  x[1] = x[3] = s.at.w_k == 0.0 ? 0.0 : -0.95 * s.v / s.at.w_k;
  for (int round = 0; round < kRounds; ++round) {
    std::array<Jet, kState> xs;
    for (int k = 0; k < kState; ++k) xs[static_cast<std::size_t>(k)] = Jet(x[static_cast<std::size_t>(k)], k);
    const auto d = flat(seeded.derivative(state_of(xs), s.v, s.w_r, s.at));
    Eigen::Matrix<double, kState, 1> f;
    for (int k = 0; k < kState; ++k) {
      f[k] = d[static_cast<std::size_t>(k)].a;
      jacobian.row(k) = d[static_cast<std::size_t>(k)].v.transpose();
    }
    // Without a deep layer its current has no equation but i_b = 0.
    for (int k = 4; k < kState; ++k) {
      if (jacobian.row(k).isZero(0.0)) {
        jacobian(k, k) = 1.0;
        f[k] = x[static_cast<std::size_t>(k)];
      }
    }
    const Eigen::Matrix<double, kState, 1> step = jacobian.partialPivLu().solve(f);
    double size = 0.0, largest = 0.0;
    for (int k = 0; k < 4; ++k) {
      size = std::max(size, std::abs(step[k]));
      largest = std::max(largest, std::abs(x[static_cast<std::size_t>(k)]));
    }
    const double damping = std::min(
        1.0, 0.5 * (largest + 0.1 * s.v / std::max(1.0, std::abs(s.at.w_k))) / std::max(size, 1e-300));
    for (int k = 0; k < kState; ++k) x[static_cast<std::size_t>(k)] -= damping * step[k];
    if (!std::isfinite(size)) break;
    if (size < 1e-12 * (largest + 1e-6)) return x;
  }
  throw Error("operating point", "has no steady state in this model");
}

template <class T>
struct Outputs {
  T i_peak, p_in, q, torque, p_out;
};

template <class T>
Outputs<T> outputs(const EffectMachine<T>& machine, const EffectState<T>& x, const Setting& s,
                   int pole_pairs) {
  using std::sqrt;
  const auto in = machine.inside(x, s.v, s.w_r, s.at);
  Outputs<T> out;
  out.i_peak = sqrt(norm(in.i));
  out.p_in = 1.5 * s.v * in.i.re;
  out.q = -1.5 * s.v * in.i.im;
  out.torque = machine.shaft_torque_Nm(in, x, pole_pairs);
  out.p_out = out.torque * (in.w_r * (1.0 / pole_pairs));
  return out;
}

}  // namespace

PointPrediction predict_steady(const SharedVector<double>& given, int pole_pairs, const SteadyPoint& point) {
  const SharedVector<double> shared = without_ripple(given);
  const LocalVector<double> local = resting();
  const Setting s = setting_of(point, pole_pairs);
  const EffectMachine<double> machine(shared, local);
  Eigen::Matrix<double, kState, kState> jacobian;
  const auto x = steady_state_of(shared, local, s, jacobian);
  const auto out = outputs(machine, state_of(x), s, pole_pairs);
  return {out.i_peak, out.p_in, out.q, out.torque, out.p_out};
}

namespace {

// One measured value of a row.
struct Channel {
  double error = 0.0;
  Eigen::VectorXd jacobian;
  double sigma = 0.0;     // its own
  double by_speed = 0.0;  // one sigma of the speed moves it so far
};

struct Whitened {
  Eigen::VectorXd error;
  Eigen::MatrixXd jacobian;
};

// A speed that is off moves current and both powers together: what they say of each other stays.
Whitened whitened(const std::vector<Channel>& channels) {
  const auto n = static_cast<Eigen::Index>(channels.size());
  Whitened out;
  out.error.resize(n);
  out.jacobian.resize(n, channels.front().jacobian.size());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index a = 0; a < n; ++a) {
    const Channel& one = channels[static_cast<std::size_t>(a)];
    out.error[a] = one.error;
    out.jacobian.row(a) = one.jacobian.transpose();
    covariance(a, a) += one.sigma * one.sigma;
    for (Eigen::Index b = 0; b < n; ++b)
      covariance(a, b) += one.by_speed * channels[static_cast<std::size_t>(b)].by_speed;
  }
  const Eigen::LLT<Eigen::MatrixXd> cholesky(covariance);
  out.error = cholesky.matrixL().solve(out.error).eval();
  if (out.jacobian.cols() > 0) out.jacobian = cholesky.matrixL().solve(out.jacobian).eval();
  return out;
}

// What one sigma of the speed makes of the prediction.
PointPrediction moved_prediction(const SharedVector<double>& shared, int pole_pairs, SteadyPoint point,
                                 double speed_rad_s) {
  point.speed_rad_s += speed_rad_s;
  return predict_steady(shared, pole_pairs, point);
}

}  // namespace

RecordTerms points_terms(const std::vector<SteadyPoint>& points, int pole_pairs, const PointNoise& noise,
                         const SharedVector<double>& given, const Lanes& lanes) {
  using Jet = ceres::Jet<double, kLanes>;
  if (lanes.shared.size() > kLanes) throw Error("global fit", "has more unknowns than one evaluation takes");
  const auto used = static_cast<Eigen::Index>(lanes.shared.size());
  RecordTerms out;
  out.gradient.setZero(static_cast<Eigen::Index>(lanes.size()));
  out.normal.setZero(out.gradient.size(), out.gradient.size());
  out.stretch_gradient.setZero(out.gradient.size(), kStretches);

  const SharedVector<double> shared = without_ripple(given);
  const LocalVector<double> local = resting();
  SharedVector<Jet> seeded;
  LocalVector<Jet> seeded_local;
  for (std::size_t k = 0; k < kShared; ++k) seeded[k] = Jet(shared[k]);
  for (std::size_t k = 0; k < kLocal; ++k) seeded_local[k] = Jet(local[k]);
  for (std::size_t k = 0; k < lanes.shared.size(); ++k) seeded[lanes.shared[k]].v[static_cast<int>(k)] = 1.0;
  const SharedVector<Jet> seeded_steady = without_ripple(seeded);
  const EffectMachine<Jet> machine(seeded_steady, seeded_local);

  for (std::size_t n = 0; n < points.size(); ++n) {
    const SteadyPoint& point = points[n];
    const Setting s = setting_of(point, pole_pairs);
    Eigen::Matrix<double, kState, kState> jacobian;
    const auto x = steady_state_of(shared, local, s, jacobian);
    // x(theta): dx = -F_x^-1 F_theta.
    std::array<Jet, kState> xs;
    for (std::size_t k = 0; k < kState; ++k) xs[k] = Jet(x[k]);
    const auto d = flat(machine.derivative(state_of(xs), s.v, s.w_r, s.at));
    Eigen::Matrix<double, kState, kLanes> by_theta;
    for (int k = 0; k < kState; ++k) by_theta.row(k) = d[static_cast<std::size_t>(k)].v.transpose();
    const Eigen::Matrix<double, kState, kLanes> dx = -jacobian.partialPivLu().solve(by_theta);
    for (int k = 0; k < kState; ++k) xs[static_cast<std::size_t>(k)].v = dx.row(k).transpose();
    const Outputs<Jet> model = outputs(machine, state_of(xs), s, pole_pairs);

    const PointPrediction above = moved_prediction(given, pole_pairs, point, noise.speed_rad_s);
    const std::size_t stretch = n * kStretches / points.size();
    std::vector<Channel> channels;
    const auto add = [&](const Jet& predicted, double measured, double sigma, double by_speed) {
      if (!std::isfinite(measured)) return;
      channels.push_back({predicted.a - measured, predicted.v.head(used),
                          std::hypot(sigma, noise.relative * measured), by_speed - predicted.a});
    };
    add(model.i_peak, point.i_peak_A, noise.current_A, above.i_peak_A);
    add(model.p_in, point.p_in_W, noise.power_W, above.p_in_W);
    if (std::isfinite(point.torque_Nm)) {
      add(model.torque, point.torque_Nm, noise.torque_Nm, above.torque_Nm);
    } else {
      add(model.p_out, point.p_out_W, noise.torque_Nm * std::abs(point.speed_rad_s), above.p_out_W);
    }
    if (channels.empty()) continue;
    const Whitened row = whitened(channels);
    const double chi2 = row.error.squaredNorm();
    out.chi2 += chi2;
    out.stretch_chi2[stretch] += chi2;
    out.values += channels.size();
    const Eigen::VectorXd gradient = row.jacobian.transpose() * row.error;
    out.gradient.head(used) += gradient;
    out.stretch_gradient.col(static_cast<Eigen::Index>(stretch)).head(used) += gradient;
    out.normal.topLeftCorner(used, used) += row.jacobian.transpose() * row.jacobian;
    if (std::isfinite(point.i_peak_A)) {
      out.error2 += std::pow(model.i_peak.a - point.i_peak_A, 2);
      out.signal2 += std::pow(point.i_peak_A, 2);
    }
  }
  return out;
}

}  // namespace imrig::est
