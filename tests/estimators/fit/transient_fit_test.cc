// The transient fit against records made by another route (synthetic.h).
#include "estimators/fit/transient_fit.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>

#include "estimators/fit/identify.h"
#include "estimators/model/convert.h"
#include "tests/estimators/fit/synthetic.h"

namespace imrig::est {
namespace {

using synthetic::Motor;

MachineParameters<double> truth_of(const Motor& m) {
  return inverse_gamma_of(TCircuit{m.R_s, m.R_r, m.L_ls, m.L_lr, m.L_m});
}

TEST(TransientFitTest, Explore) {
  for (const auto& m : synthetic::motors()) {
    const auto truth = truth_of(m);
    for (double h : {20e-6, 60e-6, 200e-6, 1e-3}) {
      const std::size_t n = h < 1e-4 ? 5000 : h < 5e-4 ? 3000 : 1000;
      auto c = synthetic::step_case(m, 0.8, 0.9, m.slip, h, n);
      auto series = synthetic::record(m, c);
      const auto frame = to_frame(series, m.pole_pairs);
      TransientOptions o;
      o.nominal = {truth.R_s, 1.8 * truth.R_r, 0.6 * truth.L_l, 0.7 * truth.L_m};
      const auto t0 = std::chrono::steady_clock::now();
      const auto fit = fit_transient(frame, o);
      const double ms =
          std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - t0).count();
      std::printf("%-22s h %6.0f us: R_r %+.2e L_l %+.2e L_m %+.2e nrmse %.1e eval %d  %.1f ms %s\n", m.name,
                  h * 1e6, fit.theta.R_r / truth.R_r - 1, fit.theta.L_l / truth.L_l - 1,
                  fit.theta.L_m / truth.L_m - 1, fit.nrmse, fit.evaluations, ms, fit.failure.c_str());
    }
  }
}

}  // namespace
}  // namespace imrig::est
