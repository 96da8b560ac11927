// The rotor warms from 20 to 120 C within minutes under a load that keeps changing, seen through 12-bit converters
// with noise, offsets and gain errors: how well its resistance is followed.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "estimators/online/estimator.h"
#include "rig/base/file.h"
#include "tests/e2e/command.h"
#include "tests/estimators/online/emulated_motor.h"

namespace imrig::est {
namespace {

using test::EmulatedMotor;

std::string warming_plant(int seed) {
  std::string toml = read_text(test::source("models/plants/proca_5hp.toml"));
  const auto set = [&](const std::string& from, const std::string& to) { toml.replace(toml.find(from), from.size(), to); };
  set("\"sundials\"", "\"rk4\"");
  set("seed = 1", "seed = " + std::to_string(seed));
  return toml + R"(
[effects.thermal]
stator_J_per_K = 1500.0
rotor_J_per_K = 230.0
iron_J_per_K = 9000.0
stator_iron_W_per_K = 5.0
rotor_iron_W_per_K = 0.2
iron_ambient_W_per_K = 5.0
ambient_C = 20.0
reference_C = 20.0

[effects.rotor_skin_effect]
bar_height_m = 0.03
resistivity_ohm_m = 2.83e-8
bar_fraction = 0.6
)";
}

EstimatorConfig config_of(const Model& model) {
  EstimatorConfig c;
  c.follower.motor = knowledge_of(model);
  c.follower.current_gain_sigma = c.follower.voltage_gain_sigma = 0.001;
  return c;
}

struct Worst {
  double R_r = 0.0, R_1 = 0.0, predicted = 0.0, joint = 0.0;
  int points = 0, predictions = 0;
};

void take(double& worst, double found, double truth) { worst = std::max(worst, std::abs(found / truth - 1.0)); }

class Tracking : public ::testing::TestWithParam<int> {};

TEST_P(Tracking, FollowsARotorThatWarmsFrom20To120DegreesUnderChangingLoad) {
  const double f = 60.0, V = 180.0;
  MotorEstimate now;
  std::optional<Estimator> estimator;
  EmulatedMotor motor(warming_plant(GetParam()), [&](const SampleBlock& b) { estimator->feed(b); });
  const Model model = test::true_model(motor.config(), f, V, 20.0, 120.0);
  const double k_6 = model.effects[0].parameters.at("k6_ohm_s").value;
  estimator.emplace(config_of(model), [&](const MotorEstimate& e) { now = e; });
  motor.rest(3.0);
  motor.run(1.5, f, V);
  Worst worst;
  const double fields_A[] = {1.5, 1.8, 1.6, 1.9, 1.3, 1.7, 2.0, 0.6, 1.55};
  fmt::print("seed {}\n{:>6}{:>9}{:>8}{:>10}{:>10}{:>8}{:>9}{:>14}{:>9}{:>8}\n", GetParam(), "t s", "rotor C", "slip %", "R_r true", "R_r ohm",
             "err %", "R_1 err", "predicted err", "joint", "age s");
  for (int step = 0; motor.state().rotor_C < 120.0; ++step) {
    ASSERT_LT(step, 80) << "the rotor does not warm";
    motor.excite(fields_A[step % 9]);
    // The last estimate of the transient tells R_r at the slip that the motor settles at.
    std::optional<MotorEstimate> before;
    double before_C = 0.0;
    for (int slice = 0; slice < 20; ++slice) {
      motor.run(0.2, f, V);
      if (now.point.steady && before) break;
      if (now.point.steady) continue;
      before = now;
      before_C = motor.state().rotor_C;
    }
    const double settled = motor.slip();
    motor.run(3.0, f, V);
    const double slip = motor.slip();
    if (slip < 0.02) continue;
    const double R_r = motor.truth(slip).secant.R_r_ohm, R_1 = motor.truth(1e-3).secant.R_r_ohm;
    ASSERT_TRUE(now.point.steady && now.R_r_here_ohm.known());
    ASSERT_TRUE(before);
    take(worst.R_r, now.R_r_here_ohm.value, R_r);
    take(worst.R_r, now.findings.R_r_ohm.value, R_r);
    take(worst.R_1, now.findings.R_1_ohm.value, R_1);
    take(worst.joint, now.findings.joint_R_r_ohm.value, R_r);
    EXPECT_LT(std::abs(now.R_r_here_ohm.value - R_r), 1.96 * now.R_r_here_ohm.sigma) << "outside its own interval";
    double predicted = kUnknown;
    if (before->findings.R_1_ohm.known()) {
      const double truth = motor.truth(settled, before_C).secant.R_r_ohm;
      predicted = before->findings.R_1_ohm.value + k_6 * 2.0 * kPi * f * settled;
      take(worst.predicted, predicted, truth);
      predicted = 100 * (predicted / truth - 1.0);
      ++worst.predictions;
    }
    const auto age = static_cast<double>(now.point.last_index - now.findings.R_r_ohm.last_index) * motor.sample_s();
    EXPECT_LT(age, 0.5);
    fmt::print("{:6.1f}{:9.1f}{:8.2f}{:10.4f}{:10.4f}{:+8.2f}{:+9.2f}{:+14.2f}{:+9.2f}{:8.2f}\n", motor.time_s(), motor.state().rotor_C,
               100 * slip, R_r, now.R_r_here_ohm.value, 100 * (now.R_r_here_ohm.value / R_r - 1.0),
               100 * (now.findings.R_1_ohm.value / R_1 - 1.0), predicted, 100 * (now.findings.joint_R_r_ohm.value / R_r - 1.0), age);
    ++worst.points;
  }
  fmt::print("seed {}, {} points at slip > 2 %: R_r {:.2f} %, R_1 {:.2f} %, {} predictions {:.2f} %, joint filter {:.2f} %\n", GetParam(),
             worst.points, 100 * worst.R_r, 100 * worst.R_1, worst.predictions, 100 * worst.predicted, 100 * worst.joint);
  EXPECT_GT(worst.points, 20);
  EXPECT_GT(worst.predictions, 20);
  EXPECT_LT(worst.R_r, 0.02);
  EXPECT_LT(worst.R_1, 0.015);
  EXPECT_LT(worst.predicted, 0.02);
  // Against the thermometer of the plant: R_1 tells the cage's temperature.
  EXPECT_NEAR(now.rotor_C.value, motor.state().rotor_C, 5.0);
}

INSTANTIATE_TEST_SUITE_P(Seeds, Tracking, ::testing::Values(1, 2, 3));

}  // namespace
}  // namespace imrig::est
