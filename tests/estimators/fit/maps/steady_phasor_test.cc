// Steady phasors against records made by another route (synthetic.h: T circuit, matrix exponential).
#include "estimators/fit/maps/steady_phasor.h"

#include <gtest/gtest.h>

#include <cmath>

#include "estimators/fit/maps/locked_sweep.h"
#include "estimators/model/convert.h"
#include "tests/estimators/fit/synthetic.h"

namespace imrig::est {
namespace {

using synthetic::Motor;

MachineParameters<double> truth_of(const Motor& m) {
  return inverse_gamma_of(TCircuit{m.R_s, m.R_r, m.L_ls, m.L_lr, m.L_m});
}

DataSet data_of(const Motor& m, TimeSeries series, RecordKind kind) {
  DataSet data;
  data.name = "made";
  data.pole_pairs = m.pole_pairs;
  Record record;
  record.id = "one";
  record.kind = kind;
  record.series = std::move(series);
  data.records.push_back(std::move(record));
  return data;
}

synthetic::Case steady_case(const Motor& m, double slip, double sign = 1.0) {
  auto c = synthetic::step_case(m, 0.8, 1.0, slip, 60e-6, 16000);
  c.step = 0.0;
  c.filter_s = 200e-6;
  if (sign < 0.0) {
    const auto forward = c.speed_rad_s;
    c.f_Hz = -c.f_Hz;
    c.speed_rad_s = [forward](double t) { return -forward(t); };
  }
  return c;
}

TEST(SteadyPhasorTest, GivesTheCircuitBackInEitherDirection) {
  for (const auto& m : synthetic::motors()) {
    const auto truth = truth_of(m);
    for (const double sign : {1.0, -1.0}) {
      const auto c = steady_case(m, m.slip, sign);
      const DataSet data = data_of(m, synthetic::record(m, c), RecordKind::kSteady);
      const auto phasors = running_phasors(data, 0);
      ASSERT_EQ(phasors.size(), 1u) << m.name;
      const CircuitState state = circuit_state(phasors[0], truth.R_s, truth.L_l);
      EXPECT_NEAR(phasors[0].w_e, 2.0 * kPi * m.f_Hz, 1e-6 * phasors[0].w_e) << m.name;
      EXPECT_NEAR(state.L_m_H / truth.L_m, 1.0, 1e-4) << m.name;
      EXPECT_NEAR(state.R_r_ohm / truth.R_r, 1.0, 1e-4) << m.name;
    }
  }
}

TEST(SteadyPhasorTest, OffsetsAndANegativeSequenceFallIntoTheWindowsZeros) {
  const Motor& m = synthetic::motors()[1];
  const auto truth = truth_of(m);
  TimeSeries series = synthetic::record(m, steady_case(m, m.slip));
  for (auto& v : series.v) v += SpaceVector(1.0, -0.5) + 0.005 * std::conj(v);
  for (auto& i : series.i) i += SpaceVector(0.2, 0.1) + 0.005 * std::conj(i);
  const DataSet data = data_of(m, series, RecordKind::kSteady);
  const CircuitState state = circuit_state(running_phasors(data, 0).at(0), truth.R_s, truth.L_l);
  EXPECT_NEAR(state.L_m_H / truth.L_m, 1.0, 2e-4);
  EXPECT_NEAR(state.R_r_ohm / truth.R_r, 1.0, 2e-4);
}

TEST(SteadyPhasorTest, AWindowWithAStepInItIsNotSteady) {
  const Motor& m = synthetic::motors()[1];
  auto c = steady_case(m, m.slip);
  c.step = 0.1;
  c.step_at_s = 0.5;
  EXPECT_TRUE(running_phasors(data_of(m, synthetic::record(m, c), RecordKind::kSteady), 0).empty());
}

// A voltage that is held from sample to sample, through a first-order filter computed in closed form: the phasor of
// the held voltage comes back, where the filter's answer to a sinusoid would be 1.9 us off.
TEST(SteadyPhasorTest, AHeldVoltageIsSeenThroughItsFilterExactly) {
  const double h = 60e-6, tau = 160e-6, w = 2.0 * kPi * 120.0;
  TimeSeries s;
  s.sample_time_s = h;
  s.voltage_filter_s = tau;
  SpaceVector filtered = 0.0;
  for (int k = 0; k < 20000; ++k) {
    s.v.push_back(filtered);
    s.i.push_back(std::polar(1.0, w * h * k));
    s.speed_rad_s.push_back(0.0);
    s.stator_C.push_back(25.0);
    s.segment.push_back(1);
    const SpaceVector held = std::polar(10.0, w * h * k);
    filtered += (1.0 - std::exp(-h / tau)) * (held - filtered);
  }
  DataSet data = data_of(synthetic::motors()[1], s, RecordKind::kLockedSweep);
  const SteadyPhasor p = standing_phasors(data, 0).at(0);
  const std::complex<double> mean = 10.0 * (1.0 - std::polar(1.0, -w * h)) / std::complex<double>(0.0, w * h) *
                                    std::polar(1.0, w * h) * std::polar(1.0, -w * h);
  EXPECT_NEAR(std::arg(p.v / p.i / mean), 0.0, 1e-6);
  EXPECT_NEAR(std::abs(p.v / p.i) / std::abs(mean), 1.0, 1e-6);
}

// At standstill the T circuit's impedance, turning and along one axis; k_6 and both temperatures come back.
TEST(LockedSweepTest, RecoversTheLineOverSlipFrequencyAtTwoTemperatures) {
  const double R_s = 0.4, L_l = 0.006, L_m = 0.07, k_6 = 2.5e-4, h = 100e-6;
  DataSet data;
  data.pole_pairs = 2;
  std::vector<std::size_t> which;
  std::vector<ResistancePoint> dc;
  int number = 0;
  for (const double warm : {0.0, 80.0}) {
    const double R_1 = 0.2 * (1.0 + 0.004 * warm);
    for (const double f : {5.0, 40.0, 10.0, 80.0, 20.0, 120.0, 60.0, 100.0}) {
      const double w = 2.0 * kPi * f, R_r = R_1 + k_6 * w;
      const std::complex<double> jX(0.0, w * L_m);
      const std::complex<double> Z = R_s + std::complex<double>(0.0, w * L_l) + jX * R_r / (R_r + jX);
      const bool one_axis = number % 2 == 0;
      Record record;
      record.id = "locked_" + std::to_string(number++);
      record.kind = RecordKind::kLockedSweep;
      record.series.sample_time_s = h;
      for (int k = 0; k < 12000; ++k) {
        const std::complex<double> i = std::polar(4.0, w * h * k), v = Z * i;
        const std::complex<double> axis = std::polar(1.0, 0.7);
        record.series.i.push_back(one_axis ? axis * i.real() : i);
        record.series.v.push_back(one_axis ? axis * v.real() : v);
        record.series.speed_rad_s.push_back(0.0);
        record.series.stator_C.push_back(25.0 + warm);
      }
      which.push_back(data.records.size());
      data.records.push_back(record);
    }
    for (const double off : {-1.0, 0.0, 1.0}) dc.push_back({"dc", 25.0 + warm + off, R_s, 1e-4});
  }
  const ResistanceLine line = resistance_line(dc, 0.0);
  ASSERT_EQ(line.failure, "");
  const LockedResult fit = fit_locked_sweeps(data, which, line, L_m, 0.0);
  ASSERT_EQ(fit.failure, "");
  ASSERT_EQ(fit.sweeps.size(), 2u);
  EXPECT_NEAR(fit.k_6.value / k_6, 1.0, 1e-3);
  EXPECT_NEAR(fit.sweeps[0].R_1.value / 0.2, 1.0, 1e-3);
  EXPECT_NEAR(fit.sweeps[1].R_1.value / 0.264, 1.0, 1e-3);
  EXPECT_NEAR(fit.per_K.value / 0.004, 1.0, 1e-2);
}

}  // namespace
}  // namespace imrig::est
