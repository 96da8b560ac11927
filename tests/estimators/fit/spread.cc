#include "tests/estimators/fit/spread.h"

#include <Eigen/Dense>
#include <cmath>

#include "estimators/fit/student_t.h"
#include "estimators/model/convert.h"

namespace imrig::est::synthetic {

MachineParameters<double> truth_of(const Motor& m) {
  return inverse_gamma_of(TCircuit{m.R_s, m.R_r, m.L_ls, m.L_lr, m.L_m});
}

Three three(const MachineParameters<double>& p) { return {p.R_r, p.L_l, p.L_m}; }

TransientOptions options_near(const MachineParameters<double>& truth, double R_r, double L_l, double L_m) {
  TransientOptions o;
  o.nominal = {truth.R_s, R_r * truth.R_r, L_l * truth.L_l, L_m * truth.L_m};
  o.saturation_flux_Wb = 10.0;
  return o;
}

Case released_case(const Motor& motor, std::size_t samples) {
  Case c = step_case(motor, 0.8, 0.9, motor.slip, 60e-6, samples);
  c.step_at_s = 0.0;
  c.start_off_rotor_Wb = 0.05 * c.v_peak_V / (2.0 * kPi * c.f_Hz);
  return c;
}

double usual_noise_A(const Motor& motor, const Case& c) { return 0.003 * c.v_peak_V * motor.slip / motor.R_r; }

Three cramer_rao(const Motor& m, const Case& c, double current_A) {
  const auto truth = truth_of(m);
  const auto current_of = [&](MachineParameters<double> p, SpaceVector d_stator, SpaceVector d_rotor) {
    const TCircuit t = t_of(p);
    Motor moved = m;
    moved.R_r = t.R_r;
    moved.L_ls = t.L_ls;
    moved.L_lr = t.L_lr;
    moved.L_m = t.L_m;
    auto other = c;
    other.start_off_stator_Wb += d_stator;
    other.start_off_rotor_Wb +=
        d_rotor *
        std::sqrt((t.L_lr + t.L_m) / p.L_m);  // inverse-gamma rotor flux is that of T times L_m / L_r
    return record(moved, other).i;
  };
  const auto rows = static_cast<Eigen::Index>(2 * c.samples);
  Eigen::MatrixXd J(rows, 7);
  const auto put = [&](Eigen::Index column, const std::vector<SpaceVector>& up,
                       const std::vector<SpaceVector>& down, double width) {
    for (std::size_t k = 0; k < c.samples; ++k) {
      const SpaceVector slope = (up[k] - down[k]) / width;
      J(static_cast<Eigen::Index>(2 * k), column) = slope.real();
      J(static_cast<Eigen::Index>(2 * k + 1), column) = slope.imag();
    }
  };
  const std::array places{&MachineParameters<double>::R_r, &MachineParameters<double>::L_l,
                          &MachineParameters<double>::L_m};
  for (std::size_t k = 0; k < 3; ++k) {
    auto up = truth, down = truth;
    const double step = 1e-4 * truth.*places[k];
    up.*places[k] += step;
    down.*places[k] -= step;
    put(static_cast<Eigen::Index>(k), current_of(up, 0.0, 0.0), current_of(down, 0.0, 0.0), 2.0 * step);
  }
  const SpaceVector j(0.0, 1.0);
  for (Eigen::Index k = 0; k < 4; ++k) {
    const SpaceVector d = 1e-3 * (k % 2 == 0 ? SpaceVector(1.0) : j);
    const SpaceVector none = 0.0;
    put(3 + k, current_of(truth, k < 2 ? d : none, k < 2 ? none : d),
        current_of(truth, k < 2 ? -d : none, k < 2 ? none : -d), 2e-3);
  }
  const Eigen::VectorXd scale = J.colwise().norm().cwiseInverse();
  const Eigen::MatrixXd scaled = J * scale.asDiagonal();
  const Eigen::MatrixXd inverse = (scaled.transpose() * scaled).inverse();
  Three out{};
  for (Eigen::Index k = 0; k < 3; ++k)
    out[static_cast<std::size_t>(k)] = current_A * scale[k] * std::sqrt(inverse(k, k));
  return out;
}


Spread spread_of(const Motor& m, const TimeSeries& clean, double current_A, double voltage_V, double speed_rad_s, int seeds) {
  const Three truth = three(truth_of(m));
  auto options = options_near(truth_of(m), 1.0, 1.0, 1.0);
  options.noise.speed_rad_s = speed_rad_s;
  Eigen::MatrixXd off(seeds, 3), sigma(seeds, 3);
  Spread s;
  s.seeds = seeds;
  for (int seed = 0; seed < seeds; ++seed) {
    TimeSeries noisy = clean;
    add_noise(noisy, current_A, voltage_V, speed_rad_s, static_cast<std::uint64_t>(9000 + 7 * seed));
    const TransientFit fit = fit_transient(to_frame(noisy, m.pole_pairs), options);
    s.failed += fit.failure.empty() ? 0 : 1;
    const Three found = three(fit.theta);
    for (std::size_t k = 0; k < 3; ++k) {
      const auto column = static_cast<Eigen::Index>(k);
      off(seed, column) = found[k] - truth[k];
      sigma(seed, column) = std::sqrt(fit.noise.covariance(column + 1, column + 1));
      s.covered[k] += std::abs(off(seed, column)) < kNormal975 * sigma(seed, column) ? 1 : 0;
    }
  }
  for (std::size_t k = 0; k < 3; ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    s.bias[k] = off.col(column).mean();
    s.deviation[k] = std::sqrt((off.col(column).array() - s.bias[k]).square().sum() / (seeds - 1));
    s.stated[k] = sigma.col(column).mean();
  }
  return s;
}

}  // namespace imrig::est::synthetic
