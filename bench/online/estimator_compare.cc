// The paper's observer and the joint filter on the same samples, against the plant's truth: error at settled points
// while the rotor warms, error while load, speed and voltage move, lag behind a rotor that warms fast, cost.

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "bench/one_core.h"
#include "bench/online/estimator_bench.h"
#include "rig/base/file.h"
#include "tests/estimators/online/emulated_motor.h"
#include "tests/estimators/online/fitted_model.h"
#include "tests/estimators/online/full_plant.h"

namespace imrig::bench {

namespace {

constexpr double kF_Hz = 60.0, kV = 180.0;
constexpr double kFields_A[] = {1.5, 1.8, 1.6, 1.9, 1.3, 1.7, 1.55};

std::string warming(const std::string& root, double rotor_J_per_K) {
  std::string toml = read_text(root + "/models/plants/proca_5hp.toml");
  const std::string slow = "\"sundials\"";
  toml.replace(toml.find(slow), slow.size(), "\"rk4\"");
  return toml + fmt::format("\n[effects.thermal]\nstator_J_per_K = 1500.0\nrotor_J_per_K = {}\niron_J_per_K = 9000.0\nstator_iron_W_per_K = 5.0\n"
                            "rotor_iron_W_per_K = 0.2\niron_ambient_W_per_K = 5.0\nambient_C = 20.0\nreference_C = 20.0\n",
                            rotor_J_per_K);
}

struct Point {
  double t_s, truth, observer, joint, joint_R_s, joint_L_m, R_s, L_m;
  bool steady;
};

struct Course {
  std::vector<Point> points;
  double observer_ns = 0.0, joint_ns = 0.0;
};

est::Model model_of(const std::string& toml, bool full) {
  const plant::PlantConfig config = plant::parse_plant_config(toml, "bench");
  return full ? test::fitted_model(config, kF_Hz, kV, 20.0).model : test::true_model(config, kF_Hz, kV, 20.0, 120.0);
}

// R_r is linear in the cage's temperature: two points of truth serve the whole run.
Course follow(const std::string& toml, const est::Model& model, double seconds, double step_s) {
  est::MotorEstimate now;
  std::optional<est::Estimator> estimator;
  test::EmulatedMotor motor(toml, [&](const est::SampleBlock& b) { estimator->feed(b); });
  est::EstimatorConfig config;
  config.follower.motor = est::knowledge_of(model);
  config.follower.settle_s = 0.0;
  Course out;
  std::vector<double> rotor_C;
  estimator.emplace(config, [&](const est::MotorEstimate& e) { now = e; });
  motor.rest(3.0);
  motor.run(1.5, kF_Hz, kV);
  for (int k = 0; motor.time_s() < seconds; ++k) {
    motor.excite(kFields_A[k % 7]);
    for (double t = 0.0; t < step_s; t += 0.2) {
      motor.run(0.2, kF_Hz, kV);
      const auto& f = now.findings;
      if (!f.R_1_ohm.known() || motor.slip() < 0.02) continue;
      rotor_C.push_back(motor.state().rotor_C);
      out.points.push_back({motor.time_s(), 0.0, now.R_r_here_ohm.value, f.joint_R_r_ohm.value, f.joint_R_s_ohm.value, f.joint_L_m_H.value, f.R_s_ohm.value,
                            config.follower.motor.base.L_m, now.point.steady});
    }
  }
  // Of the bars, in the proportion in which the model's circuit has them.
  const double scale = plant::inverse_gamma_truth(motor.config()).R_r_ohm / motor.truth(1e-3, 20.0).R_r_ohm;
  const double slip = 0.03, cold = scale * motor.truth(slip, 20.0).R_r_ohm, warm = scale * motor.truth(slip, 120.0).R_r_ohm;
  for (std::size_t k = 0; k < rotor_C.size(); ++k) out.points[k].truth = cold + (warm - cold) * (rotor_C[k] - 20.0) / 100.0;
  return out;
}

struct Error {
  double square = 0.0, worst = 0.0;
  int n = 0;
  void take(double found, double truth) {
    const double e = found / truth - 1.0;
    square += e * e;
    worst = std::max(worst, std::abs(e));
    ++n;
  }
  std::string text() const { return fmt::format("{:.2f} / {:.2f} %", 100.0 * std::sqrt(square / std::max(n, 1)), 100.0 * worst); }
};

// Time by which the estimates have to be moved forward to fit the truth best, s.
double lag_s(const std::vector<Point>& p, double Point::*found) {
  double best = 0.0, least = 1e300;
  for (int shift = 0; shift < 25; ++shift) {
    double sum = 0.0, mean = 0.0;
    int n = 0;
    for (std::size_t k = static_cast<std::size_t>(shift); k < p.size(); ++k, ++n) mean += std::log(p[k].*found / p[k - static_cast<std::size_t>(shift)].truth);
    mean /= n;
    for (std::size_t k = static_cast<std::size_t>(shift); k < p.size(); ++k)
      sum += std::pow(std::log(p[k].*found / p[k - static_cast<std::size_t>(shift)].truth) - mean, 2);
    if (sum / n < least) {
      least = sum / n;
      best = 0.2 * shift;
    }
  }
  return best;
}

// Core time a sample with one of both on.
double cost_ns(const std::string& toml, const est::Model& model, bool observe, bool joint) {
  std::vector<est::SampleBlock> blocks;
  std::vector<std::vector<std::int16_t>> counts;
  est::FollowerConfig config;
  double seconds = 0.0;
  std::int64_t samples = 0;
  std::optional<est::MotorFollower> follower;
  test::EmulatedMotor motor(toml, [&](const est::SampleBlock& b) {
    const double start = core_s();
    follower->take(b);
    seconds += core_s() - start;
    samples += static_cast<std::int64_t>(b.size());
  });
  config.motor = est::knowledge_of(model);
  config.observe = observe;
  config.joint = joint;
  config.simulate = false;
  follower.emplace(config);
  motor.excite(1.5);
  motor.run(1.5, kF_Hz, kV);
  seconds = 0.0;
  samples = 0;
  motor.run(4.0, kF_Hz, kV);
  return 1e9 * seconds / static_cast<double>(samples);
}

void compare_on(const char* name, const std::string& toml, const std::string& quick_toml, bool full) {
  const est::Model model = model_of(toml, full);
  const Course slow = follow(toml, model, 120.0, 4.0), quick = follow(quick_toml, model, 30.0, 100.0);
  Error observer, joint, observer_moving, joint_moving, R_s, L_m;
  for (const Point& p : slow.points) {
    if (p.t_s < 12.0) continue;  // the joint filter begins 30 % in doubt
    (p.steady ? observer : observer_moving).take(p.observer, p.truth);
    (p.steady ? joint : joint_moving).take(p.joint, p.truth);
    R_s.take(p.joint_R_s, p.R_s);
    L_m.take(p.joint_L_m, p.L_m);
  }
  const double nothing = cost_ns(toml, model, false, false);
  fmt::print("{:<34}{:>22}{:>22}\n", name, "observer", "joint filter");
  fmt::print("{:<34}{:>22}{:>22}   rms / worst, {} windows\n", "R_r, steady", observer.text(), joint.text(), observer.n);
  fmt::print("{:<34}{:>22}{:>22}   {} windows\n", "R_r, while the load moves", observer_moving.text(), joint_moving.text(), observer_moving.n);
  fmt::print("{:<34}{:>22}{:>22}\n", "R_s", "given", R_s.text());
  fmt::print("{:<34}{:>22}{:>22}\n", "L_m", "given", L_m.text());
  fmt::print("{:<34}{:>20.1f} s{:>20.1f} s   rotor warming by several K/s\n", "lag of R_r", lag_s(quick.points, &Point::observer), lag_s(quick.points, &Point::joint));
  fmt::print("{:<34}{:>19.0f} ns{:>19.0f} ns   of one core a sample, beside {:.0f} ns for both\n\n", "cost", cost_ns(toml, model, true, false) - nothing,
             cost_ns(toml, model, false, true) - nothing, nothing);
}

}  // namespace

void compare_estimators(const std::string& root) {
  compare_on("linear motor", warming(root, 230.0), warming(root, 30.0), false);
  const std::string full = test::full_plant(root, 1);
  compare_on("motor with all effects", full, test::exchanged_text(full, {{"rotor_J_per_K = 230.0", "rotor_J_per_K = 30.0"}}), true);
}

}  // namespace imrig::bench
