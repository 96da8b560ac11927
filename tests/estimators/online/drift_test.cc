// The running residual by condition: a motor whose cage has gained 10 % since this morning is seen in the conditions
// where the rotor carries current, by as much as the circuit says; one that has not changed shows nothing.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <map>

#include "estimators/online/estimator.h"
#include "tests/e2e/command.h"
#include "tests/estimators/online/emulated_motor.h"
#include "tests/estimators/online/full_plant.h"

namespace imrig::est {
namespace {

using test::EmulatedMotor;

struct Setting {
  double f_Hz, V, field_A;
};
constexpr Setting kSettings[] = {{60, 180, 0.0}, {60, 180, 1.2}, {60, 180, 1.5}, {60, 180, 1.8}, {45, 135, 1.35}};

std::string plant_with(const char* R_r_ohm) {
  return test::exchanged(test::source("models/plants/proca_5hp.toml"),
                         {{"\"sundials\"", "\"rk4\""}, {"R_r_ohm = 0.22", fmt::format("R_r_ohm = {}", R_r_ohm)}});
}

// What the last window of each setting said, and what the plant is there.
struct Seen {
  MotorEstimate last;
  plant::OperatingPoint truth;
};

// One day of one motor, at every setting; field_share keeps the slip where another R_r would move it.
std::vector<Seen> day(const std::string& toml, Estimator& estimator, MotorEstimate& now, std::int64_t& index, double seconds,
                      double field_share) {
  const std::int64_t from = index;
  EmulatedMotor motor(toml, [&](SampleBlock b) {
    b.first_index += from;
    index = b.first_index + static_cast<std::int64_t>(b.size());
    estimator.feed(b);
  });
  std::vector<Seen> out;
  motor.rest(2.5);
  for (const Setting& s : kSettings) {
    motor.excite(field_share * s.field_A);
    motor.run(1.5, s.f_Hz, s.V);
    motor.run(seconds, s.f_Hz, s.V);
    out.push_back({now, motor.truth(motor.slip())});
  }
  return out;
}

struct Days {
  std::vector<Seen> first, second;
};

Days two_days(const char* R_r_then, double field_share) {
  const std::string morning = plant_with("0.22");
  EstimatorConfig config;
  config.follower.motor =
      knowledge_of(test::true_model(plant::parse_plant_config(morning, "test"), 60.0, 180.0, 25.0, 125.0));
  MotorEstimate now;
  Estimator estimator(config, [&](const MotorEstimate& e) { now = e.window && e.point.steady ? e : now; });
  std::int64_t index = 0;
  Days out;
  out.first = day(morning, estimator, now, index, 8.0, 1.0);
  index += 1'000'000;  // a minute that nobody recorded
  out.second = day(plant_with(R_r_then), estimator, now, index, 20.0, field_share);
  return out;
}

TEST(Drift, OfTheRotorIsShownWhereTheRotorCarriesCurrentAndByHowMuch) {
  const Days days = two_days("0.242", std::sqrt(1.0 / 1.1));
  const plant::PlantConfig morning = plant::parse_plant_config(plant_with("0.22"), "test");
  fmt::print("{:>6}{:>6}{:>8}{:>10}{:>12}{:>12}\n", "f Hz", "V", "w_s", "drift %", "expected %", "sigma %");
  for (std::size_t k = 0; k < days.second.size(); ++k) {
    const MotorEstimate& e = days.second[k].last;
    ASSERT_EQ(e.condition, days.first[k].last.condition) << "the same cell on both days";
    ASSERT_TRUE(e.drift_here.known());
    // Against what the first day's motor draws at the second day's slip.
    const plant::OperatingPoint& then = days.second[k].truth;
    plant::PointRequest at;
    at.f_Hz = then.f_Hz;
    at.v_V = then.v_V;
    at.slip = then.slip;
    const plant::OperatingPoint before = plant::find_operating_point(morning, at);
    const double expected = std::abs(then.i_s / then.v_s - before.i_s / before.v_s) / std::abs(then.i_s / then.v_s);
    fmt::print("{:6}{:6}{:8}{:10.2f}{:12.2f}{:12.3f}\n", e.condition.f_Hz, e.condition.v_V, e.condition.w_s_rad_s,
               100 * e.drift_here.value, 100 * expected, 100 * e.drift_here.sigma);
    if (kSettings[k].field_A == 0.0) {
      EXPECT_LT(e.drift_here.value, 0.01) << "an idle rotor tells little";
      continue;
    }
    EXPECT_GT(e.drift_here.value - 1.96 * e.drift_here.sigma, 0.05);
    EXPECT_NEAR(e.drift_here.value, expected, 0.03 * expected);
    EXPECT_GT(e.residual_here.value, 0.02) << "and stands beside the model too";
  }
}

TEST(Drift, IsNotShownWhereNothingHasChanged) {
  const Days days = two_days("0.22", 1.0);
  for (const Seen& s : days.second) {
    const MotorEstimate& e = s.last;
    ASSERT_TRUE(e.drift_here.known());
    EXPECT_GT(e.windows_here, 40);
    EXPECT_LT(e.drift_here.value, 0.001) << e.condition.w_s_rad_s;
    EXPECT_LT(e.drift_here.value, 4.0 * e.drift_here.sigma);
  }
}

}  // namespace
}  // namespace imrig::est
