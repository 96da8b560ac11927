// The fixed-step integrator, held against the error-controlled one in the same run on shipped plants, the one with full
// physics also with every switching instant followed: a start from rest, load, a 20 % step, gates off and a coast-down.

#include <gtest/gtest.h>

#include <cstdio>
#include <string>
#include <tuple>
#include <vector>

#include "tests/plant/bench.h"

namespace imrig::plant {
namespace {

using namespace bench;

struct Trace {
  std::vector<Complex> i;
  std::vector<double> rpm;
};

constexpr double kSample_s = 60e-6;
constexpr int kStep_at = 23000, kGatesOff_at = 32000, kEnd = 36000;

Trace start_load_step(PlantConfig config, const IntegratorConfig& integrator) {
  config.integrator = integrator;
  Plant plant(config);
  Trace trace;
  InverterCommand held;
  for (int k = 0; k < kEnd; ++k) {
    const double t = (k + 2) * kSample_s;
    const double amplitude = (k >= kStep_at ? 143.7 : 179.6) * std::min(1.0, t / 0.05);
    if (k == 15000) plant.set_excitation({60.0, 1.2, true, 0.0, 0.0});
    if (k % 4 == 0) held = command(std::polar(amplitude, 2.0 * kPi * 60.0 * t));
    held.gates_on = k < kGatesOff_at;
    plant.step(held);
    trace.i.push_back(plant.state().i_s), trace.rpm.push_back(plant.state().speed_rpm);
  }
  return trace;
}

using Case = std::tuple<std::string, InverterConfig::Kind>;

class Pace : public ::testing::TestWithParam<Case> {};

std::string told(const ::testing::TestParamInfo<Case>& c) { return std::get<0>(c.param); }

TEST_P(Pace, FixedStepStaysWithinAMilliampereAndAHundredthOfARpm) {
  PlantConfig config = load_plant_config(IMRIG_SOURCE_DIR "/models/plants/" + std::get<0>(GetParam()) + ".toml");
  config.inverter.kind = std::get<1>(GetParam());
  IntegratorConfig tight = config.integrator, fixed = config.integrator;
  tight.kind = IntegratorConfig::Kind::kSundials, tight.rtol = 1e-10, tight.atol = 1e-12;
  fixed.kind = IntegratorConfig::Kind::kRk4;
  const Trace reference = start_load_step(config, tight), rk4 = start_load_step(config, fixed);
  double square = 0.0, rpm = 0.0;
  for (std::size_t k = 0; k < reference.i.size(); ++k) {
    square += std::norm(rk4.i[k] - reference.i[k]);
    rpm = std::max(rpm, std::abs(rk4.rpm[k] - reference.rpm[k]));
  }
  const double rms_A = std::sqrt(square / static_cast<double>(reference.i.size()));
  std::printf("%s: RK4 from ERKStep at 1e-10: %.1e A rms, %.1e rpm at most\n", config.name.c_str(), rms_A, rpm);
  EXPECT_GT(reference.rpm[14000], 1700.0);                                // it did start
  EXPECT_LT(reference.rpm[kGatesOff_at - 1], reference.rpm[kStep_at] - 3.0);  // the step was one
  EXPECT_LT(reference.rpm.back(), 0.9 * reference.rpm[kGatesOff_at]);
  EXPECT_LT(rms_A, 1e-3);
  EXPECT_LT(rpm, 0.01);
}

INSTANTIATE_TEST_SUITE_P(ShippedPlants, Pace,
                         ::testing::Combine(::testing::Values("proca_5hp", "proca_5hp_ideal", "proca_5hp_full"),
                                            ::testing::Values(InverterConfig::Kind::kAveraged)),
                         told);
INSTANTIATE_TEST_SUITE_P(EverySwitchingInstant, Pace,
                         ::testing::Combine(::testing::Values("proca_5hp_full"),
                                            ::testing::Values(InverterConfig::Kind::kSwitching)),
                         told);

}  // namespace
}  // namespace imrig::plant
