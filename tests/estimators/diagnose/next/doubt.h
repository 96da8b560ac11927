#pragma once
// Data of a motor with a doubt about two effects, and the step of the search that is left with both.

#include <fmt/format.h>

#include "estimators/diagnose/next/next_experiment.h"
#include "estimators/model/effects/registry.h"
#include "tests/estimators/fit/synthetic.h"

namespace imrig::est::test {

inline const synthetic::Motor& bench_motor() { return synthetic::motors()[1]; }

inline Model model_of(const synthetic::Motor& m) {
  const double L_s = m.L_ls + m.L_m, L_r = m.L_lr + m.L_m, k = m.L_m / L_r;
  Model model;
  model.pole_pairs = m.pole_pairs;
  model.ratings.voltage_V = m.v_peak_V * std::sqrt(1.5);
  model.ratings.frequency_Hz = m.f_Hz;
  model.R_s = {m.R_s, 0.995 * m.R_s, 1.005 * m.R_s, "ohm", "dc test, 3 records"};
  model.R_r = {m.R_r * k * k, kMissing, kMissing, "ohm", ""};
  model.L_l = {L_s - m.L_m * k, kMissing, kMissing, "H", ""};
  model.L_m = {m.L_m * k, kMissing, kMissing, "H", ""};
  return model;
}

// One record of the data.
struct Taken {
  double voltage = 1.0, frequency = 1.0;  // over rated
  double slip = 0.0;                      // over rated
  double R_s = 1.0, R_r = 1.0;            // over the motor's
  double stator_C = kMissing;
};

inline DataSet data_of(const std::vector<Taken>& list, std::uint64_t seed) {
  const synthetic::Motor& motor = bench_motor();
  DataSet data;
  data.name = "doubt";
  data.pole_pairs = motor.pole_pairs;
  data.noise = {0.02, 0.1, 0.05, kMissing, kMissing};
  for (std::size_t n = 0; n < list.size(); ++n) {
    synthetic::Motor m = motor;
    m.R_s *= list[n].R_s;
    m.R_r *= list[n].R_r;
    Record record;
    record.id = fmt::format("r{}", n);
    record.kind = RecordKind::kStep;
    record.series = synthetic::record(
        m, synthetic::step_case(m, list[n].voltage, list[n].frequency,
                                list[n].slip * motor.slip / list[n].frequency, 200e-6, 1000));
    if (list[n].stator_C == list[n].stator_C)
      record.series.stator_C.assign(record.series.size(), list[n].stator_C);
    synthetic::add_noise(record.series, data.noise.current_A, data.noise.voltage_V, data.noise.speed_rad_s,
                         seed + n);
    data.records.push_back(std::move(record));
  }
  return data;
}

// Both effects refitted, as the search leaves them; each in its form, with the shapes of a scan.
inline SearchStep doubt(const GlobalProblem& problem, const Model& model,
                        const std::vector<Candidate>& both) {
  SearchStep step;
  WorkingModel working = working_model(problem, model);
  problem.settle(working.at, working.freedom().local, problem.all());
  step.base = refit(problem, working, problem.fitted());
  step.ranking = score_test(problem, step.base.model, both, problem.fitted());
  for (const Candidate& c : both) {
    for (const Score& s : step.ranking.scores) {
      if (!(s.candidate == c)) continue;
      step.trials.push_back(try_adding(problem, step.base.model, s, problem.fitted()));
      step.confusable.push_back(step.confusable.size());
    }
  }
  return step;
}

inline Candidate form_of_effect(const char* effect, std::size_t form = 0) {
  return {*effect_number(effect), form};
}

}  // namespace imrig::est::test
