#include "estimators/diagnose/missing/search.h"

#include <algorithm>
#include <cmath>

#include "rig/base/error.h"

namespace imrig::est {

namespace {

SearchChange change_of(const GlobalProblem& problem, const WorkingModel& model, std::string text,
                       std::string effect) {
  SearchChange out;
  out.text = std::move(text);
  out.effect = std::move(effect);
  out.fitted = judge(problem, model, problem.fitted());
  out.holdout = judge(problem, model, problem.holdout());
  return out;
}

// Effects that the others have made idle go again.
void prune(const GlobalProblem& problem, Search& search) {
  bool removed = true;
  while (removed && search.final.model.active.size() > 1) {
    removed = false;
    for (const Candidate& c : search.final.model.active) {
      if (c == search.final.model.active.back()) continue;
      Trial without = try_removing(problem, search.final.model, c.effect, problem.fitted());
      if (!without.sound || surely_better(search.final, without) > kTold) continue;
      if (without.left_out_chi2 > search.final.left_out_chi2 * 1.001) continue;
      const std::string name = name_of(c);
      search.final = std::move(without);
      search.changes.push_back(change_of(problem, search.final.model, "removed " + name, name));
      removed = true;
      break;
    }
  }
}

}  // namespace

Search search(const GlobalProblem& problem, const WorkingModel& start, const SearchOptions& options) {
  Search out;
  WorkingModel model = start;
  problem.settle(model.at, model.freedom().local, problem.all());
  if (options.report) options.report({"current model", 0, 1});
  out.final = refit(problem, model, problem.fitted());
  if (!out.final.sound)
    throw Error("model", "cannot be fitted to these data: " + out.final.unsound,
                "identify it from them first");
  out.changes.push_back(change_of(problem, out.final.model, "as it came, refitted", ""));
  for (std::size_t n = 0; n <= options.most_effects; ++n) {
    out.steps.push_back(search_step(problem, out.final, options.report));
    SearchStep& step = out.steps.back();
    if (step.claims.empty()) break;
    if (n == options.most_effects) {
      out.cut_short = true;
      break;
    }
    const Trial& best = step.trials[step.claims.front()];
    const std::string name = name_of(best.candidate);
    out.changes.push_back(
        change_of(problem, best.model, "added " + name + ", " + form_of(best.candidate).name, name));
    out.final = best;
    prune(problem, out);
  }
  Trial last_fit = finished(problem, out.final.model, problem.fitted());
  if (last_fit.sound) out.final = std::move(last_fit);
  const SearchChange& last = out.changes.back();
  const bool held = problem.holdout().empty() || last.holdout.chi2_per_value() < kBand;
  out.at_floor = last.fitted.chi2_per_value() < kBand && held;
  return out;
}

}  // namespace imrig::est
