#include "estimators/fit/standstill/standstill_noise.h"

#include <ceres/jet.h>

#include <algorithm>

#include "estimators/fit/standstill/standstill_response.h"

namespace imrig::est::standstill {

namespace {

constexpr double kLag_s = 1e-3;  // by then the current channel's noise has died away, the machine's has not

}  // namespace

PowerGain noise_power_gain(const MachineParameters<double>& theta) {
  using Jet = ceres::Jet<double, kTheta>;
  const auto by_log = [](double x, int k) {
    Jet jet(x, k);
    jet.v *= x;
    return jet;
  };
  const MachineParameters<Jet> p{by_log(theta.R_s, 0), by_log(theta.R_r, 1), by_log(theta.L_l, 2),
                                 by_log(theta.L_m, 3)};
  const Jet b_1 = 1.0 / p.L_l, b_0 = p.R_r / (p.L_m * p.L_l);
  const Jet a_1 = (p.R_s + p.R_r) / p.L_l + p.R_r / p.L_m, a_0 = p.R_s * p.R_r / (p.L_m * p.L_l);
  const Jet gain = (b_1 * b_1 * a_0 + b_0 * b_0) / (2.0 * a_0 * a_1);
  return {gain.a, gain.v};
}

double voltage_variance(const AxisRecord& record, const MachineParameters<double>& theta,
                        const std::vector<double>& residual) {
  const auto lag = std::max<std::size_t>(1, static_cast<std::size_t>(kLag_s / record.sample_time_s));
  double measured = 0.0;
  for (std::size_t k = 0; k + lag < residual.size(); ++k) measured += residual[k] * residual[k + lag];
  measured /= static_cast<double>(residual.size() - lag);
  const StandstillStep<double> step = standstill_step(theta, record.sample_time_s);
  StandstillState<double> x;
  x.advance(step, 0.0, 1.0);
  x.psi_s += step.g_0[0];
  x.psi_r += step.g_0[1];
  const auto memory =
      static_cast<std::size_t>(10.0 * theta.L_l / (theta.R_s + theta.R_r) / record.sample_time_s) + lag;
  std::vector<double> response;
  for (std::size_t k = 0; k < memory; ++k) {
    response.push_back(x.current(step));
    x.advance(step, 0.0, 0.0);
  }
  double expected = 0.0;
  for (std::size_t k = 0; k + lag < response.size(); ++k) expected += response[k] * response[k + lag];
  return expected > 0.0 ? std::max(0.0, measured / expected) : 0.0;
}

}  // namespace imrig::est::standstill
