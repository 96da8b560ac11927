#include "estimators/diagnose/refit_model.h"

#include <fmt/format.h>

#include <algorithm>

#include "estimators/diagnose/missing/trial.h"
#include "estimators/model/effects/registry.h"
#include "rig/base/error.h"

namespace imrig::est {

namespace {

constexpr std::size_t kScouts = 40;

// An amplitude at rest has no direction to go: it starts where it matters.
void wake(const GlobalProblem& problem, WorkingModel& model) {
  for (const Candidate& c : model.active) {
    for (const std::size_t e : shared_entries(c)) {
      const EffectParameter& p = shared_parameter(e);
      if (p.role == Role::kAmplitude && model.at.shared[e] == p.neutral)
        model.at.shared[e] = p.neutral + material_size(problem, model.at.shared, e);
    }
  }
}

// Far from the minimum a part of many records, spread over all of them, shows the way as well.
void scout(const GlobalProblem& problem, WorkingModel& model) {
  const std::vector<std::size_t> all = problem.fitted();
  if (all.size() < 2 * kScouts) return;
  std::vector<std::size_t> some;
  for (std::size_t k = 0; k < kScouts; ++k) some.push_back(all[k * all.size() / kScouts]);
  problem.settle(model.at, model.freedom().local, some);
  Trial near = refit(problem, model, some);
  if (near.sound) model.at.shared = near.model.at.shared;
}

}  // namespace

Model refit_model(const Model& model, const DataSet& data, const std::string& change, int threads) {
  if (model.pole_pairs != data.pole_pairs) {
    throw Error("refit",
                fmt::format("the model \"{}\" has {} pole pairs, the data \"{}\" {}", model.name,
                            model.pole_pairs, data.name, data.pole_pairs),
                "they must be of one motor");
  }
  const GlobalProblem problem(data, model.machine(), threads, kThinnedTime_s,
                              any_needs_torque(active_effects(model)));
  if (problem.fitted().empty()) throw Error("refit", "finds hold-out records only", "some must be fitted");
  WorkingModel working = working_model(problem, model);
  wake(problem, working);
  scout(problem, working);
  problem.settle(working.at, working.freedom().local, problem.all());
  const Trial trial = finished(problem, working, problem.fitted());
  if (!trial.sound)
    throw Error("refit", trial.unsound, "start from a model that is closer, or with fewer effects");
  Model out = to_model(model, trial.model);
  const Judgement fitted = judge(problem, trial.model, problem.fitted()),
                  holdout = judge(problem, trial.model, problem.holdout());
  Revision r;
  r.number = out.history.empty() ? 1 : out.history.back().number + 1;
  r.change = change;
  r.data = data.name;
  r.data_hash = data.hash;
  r.fitted_nrmse = fitted.nrmse();
  r.holdout_nrmse = holdout.nrmse();
  r.floor_nrmse = fitted.floor();
  out.history.push_back(r);
  return out;
}

}  // namespace imrig::est
