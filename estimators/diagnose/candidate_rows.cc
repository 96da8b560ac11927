#include "estimators/diagnose/candidate_rows.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "estimators/diagnose/missing/record_values.h"
#include "estimators/fit/student_t.h"
#include "estimators/model/effects/registry.h"

namespace imrig::est {

namespace {

constexpr double kWide = 5.0;  // an effect of so many times what matters must show, or the data cannot tell

double family_wise(double z) {
  return std::min(1.0, static_cast<double>(kLibrary) * std::erfc(z / std::sqrt(2.0)));
}

void add_estimate(const WorkingModel& model, const Candidate& candidate, CandidateResult& out) {
  out.form = form_of(candidate).name;
  out.estimate.clear();
  for (const std::size_t e : shared_entries(candidate)) {
    const EffectParameter& p = shared_parameter(e);
    const double value = model.at.shared[e], sigma = model.sigma(e);
    out.estimate[p.name] = {value, value - kNormal975 * sigma, value + kNormal975 * sigma, p.unit, "refit"};
  }
}

// Verdict on an effect that is not claimed, from its forecast.
std::string quiet_verdict(const GlobalProblem& problem, const SearchStep& step, const Score& score,
                          const Trial* trial) {
  double size = 0.0, width = 0.0;
  for (std::size_t k = 0; k < score.change.size(); ++k) {
    const double matters = material_size(problem, step.base.model.at.shared, score.amplitudes[k]);
    size = std::max(size, std::abs(score.change[k]) / matters);
    width = std::max(width, kSure * score.sigma[k] / matters);
  }
  if (trial != nullptr && !trial->sound) return "cannot tell";
  if (score.change.empty() && !form_of(score.candidate).local) return "cannot tell";
  if (width > kWide) return "cannot tell";
  if (trial != nullptr && trial->wald > kSure) return trial->size < 1.0 ? "negligible" : "cannot tell";
  return size < 1.0 ? "absent" : trial != nullptr ? "cannot tell" : "negligible";
}
bool rival(const Diagnosis& d, std::size_t effect) {
  return std::any_of(d.search.findings.begin(), d.search.findings.end(), [&](const Finding& f) {
    return std::find(f.rivals.begin(), f.rivals.end(), effect) != f.rivals.end();
  });
}

// The effect's claim, else its best trial; null where it was not worth one.
const Trial* trial_of(const SearchStep& step, std::size_t effect) {
  for (const std::size_t k : step.claims) {
    if (step.trials[k].candidate.effect == effect) return &step.trials[k];
  }
  const auto found = std::find_if(step.trials.begin(), step.trials.end(),
                                  [&](const Trial& t) { return t.candidate.effect == effect; });
  return found == step.trials.end() ? nullptr : &*found;
}

// The step that accepted the effect, else the last one: what it would be beside all that was accepted.
const SearchStep& step_of(const Search& search, std::size_t effect) {
  const auto found = std::find_if(search.steps.begin(), search.steps.end(), [&](const SearchStep& s) {
    return !s.claims.empty() && s.trials[s.claims.front()].candidate.effect == effect;
  });
  return found == search.steps.end() ? search.steps.back() : *found;
}

const Score* score_of(const SearchStep& step, std::size_t effect) {
  const auto found = std::find_if(step.ranking.scores.begin(), step.ranking.scores.end(),
                                  [&](const Score& s) { return s.candidate.effect == effect; });
  return found == step.ranking.scores.end() ? nullptr : &*found;
}

// Family-wise: of the score's random signs, or of a refit's where no sign can tell (values for each record,
// sensor errors inside their accuracy, one record that shows it all).
double p_value(const SearchStep& step, const Trial* trial, std::size_t effect) {
  const double p = p_of(step.ranking, effect);
  if (trial == nullptr) return p;
  const double drop = (step.base.chi2 - trial->chi2) / scale_of(*trial);
  if (form_of(trial->candidate).local) {  // chi2 of so many values, as a normal deviate
    const double values = std::max(1.0, step.base.model.fit.dof - trial->model.fit.dof);
    return family_wise(std::max(0.0, (drop - values) / std::sqrt(2.0 * values)));
  }
  if (explains_most(*trial, step.base)) return std::min(p, family_wise(std::sqrt(drop)));
  return p == 1.0 ? family_wise(trial->wald) : p;
}

}  // namespace

bool accepted(const Diagnosis& d, std::size_t effect) {
  return std::any_of(d.search.findings.begin(), d.search.findings.end(),
                     [&](const Finding& f) { return f.candidate.effect == effect; });
}

void add_candidates(const GlobalProblem& problem, const SearchStep& step, Diagnosis& out) {
  std::set<std::size_t> done;
  const double before = judge(problem, step.base.model, problem.holdout()).nrmse();
  const auto row = [&](const Score& score) {
    const std::size_t effect = score.candidate.effect;
    if (!done.insert(effect).second) return;
    CandidateResult c;
    c.effect = kEffectInfos[effect].name;
    c.score = score.lambda;
    c.holdout_nrmse_before = before;
    if (const Trial* trial = trial_of(step, effect))
      c.holdout_nrmse_after = judge(problem, trial->model, problem.holdout()).nrmse();
    // What it is, beside all else that was accepted.
    const SearchStep& late = rival(out, effect) ? step : step_of(out.search, effect);
    const Score* found = score_of(late, effect);
    const SearchStep& own = found == nullptr ? step : late;
    const Score& last = found == nullptr ? score : *found;
    const Trial* trial = trial_of(own, effect);
    c.p_value = p_value(own, trial, effect);
    c.form = form_of(last.candidate).name;
    if (trial != nullptr) {
      add_estimate(trial->model, trial->candidate, c);
    } else {
      for (std::size_t k = 0; k < last.change.size(); ++k) {
        const EffectParameter& p = shared_parameter(last.amplitudes[k]);
        const double value = p.neutral + last.change[k];
        c.estimate[p.name] = {value, value - kNormal975 * last.sigma[k], value + kNormal975 * last.sigma[k],
                              p.unit, "forecast"};
      }
    }
    for (const Finding& f : out.search.findings) {
      if (f.candidate.effect != effect) continue;
      add_estimate(out.search.final.model, f.candidate, c);
      if (form_of(f.candidate).local)
        c.estimate = estimates_by_record(problem, out.search.final, f.candidate);
    }
    c.verdict = accepted(out, effect) ? "missing"
                : rival(out, effect)  ? "confusable"
                                      : quiet_verdict(problem, own, last, trial);
    double d = 1e9;
    for (std::size_t a = 0; a < step.ranking.scores.size(); ++a) {
      if (!(step.ranking.scores[a].candidate == score.candidate)) continue;
      for (std::size_t b = 0; b < step.ranking.scores.size(); ++b) {
        if (step.ranking.scores[b].candidate.effect != effect &&
            step.ranking.scores[b].lambda > 0.1 * score.lambda)
          d = std::min(d, step.ranking.separation(a, b));
      }
    }
    if (d < 1e9) c.distinguishability = d;
    out.candidates.push_back(std::move(c));
  };
  const auto row_of = [&](std::size_t effect) {
    for (const Score& s : step.ranking.scores) {
      if (s.candidate.effect == effect) row(s);
    }
  };
  // What was accepted first, in its order, then what may stand in its place; then the rest by score.
  for (const Finding& f : out.search.findings) row_of(f.candidate.effect);
  for (const Finding& f : out.search.findings) std::for_each(f.rivals.begin(), f.rivals.end(), row_of);
  for (const std::size_t k : step.claims) row_of(step.trials[k].candidate.effect);
  for (const Score& s : step.ranking.scores) row(s);
}

}  // namespace imrig::est
