#include "estimators/model/base_machine.h"

#include <ceres/jet.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <complex>
#include <vector>

#include "estimators/model/simulate.h"
#include "estimators/model/steady_state.h"

namespace imrig::est {
namespace {

using Complex = std::complex<double>;

const MachineParameters<double> kMotor{0.39, 0.22, 0.006, 0.068};  // the 2002 paper's table II

FrameRecord constant_record(Complex v, double w_r, double w_k, double sample_time_s, std::size_t n) {
  FrameRecord r;
  r.sample_time_s = sample_time_s;
  r.w_k = w_k;
  r.v.assign(n, v);
  r.i.assign(n, 0.0);
  r.w_r.assign(n, w_r);
  return r;
}

std::vector<Complex> currents(const MachineParameters<double>& p, const FrameRecord& record, int steps) {
  const BaseMachine<double> machine(p);
  std::vector<Complex> all;
  simulate(machine, record, {}, steps, true,
           [&](std::size_t, const FluxState<double>& x) { all.push_back(plain(machine.current(x))); });
  return all;
}

TEST(BaseMachineTest, DirectCurrentEndsAtVoltageOverStatorResistance) {
  const auto i = currents(kMotor, constant_record({10.0, -4.0}, 0.0, 0.0, 1e-3, 10000), 2);
  EXPECT_NEAR(std::abs(i.back() - Complex(10.0, -4.0) / 0.39), 0.0, 1e-6);
}

TEST(BaseMachineTest, BeforeTheRotorFluxMovesTheStatorIsResistanceAndLeakage) {
  // dpsi_r/dt is small at first: di/dt = (v - (R_s + R_r) i) / L_l.
  const double h = 20e-6;
  const auto i = currents(kMotor, constant_record(10.0, 0.0, 0.0, h, 6), 1);
  const double R = 0.61, t = 5 * h;
  EXPECT_NEAR(i.back().real(), 10.0 / R * (1.0 - std::exp(-R * t / 0.006)), 1e-5);
}

TEST(BaseMachineTest, RunsIntoThePhasorSolutionInAnyFrame) {
  const double w_e = 2.0 * kPi * 60.0, w_r = 0.97 * w_e;
  const auto phasor = steady_state(kMotor, 2, 170.0, w_e, w_r);
  for (const double w_k : {0.0, w_e, -100.0}) {
    FrameRecord record = constant_record(170.0, w_r, w_k, 60e-6, 60000);
    for (std::size_t k = 0; k < record.size(); ++k)
      record.v[k] = std::polar(170.0, (w_e - w_k) * 60e-6 * static_cast<double>(k));
    const auto i = currents(kMotor, record, 1);
    const Complex turned =
        i.back() * std::polar(1.0, -(w_e - w_k) * 60e-6 * static_cast<double>(record.size() - 1));
    // In a frame other than the supply's the straight lines between samples cost (w h)^2 / 12.
    EXPECT_NEAR(std::abs(turned - plain(phasor.i_s)) / phasor.current_A, 0.0, w_k == w_e ? 1e-9 : 1e-4)
        << w_k;
  }
}

TEST(BaseMachineTest, HalvingTheStepDividesTheErrorBySixteen) {
  const double w_e = 2.0 * kPi * 50.0;
  const FrameRecord record = constant_record(100.0, 0.8 * w_e, w_e, 2e-3, 40);
  const auto fine = currents(kMotor, record, 256);
  const auto error = [&](int steps) {
    const auto i = currents(kMotor, record, steps);
    double worst = 0.0;
    for (std::size_t k = 0; k < i.size(); ++k) worst = std::max(worst, std::abs(i[k] - fine[k]));
    return worst;
  };
  EXPECT_NEAR(error(8) / error(16), 16.0, 3.0);
  EXPECT_LT(error(steps_per_sample(kMotor, record)),
            1e-3);  // of a transient of 40 A: far below any sensor's noise
}

TEST(BaseMachineTest, WhatGoesInIsHeatFieldAndShaft) {
  // Energy: integral of (3/2) Re(v i*) = copper losses + field energy + integral of T w_M.
  const double w_e = 2.0 * kPi * 50.0, w_r = 0.9 * w_e, h = 20e-6;
  const FrameRecord record = constant_record(100.0, w_r, w_e, h, 5001);
  const BaseMachine<double> machine(kMotor);
  double in = 0.0, out = 0.0, field = 0.0;
  simulate(machine, record, {}, 1, true, [&](std::size_t k, const FluxState<double>& x) {
    const Complex i = plain(machine.current(x)), psi_r = plain(x.psi_r);
    const Complex i_r = psi_r / kMotor.L_m - i;
    const double weight = (k == 0 || k + 1 == record.size()) ? 0.5 * h : h;
    in += weight * 1.5 * (100.0 * std::conj(i)).real();
    out += weight * (1.5 * (0.39 * std::norm(i) + 0.22 * std::norm(i_r)) +
                     airgap_torque_Nm(2, x.psi_s, machine.current(x)) * w_r / 2);
    field = 0.75 * (kMotor.L_l * std::norm(i) + std::norm(psi_r) / kMotor.L_m);
  });
  EXPECT_NEAR(in / (out + field), 1.0, 1e-5);
}

TEST(BaseMachineTest, JetDerivativesAgreeWithCentralDifferences) {
  using Jet = ceres::Jet<double, 4>;
  FrameRecord record = constant_record({150.0, 20.0}, 350.0, 377.0, 100e-6, 800);
  for (std::size_t k = 300; k < record.size(); ++k) record.v[k] *= 1.1;
  const std::array values{0.39, 0.22, 0.006, 0.068};
  const auto of = [](const std::array<double, 4>& a) {
    return MachineParameters<double>{a[0], a[1], a[2], a[3]};
  };
  const BaseMachine<Jet> machine(
      {Jet(values[0], 0), Jet(values[1], 1), Jet(values[2], 2), Jet(values[3], 3)});
  std::vector<Cx<Jet>> jets;
  simulate(machine, record, {}, 2, true,
           [&](std::size_t, const FluxState<Jet>& x) { jets.push_back(machine.current(x)); });
  for (std::size_t m = 0; m < 4; ++m) {
    auto up = values, down = values;
    const double step = 1e-4 * values[m];
    up[m] += step;
    down[m] -= step;
    const auto i_up = currents(of(up), record, 2), i_down = currents(of(down), record, 2);
    for (const std::size_t k : {10UL, 299UL, 305UL, 799UL}) {
      const Complex difference = (i_up[k] - i_down[k]) / (2.0 * step);
      const Complex exact(jets[k].re.v[static_cast<int>(m)], jets[k].im.v[static_cast<int>(m)]);
      EXPECT_NEAR(std::abs(exact - difference) / std::abs(exact), 0.0, 1e-5)
          << "parameter " << m << ", sample " << k;
    }
  }
}

}  // namespace
}  // namespace imrig::est
