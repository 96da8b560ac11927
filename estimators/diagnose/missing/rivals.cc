#include "estimators/diagnose/missing/rivals.h"

#include <algorithm>
#include <optional>

#include "estimators/model/effects/registry.h"

namespace imrig::est {

namespace {

constexpr std::size_t kMostRivals = 3;
constexpr int kMostSwaps = 4;
constexpr double kShareOfBest = 0.5;  // of what the best claim of a step wins, for a rival worth a fit

// Sound trials of effects that are not in the model and won much in the step that accepted this effect.
std::vector<const Trial*> rivals_of(const Search& search, std::size_t effect) {
  std::vector<const Trial*> out;
  for (const SearchStep& step : search.steps) {
    if (step.claims.empty()) continue;
    const Trial& best = step.trials[step.claims.front()];
    const bool own = best.candidate.effect == effect;
    const double won = step.base.left_out_chi2 - best.left_out_chi2;
    for (const Trial& t : step.trials) {
      if (!t.sound || t.candidate.effect == effect || search.final.model.has(t.candidate.effect)) continue;
      if (!own && out.size() >= kMostRivals) continue;
      if (step.base.left_out_chi2 - t.left_out_chi2 < kShareOfBest * won) continue;
      const bool known =
          std::any_of(out.begin(), out.end(), [&](const Trial* o) { return o->candidate == t.candidate; });
      if (!known) out.push_back(&t);
    }
  }
  if (out.size() > kMostRivals) out.resize(kMostRivals);
  return out;
}

std::vector<Candidate> accepted(const WorkingModel& start, const WorkingModel& model) {
  std::vector<Candidate> out;
  for (const Candidate& c : model.active) {
    if (!start.has(c.effect)) out.push_back(c);
  }
  return out;
}

// One effect alone: the step that accepted it has compared it with its rivals.
std::vector<std::size_t> rivals_in_step(const Search& search, std::size_t effect) {
  for (const SearchStep& step : search.steps) {
    if (step.confusable.empty() || step.trials[step.confusable.front()].candidate.effect != effect) continue;
    std::vector<std::size_t> out;
    for (std::size_t k = 1; k < step.confusable.size(); ++k)
      out.push_back(step.trials[step.confusable[k]].candidate.effect);
    return out;
  }
  return {};
}

void add(std::vector<std::size_t>& list, std::size_t effect) {
  if (std::find(list.begin(), list.end(), effect) == list.end()) list.push_back(effect);
}

// Named for lying outside its accuracy: taken out, it is still followed, and nothing has to explain it instead.
bool sensor_error(const WorkingModel& model, std::size_t effect) {
  return std::any_of(model.nuisances.begin(), model.nuisances.end(),
                     [&](std::size_t e) { return effect_of_shared(e) == effect; });
}

struct Swap {
  std::size_t out;
  Trial trial;
};

// The best swap that records left out ask for; rivals that do as well are noted.
std::optional<Swap> best_swap(const GlobalProblem& problem, Search& search, double whole) {
  std::optional<Swap> best;
  const double values = static_cast<double>(search.final.model.fit.values);
  for (Finding& finding : search.findings) {
    finding.rivals.clear();
    if (sensor_error(search.final.model, finding.candidate.effect)) continue;
    for (const Trial* rival : rivals_of(search, finding.candidate.effect)) {
      Trial trial =
          try_swapping(problem, search.final.model, finding.candidate.effect, *rival, problem.fitted());
      if (!trial.sound) continue;
      if (surely_better(trial, search.final) > kTold && !same_worth(trial, search.final, whole, values)) {
        if (!best || trial.left_out_chi2 < best->trial.left_out_chi2)
          best = Swap{finding.candidate.effect, std::move(trial)};
      } else if (same_worth(search.final, trial, whole, values)) {
        add(finding.rivals, trial.candidate.effect);
      }
    }
  }
  return best;
}

}  // namespace

void settle_rivals(const GlobalProblem& problem, const WorkingModel& start, Search& search) {
  const auto list = [&] {
    search.findings.clear();
    for (const Candidate& c : accepted(start, search.final.model)) search.findings.push_back({c, {}});
  };
  list();
  if (search.findings.size() == 1) {
    search.findings.front().rivals = rivals_in_step(search, search.findings.front().candidate.effect);
    return;
  }
  const double whole = excess(search.steps.front().base, static_cast<double>(search.final.model.fit.values));
  for (int n = 0; n < kMostSwaps && search.findings.size() > 1; ++n) {
    std::optional<Swap> swap = best_swap(problem, search, whole);
    if (!swap) return;
    Candidate out;
    for (const Finding& f : search.findings) {
      if (f.candidate.effect == swap->out) out = f.candidate;
    }
    search.final = enriched(problem, swap->trial, swap->trial.candidate.effect);
    note_change(problem, search, "put " + name_of(swap->trial.candidate) + " in the place of " + name_of(out),
                name_of(swap->trial.candidate));
    list();
  }
}

}  // namespace imrig::est
