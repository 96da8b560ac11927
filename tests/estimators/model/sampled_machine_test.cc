// The machine from sample to sample against small Runge-Kutta steps, and its derivatives against differences.
#include "estimators/model/sampled_machine.h"

#include <gtest/gtest.h>

#include <cmath>

#include "estimators/model/simulate.h"

namespace imrig::est {
namespace {

using Complex = std::complex<double>;

const MachineParameters<double> kMotor{0.39, 0.22, 5.9e-3, 67e-3};

// A start: the speed goes from rest to synchronous, the voltage jumps and turns slowly in the frame.
FrameRecord start_record(double h, std::size_t n) {
  FrameRecord record;
  record.sample_time_s = h;
  record.w_k = 2.0 * kPi * 50.0;
  for (std::size_t k = 0; k < n; ++k) {
    const double t = h * static_cast<double>(k), share = static_cast<double>(k) / static_cast<double>(n);
    record.v.push_back(std::polar(k < n / 3 ? 60.0 : 90.0, 3.0 * t));
    record.w_r.push_back(310.0 * share);
    record.i.emplace_back(0.0);
  }
  return record;
}

std::vector<Complex> stepped_currents(const MachineParameters<double>& p, const FrameRecord& record,
                                      int steps) {
  const BaseMachine<double> machine(p);
  std::vector<Complex> out;
  simulate(machine, record, {{0.1, -0.2}, {0.05, 0.1}}, steps, true,
           [&](std::size_t, const FluxState<double>& x) { out.push_back(plain(machine.current(x))); });
  return out;
}

std::vector<Complex> sampled_currents(const MachineParameters<double>& p, const FrameRecord& record) {
  FluxSide<1> x;
  x.s.set(0, {0.1, -0.2});
  x.r.set(0, {0.05, 0.1});
  std::vector<Complex> out;
  run_columns<1>(
      SampledMachine<1>(p, record, speed_range(record)), record.w_r, x,
      [&](std::size_t k, Side<1>& u) { u.set(0, record.v[k]); },
      [&](std::size_t, const FluxSide<1>& flux) { out.push_back((flux.s.at(0) - flux.r.at(0)) / p.L_l); });
  return out;
}

double largest_difference(const std::vector<Complex>& a, const std::vector<Complex>& b) {
  double worst = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) worst = std::max(worst, std::abs(a[k] - b[k]));
  return worst;
}

TEST(SampledMachineTest, GoesWhereSmallRungeKuttaStepsGoWhateverTheSampleTime) {
  struct Case {
    double h;
    int steps;
    double
        far_A;  // of some 60 A: the speed gains 1000 rad/s a second, and is taken at its mean over a sample
  };
  for (const Case& c : {Case{60e-6, 8, 2e-5}, Case{300e-6, 16, 5e-4}, Case{2e-3, 64, 2e-2}}) {
    const FrameRecord record = start_record(c.h, static_cast<std::size_t>(0.3 / c.h));
    EXPECT_LT(largest_difference(sampled_currents(kMotor, record), stepped_currents(kMotor, record, c.steps)),
              c.far_A)
        << c.h;
  }
}

TEST(SampledMachineTest, ASampleFarLongerThanTheMachineIsFastEndsInItsSteadyState) {
  FrameRecord record = start_record(50.0, 3);
  for (std::size_t k = 0; k < record.size(); ++k) record.w_r[k] = 300.0, record.v[k] = 80.0;
  const double slip = 1.0 - 300.0 / record.w_k;
  const Complex rotor = Complex(0.0, record.w_k * kMotor.L_m) * (kMotor.R_r / slip) /
                        (Complex(0.0, record.w_k * kMotor.L_m) + kMotor.R_r / slip);
  const Complex Z = kMotor.R_s + Complex(0.0, record.w_k * kMotor.L_l) + rotor;
  const Complex reached = sampled_currents(kMotor, record).back();
  EXPECT_LT(std::abs(reached - 80.0 / Z), 1e-9 * std::abs(reached));
}

TEST(SampledMachineTest, ItsDerivativesAreThoseOfTheCurrent) {
  const FrameRecord record = start_record(300e-6, 1000);
  std::vector<std::array<Complex, 4>> slopes;
  run_derivatives<6>(SampledMachine<6>(kMotor, record, speed_range(record)), record.w_r, record.v,
                     {{0.1, -0.2}, {0.05, 0.1}}, [&](std::size_t, const FluxSide<6>& x) {
                       std::array<Complex, 4> here;
                       for (int m = 0; m < 4; ++m)
                         here[static_cast<std::size_t>(m)] = (x.s.at(m + 1) - x.r.at(m + 1)) / kMotor.L_l;
                       here[2] -= (x.s.at(0) - x.r.at(0)) / (kMotor.L_l * kMotor.L_l);
                       slopes.push_back(here);
                     });
  const std::array<double MachineParameters<double>::*, 4> places{
      &MachineParameters<double>::R_s, &MachineParameters<double>::R_r, &MachineParameters<double>::L_l,
      &MachineParameters<double>::L_m};
  for (std::size_t m = 0; m < places.size(); ++m) {
    MachineParameters<double> up = kMotor, down = kMotor;
    const double step = 1e-4 * kMotor.*places[m];
    up.*places[m] += step;
    down.*places[m] -= step;
    const auto high = sampled_currents(up, record), low = sampled_currents(down, record);
    double worst = 0.0, largest = 0.0;
    for (std::size_t k = 0; k < slopes.size(); ++k) {
      worst = std::max(worst, std::abs(slopes[k][m] - (high[k] - low[k]) / (2.0 * step)));
      largest = std::max(largest, std::abs(slopes[k][m]));
    }
    EXPECT_LT(worst, 1e-6 * largest) << m;
  }
}

}  // namespace
}  // namespace imrig::est
