#include "estimators/diagnose/missing/search.h"

#include <algorithm>
#include <cmath>

#include "estimators/diagnose/missing/neutral_amplitude.h"
#include "estimators/diagnose/missing/rivals.h"
#include "estimators/model/effects/registry.h"
#include "rig/base/error.h"

namespace imrig::est {

namespace {

constexpr int kMostRefits = 3;
constexpr double kDeeper = 0.01;  // of chi2

// A value for each record helps any fit a little: it must still be worth so many values beside the others.
bool needed(const GlobalProblem& problem, const Candidate& c, const Trial& with, const Trial& without) {
  if (form_of(c).local) {
    Trial own = with;
    own.candidate = c;
    if (!(c == with.candidate)) own.size_scatter = 0.0;  // that of what was changed last
    return worth_its_values(problem, own, without);
  }
  if (surely_better(with, without) > kTold || without.left_out_chi2 > with.left_out_chi2 * 1.001) return true;
  // One record at the far end, which a form cannot be held to without it, does not speak against the form.
  std::vector<double> gains = left_out_gains(with, without);
  if (!gains.empty()) gains.erase(std::min_element(gains.begin(), gains.end()));
  return surely_better(gains) > kTold;
}

// Effects that the others have made idle go again; the one that was added last stays.
void prune(const GlobalProblem& problem, std::size_t added, Search& search) {
  bool removed = true;
  while (removed && search.final.model.active.size() > 1) {
    removed = false;
    for (const Candidate& c : search.final.model.active) {
      if (c.effect == added) continue;
      Trial without = try_removing(problem, search.final.model, c.effect, problem.fitted());
      // One that may as well be zero is idle, though without it something else may weigh more (a DC test says
      // nothing of R_s beside an inverter's drop).
      const bool idle = !form_of(c).local && may_be_neutral(search.final.model, c);
      if (!without.sound || (!idle && needed(problem, c, search.final, without))) continue;
      const std::string name = name_of(c);
      search.final = std::move(without);
      note_change(problem, search, "removed " + name, name);
      removed = true;
      break;
    }
  }
}

// What is active is made as rich as the data ask, now that the others are there too.
void enrich_all(const GlobalProblem& problem, Search& search) {
  const std::vector<Candidate> active = search.final.model.active;
  for (const Candidate& c : active) {
    Trial richer = enriched(problem, search.final, c.effect);
    if (richer.model.active == search.final.model.active) continue;
    search.final = std::move(richer);
    note_change(problem, search, "made " + name_of(c) + " richer: " + form_of(search.final.candidate).name,
                name_of(c));
  }
}

// A shape may have settled in a hollow beside its valley while the effect that is there now was missing.
void leave_hollows(const GlobalProblem& problem, Search& search) {
  const std::vector<Candidate> active = search.final.model.active;
  for (std::size_t k = 0; k + 1 < active.size() && !inside_band(search.final); ++k) {
    Trial other = search.final;
    other.candidate = active[k];
    try_other_shapes(problem, search.final.model, kScans, problem.fitted(), other);
    if (other.chi2 < (1.0 - kDeeper) * search.final.chi2) search.final = std::move(other);
  }
}

// Values for each record become one law again where another effect has taken what the law could not follow.
void bind_temperatures(const GlobalProblem& problem, Search& search) {
  if (!problem.has_stator_C()) return;
  const std::vector<Candidate> active = search.final.model.active;
  for (const Candidate& c : active) {
    if (!form_of(c).local || kEffectInfos[c.effect].forms[0].local) continue;
    Trial bound = try_form(problem, search.final.model, {c.effect, 0}, problem.fitted());
    if (!bound.sound || needed(problem, c, search.final, bound)) continue;
    search.final = std::move(bound);
    note_change(problem, search,
                "made " + name_of(c) + " a law again: " + form_of(search.final.candidate).name, name_of(c));
  }
}

// A temperature whose law leaves too much gets a value for each record.
void free_temperatures(const GlobalProblem& problem, Search& search) {
  const std::vector<Candidate> active = search.final.model.active;
  for (const Candidate& c : active) {
    const auto forms = kEffectInfos[c.effect].forms;
    for (std::size_t f = 0; f < forms.size() && !form_of(c).local; ++f) {
      if (!forms[f].local) continue;
      Trial freed = try_form(problem, search.final.model, {c.effect, f}, problem.fitted());
      if (!worth_its_values(problem, freed, search.final)) continue;
      search.final = std::move(freed);
      note_change(problem, search, "made " + name_of(c) + " a value " + forms[f].name, name_of(c));
    }
  }
}

void accept(const GlobalProblem& problem, Search& search) {
  const SearchStep& step = search.steps.back();
  search.final = step.trials[step.claims.front()];
  const Candidate c = search.final.candidate;
  leave_hollows(problem, search);
  note_change(problem, search, "added " + name_of(c) + ", " + form_of(c).name, name_of(c));
  enrich_all(problem, search);
  prune(problem, c.effect, search);
  bind_temperatures(problem, search);
}

void add_one_by_one(const GlobalProblem& problem, const SearchOptions& options, Search& search) {
  bool by_record = !problem.has_stator_C();
  for (std::size_t n = 0; n <= options.most_additions;) {
    search.steps.push_back(search_step(problem, search.final, by_record, options.report));
    if (!search.steps.back().claims.empty()) {
      search.cut_short = n == options.most_additions;
      if (search.cut_short) return;
      accept(problem, search);
      ++n;
      continue;
    }
    if (by_record || inside_band(search.final)) return;
    by_record = true;
    free_temperatures(problem, search);
  }
}

// A torque that nothing in the model explains would bend R_s until the copper takes what bearings do.
Trial last_fit_of(const GlobalProblem& problem, const Trial& found) {
  if (any_needs_torque(found.model.active) || torque_inside_band(problem, found.torque))
    return finished(problem, found.model, problem.fitted());
  return finished(problem.without_torque(), found.model, problem.fitted());
}

}  // namespace

void note_change(const GlobalProblem& problem, Search& search, std::string text, std::string effect) {
  search.changes.push_back({std::move(text), std::move(effect),
                            judge(problem, search.final.model, problem.fitted()),
                            judge(problem, search.final.model, problem.holdout())});
}

bool inside_band(const GlobalProblem& problem, const Judgement& judgement) {
  if (judgement.values <= 0.0) return true;
  if (judgement.chi2_per_value() > kBand || !torque_inside_band(problem, judgement.torque)) return false;
  return problem.noise().colour > kBelieved ||
         judgement.error_over_noise() < std::max(kBand, 1.0 + kByChance * judgement.error_over_noise_sigma());
}

Search search(const GlobalProblem& problem, const WorkingModel& start, const SearchOptions& options) {
  Search out;
  WorkingModel model = start;
  problem.settle(model.at, model.freedom().local, problem.all());
  if (options.report) options.report({"current model", 0, 1});
  out.final = refit(problem, model, problem.fitted());
  // Data that hardly tell two parameters apart make a long valley.
  for (int n = 0; n < kMostRefits && !out.final.sound && std::isfinite(out.final.chi2); ++n)
    out.final = refit(problem, out.final.model, problem.fitted());
  if (!out.final.sound)
    throw Error("model", "cannot be fitted to these data: " + out.final.unsound,
                "identify it from them first");
  note_change(problem, out, "as it came, refitted", "");
  add_one_by_one(problem, options, out);
  settle_rivals(problem, start, out);
  Trial last_fit = last_fit_of(problem, out.final);
  if (last_fit.sound) out.final = std::move(last_fit);
  // Where the last fit left it.
  SearchChange& last = out.changes.back();
  last.fitted = judge(problem, out.final.model, problem.fitted());
  last.holdout = judge(problem, out.final.model, problem.holdout());
  out.at_floor = inside_band(problem, last.fitted) && inside_band(problem, last.holdout);
  return out;
}

}  // namespace imrig::est
