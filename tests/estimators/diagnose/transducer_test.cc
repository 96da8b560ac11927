// What errors of the torque transducer do to a fit, which neither follows nor sees them: told beforehand, to
// first order, and here made.

#include <gtest/gtest.h>

#include <cmath>

#include "estimators/diagnose/missing/trial.h"
#include "tests/estimators/fit/shaft_torque.h"

namespace imrig::est {
namespace {

using namespace shaft_torque;

constexpr double kLost_Nm = 0.8;

std::vector<Record> loads(const synthetic::Motor& motor) {
  std::vector<Record> out;
  for (const double f : {0.4, 1.0}) {
    for (const double slip : {0.01, 0.02, 0.04}) out.push_back(record_of(motor, {f, slip}, kLost_Nm));
  }
  return out;
}

struct Fitted {
  Trial trial;
  TransducerAccuracy transducer;
};

// Friction as well as the circuit, where the transducer is off by so much.
Fitted fitted(const synthetic::Motor& motor, double gain, double zero_Nm) {
  std::vector<Record> records = loads(motor);
  for (Record& r : records) {
    for (double& T : r.series.torque_Nm) T = (1.0 + gain) * T + zero_Nm;
  }
  const DataSet data = set_of(motor, std::move(records));
  const GlobalProblem problem(data, truth(motor), 1, kThinnedTime_s, true);
  const auto p = truth(motor);
  Model model;
  model.pole_pairs = motor.pole_pairs;
  model.R_s.value = p.R_s, model.R_r.value = p.R_r, model.L_l.value = p.L_l, model.L_m.value = p.L_m;
  WorkingModel working = working_model(problem, model);
  working.active = {{*effect_number("friction_windage"), 0}};
  return {finished(problem, working, problem.all()), problem.transducer()};
}

TEST(TransducerErrors, MoveAFitByWhatIsToldBeforehand) {
  const auto& motor = synthetic::motors()[1];
  const auto [as_it_is, sigma] = fitted(motor, 0.0, 0.0);
  ASSERT_TRUE(as_it_is.sound) << as_it_is.unsound;
  const Trial gain = fitted(motor, sigma.gain, 0.0).trial, zero = fitted(motor, 0.0, sigma.zero_Nm).trial;
  const std::size_t coulomb = entry_of("friction_windage.coulomb_Nm");
  EXPECT_NEAR(as_it_is.model.at.shared[coulomb], kLost_Nm, 0.02 * kLost_Nm);
  for (const std::size_t e : {std::size_t{0}, coulomb}) {
    const auto moved = [&](const Trial& t) { return t.model.at.shared[e] - as_it_is.model.at.shared[e]; };
    const double made = std::hypot(moved(gain), moved(zero)), told = as_it_is.model.unseen_sigma(e);
    EXPECT_GT(made, 0.0) << shared_name(e);
    EXPECT_NEAR(told / made, 1.0, 0.05) << shared_name(e);
    EXPECT_GE(as_it_is.model.sigma(e), told) << shared_name(e) << ": part of its interval";
  }
}

TEST(TransducerErrors, AreNothingToAModelThatNeedsNoTorque) {
  const auto& motor = synthetic::motors()[1];
  const DataSet data = set_of(motor, loads(motor));
  const GlobalProblem problem(data, truth(motor), 1, kThinnedTime_s);
  WorkingModel working;
  working.at = problem.start(at(truth(motor)));
  EXPECT_TRUE(finished(problem, working, problem.all()).model.unseen.empty());
}

}  // namespace
}  // namespace imrig::est
