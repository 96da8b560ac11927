#include "estimators/diagnose/missing/search_step.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "estimators/diagnose/missing/value_pattern.h"
#include "estimators/model/effects/registry.h"

namespace imrig::est {

namespace {

constexpr double kWorthTrying = 16.0;       // lambda of the score, in units of the misfit a value
constexpr double kShareWorthTrying = 0.03;  // of the largest lambda
constexpr double kLargeShare = 0.05;        // of the misfit
constexpr double kLocalGain = 4.0;          // drop of chi2 for each record's own unknown, in the same units
constexpr double kRicherGain = 0.02;        // share of the excess that a richer form must take away
constexpr double kRicherTold = 0.7;         // one record at the far end may carry it all
constexpr double kFamilyWise = 0.01;
constexpr double kLargeGain = 100.0;  // drop of chi2, in units of the misfit a value, and
constexpr double kLargeOfAll = 0.02;  // as a share of it
constexpr double kPlain = 8.0;        // standard errors, where noise alone might leave the misfit
constexpr double kOverNoise = 10.0;   // times what noise of the voltage does to the fit as it is
constexpr double kLeastMisfit = 0.6;  // chi2 a value
constexpr double kShareOfUnknown = 0.2;  // of chi2 below that
constexpr double kMostOfIt = 0.5;     // of the misfit, where one record shows it all
constexpr double kClose = 4.0, kCloseShare = 0.1;  // claims that are made as rich as the data ask
constexpr std::size_t kMostEnriched = 3;
// Noise that is not quite what was reckoned with moves values of each record a little, all of them at once.
constexpr double kLeastLocal = 100.0;
// One bar is as broken in every record: measured 0 to 0.04 where one is, 0.6 to 0.8 where something else is
// hidden.
constexpr double kMostScatter = 0.3;
constexpr double kLocalTold = 1.5;  // a few records may carry it all
constexpr std::size_t kFewestRecords = 6;  // before a value for each of them is a law at all
constexpr double kSimpler =
    3.0;  // a value for each record must leave so many times less than one law for all

double values_of(const Trial& trial) { return static_cast<double>(trial.model.fit.values); }

// Of a sensor error that is free inside its accuracy: how far outside it the refit lies, in sigma squared.
std::optional<double> beyond_accuracy(const Trial& trial, const Trial& base) {
  std::optional<double> z2;
  for (const Prior& p : base.model.priors) {
    if (p.entry < kBase || effect_of_shared(p.entry) != trial.candidate.effect) continue;
    z2 = z2.value_or(0.0) + std::pow((trial.model.at.shared[p.entry] - p.value) / p.sigma, 2);
  }
  return z2;
}

// A change that is forecast to be far too small for a claim is not tried, unless the forecast is one of
// something large, which may be wrong.
bool worth_trying(const GlobalProblem& problem, const Score& score, const Trial& base) {
  if (score.change.empty() || score.lambda > kLargeShare * base.chi2) return true;
  double size = 0.0;
  for (std::size_t k = 0; k < score.change.size(); ++k)
    size = std::max(
        size, std::abs(score.change[k]) / material_size(problem, base.model.at.shared, score.amplitudes[k]));
  return size > 0.5;
}

bool worth_its_values(const Trial& with, const Trial& base, std::size_t records) {
  if (records < kFewestRecords || with.size_scatter > kMostScatter) return false;
  const double own = static_cast<double>(records * local_entries(with.candidate).size());
  return base.chi2 - with.chi2 > std::max(kLocalGain * own, kLeastLocal) * scale_of(with) &&
         surely_better(with, base) > kLocalTold;
}

// One record at the far end of the data may carry a form by itself, and without it the form runs wild there: it
// is judged on the others.
bool richer_wins(const Trial& richer, const Trial& plain) {
  const double won = plain.chi2 - richer.chi2, above = std::max(0.0, plain.chi2 - values_of(plain));
  if (won < kRicherGain * above || won < kSure * kSure * scale_of(richer)) return false;
  double others = 0.0, worst = 0.0;
  for (const double gain : left_out_gains(richer, plain)) {
    others += gain;
    worst = std::min(worst, gain);
  }
  return others - worst > 0.0;
}

// The noise passes through the model into error and derivatives alike, and moves every parameter, one more
// with a new effect: to the second order chi2 falls by g' C g, g the expected gradient.
double noise_gain(const GlobalProblem& problem, const Trial& base) {
  const GlobalFit& fit = base.model.fit;
  if (fit.noise_covariance.size() == 0) return 0.0;
  const Eigen::VectorXd g = problem.noise_gradient(fit.at, fit.free.shared, problem.fitted());
  const double gain = g.dot(fit.noise_covariance * g);
  return std::isfinite(gain) ? gain : 0.0;
}

// Amplitude and shape may trade places, so that neither is sure by itself: then what the torque wins beside
// all that the transducer may do decides.
bool sure_of_torque(const GlobalProblem& problem, const Trial& trial, const Trial& base) {
  const double own = static_cast<double>(shared_entries(trial.candidate).size());
  const double won =
      base.torque.chi2_beside(problem.transducer()) - trial.torque.chi2_beside(problem.transducer());
  return trial.wald > kSure || (own > 1.0 && won > kSure * kSure * own);
}

// Values for each record that are a law of slip, frequency or flux are no heat.
bool follows_a_law(const GlobalProblem& problem, const Trial& trial) {
  const std::vector<ValuePattern> patterns = value_patterns(problem, trial);
  return std::any_of(patterns.begin(), patterns.end(), [&](const ValuePattern& p) {
    return p.effect == name_of(trial.candidate) && follows(p);
  });
}

// A misfit far below what was reckoned with: that was more than noise (ripple, harmonics, steps between
// samples), and nobody knows how it is distributed.
bool noise_is_known(const Trial& base) { return base.chi2 > kLeastMisfit * values_of(base); }

bool claimable(const GlobalProblem& problem, const SearchStep& step, const Trial& trial) {
  const std::size_t records = problem.fitted().size();
  const Trial& base = step.base;
  // What takes most of a misfit matters, however small its size is called.
  if (!trial.sound || !trial.determined || (trial.size < 1.0 && !explains_most(trial, base))) return false;
  // The model follows a sensor error inside its accuracy already, so records left out do not ask for it.
  if (const auto z2 = beyond_accuracy(trial, base)) return *z2 > kSure * kSure && trial.wald > kSure;
  const double won = base.chi2 - trial.chi2;
  if (won < kOverNoise * step.noise_gain) return false;
  if (!noise_is_known(base) && won < kShareOfUnknown * base.chi2) return false;
  // A speed that was rounded is off by a constant while it is held, and by another one a moment later: a
  // value for each record follows that too.
  const bool rounded = !base.model.local_nuisances.empty();
  if (form_of(trial.candidate).local)
    return !(rounded && name_of(trial.candidate) == "rotor_heating" && inside_band(base)) &&
           worth_its_values(trial, base, records) && !(inside_band(base) && follows_a_law(problem, trial));
  if (explains_most(trial, base)) return true;
  if (explains_torque(problem, trial, base) && sure_of_torque(problem, trial, base) &&
      surely_better(trial, base) > kTold)
    return true;
  if (base.left_out_chi2 <= trial.left_out_chi2) return false;
  // Amplitude and shape may trade places, so that neither is sure by itself though the effect is.
  const double better = surely_better(trial, base);
  const bool large = won > kLargeGain * scale_of(trial) && won > kLargeOfAll * base.chi2 && better > kTold;
  // Signs of a few records cannot be drawn often enough for a small p, however far from chance a size is.
  const bool plain = won > kLargeGain * scale_of(trial) && trial.wald > kPlain && inside_band(base);
  return large || (trial.wald > kSure && better > 1.0 &&
                   (plain || p_of(step.ranking, trial.candidate.effect) <= kFamilyWise));
}

// One law for all records is preferred to a value for each, unless it leaves much more unexplained.
void prefer_laws(const SearchStep& step, std::vector<std::size_t>& claims, double values) {
  if (claims.empty() || !form_of(step.trials[claims.front()].candidate).local) return;
  const double least = excess(step.trials[claims.front()], values);
  const double whole = excess(step.base, values);
  for (std::size_t k = 1; k < claims.size(); ++k) {
    const Trial& other = step.trials[claims[k]];
    if (form_of(other.candidate).local || excess(other, values) > kSimpler * least + kSameShare * whole)
      continue;
    std::rotate(claims.begin(), claims.begin() + static_cast<std::ptrdiff_t>(k),
                claims.begin() + static_cast<std::ptrdiff_t>(k) + 1);
    return;
  }
}

void find_confusable(SearchStep& step, double values) {
  if (step.claims.empty()) return;
  const Trial& best = step.trials[step.claims.front()];
  step.confusable = {step.claims.front()};
  const double whole = excess(step.base, values);
  for (const std::size_t k : step.claims) {
    const Trial& other = step.trials[k];
    if (other.candidate.effect == best.candidate.effect) continue;
    const bool named = std::any_of(step.confusable.begin(), step.confusable.end(), [&](std::size_t c) {
      return step.trials[c].candidate.effect == other.candidate.effect;
    });
    if (named) continue;
    if (form_of(best.candidate).local != form_of(other.candidate).local) continue;  // decided by prefer_laws
    if (same_worth(best, other, whole, values)) step.confusable.push_back(k);
  }
}

const Candidate& active_form(const WorkingModel& model, std::size_t effect) {
  return *std::find_if(model.active.begin(), model.active.end(),
                       [&](const Candidate& c) { return c.effect == effect; });
}

// A loss at the shaft whose plain law explains too little of the torque to be claimed: of a small motor,
// whose current is the magnetizing one for the most part, stray load loss by the rotor's current alone.
void enrich_losses(const GlobalProblem& problem, SearchStep& step) {
  for (Trial& trial : step.trials) {
    if (needs_torque(trial.candidate)) trial = enriched(problem, trial, trial.candidate.effect);
  }
}

// A shape may settle in a hollow beside its valley: where a claim leaves something, others are started from too.
void leave_hollows(const GlobalProblem& problem, const SearchStep& step, Trial& claim) {
  if (inside_band(claim)) return;
  const auto score = std::find_if(step.ranking.scores.begin(), step.ranking.scores.end(),
                                  [&](const Score& s) { return s.candidate == claim.candidate; });
  if (score != step.ranking.scores.end())
    try_other_shapes(problem, step.base.model, score->scan, problem.fitted(), claim);
}

// The forms of the claims that come close to the best are made as rich as the data ask, before they are
// compared: twins differ in their forms.
void enrich_claims(const GlobalProblem& problem, SearchStep& step, const std::vector<std::size_t>& claims,
                   double values) {
  if (claims.empty()) return;
  const double close =
      std::max(kClose * excess(step.trials[claims.front()], values), kCloseShare * excess(step.base, values));
  std::vector<std::size_t> done;
  for (const std::size_t k : claims) {
    const std::size_t effect = step.trials[k].candidate.effect;
    if (done.size() == kMostEnriched || std::find(done.begin(), done.end(), effect) != done.end()) continue;
    if (excess(step.trials[k], values) > close) continue;
    done.push_back(effect);
    leave_hollows(problem, step, step.trials[k]);
    step.trials[k] = enriched(problem, step.trials[k], effect);
  }
}

void sort_and_claim(const GlobalProblem& problem, SearchStep& step) {
  std::stable_sort(step.trials.begin(), step.trials.end(),
                   [](const Trial& a, const Trial& b) { return a.left_out_chi2 < b.left_out_chi2; });
  step.claims.clear();
  for (std::size_t k = 0; k < step.trials.size(); ++k) {
    if (claimable(problem, step, step.trials[k])) step.claims.push_back(k);
  }
}

}  // namespace

bool worth_its_values(const GlobalProblem& problem, const Trial& with, const Trial& base) {
  return with.sound && base.chi2 - with.chi2 > kOverNoise * noise_gain(problem, base) &&
         worth_its_values(with, base, problem.fitted().size());
}

bool inside_band(const Trial& trial) { return chi2_per_value(trial) < kBand; }

bool explains_most(const Trial& trial, const Trial& base) {
  const double values = values_of(base), whole = base.chi2 - values, left = trial.chi2 - values;
  return base.chi2 > kBand * values && base.chi2 - trial.chi2 > kLargeGain * scale_of(trial) &&
         left < (1.0 - kMostOfIt) * whole;
}

double torque_chi2_per_value(const GlobalProblem& problem, const TorqueSums& torque) {
  return torque.values() > 0.0 ? torque.chi2_beside(problem.transducer()) / torque.values() : 0.0;
}

bool torque_inside_band(const GlobalProblem& problem, const TorqueSums& torque) {
  const double by_chance = kByChance * std::sqrt(2.0 / std::max(1.0, torque.values()));
  return torque_chi2_per_value(problem, torque) < std::max(kBand, 1.0 + by_chance);
}

bool explains_torque(const GlobalProblem& problem, const Trial& trial, const Trial& base) {
  const double before = torque_chi2_per_value(problem, base.torque),
               after = torque_chi2_per_value(problem, trial.torque);
  return needs_torque(trial.candidate) && !torque_inside_band(problem, base.torque) &&
         after - 1.0 < (1.0 - kMostOfIt) * (before - 1.0);
}

bool same_worth(const Trial& best, const Trial& other, double whole, double values) {
  // One record that carries most of it must not hide that all others say the same.
  std::vector<double> gains = left_out_gains(best, other);
  const double all = surely_better(gains);
  if (!gains.empty()) gains.erase(std::max_element(gains.begin(), gains.end()));
  const double lost = other.chi2 - best.chi2;
  const bool takes_little = lost > kMostOfIt * whole && lost > kLargeGain * scale_of(best);
  if (!takes_little && all < kTold && surely_better(gains) < kTold) return true;
  // What the best itself leaves over tells how little its form can be trusted.
  const double behind = other.left_out_chi2 - best.left_out_chi2;
  return behind < std::min(kSameShare * whole, excess(best, values));
}

Trial enriched(const GlobalProblem& problem, const Trial& trial, std::size_t effect) {
  Trial best = trial;
  WorkingModel from = trial.model;  // a form that did not settle may still lead to one that does
  const auto forms = kEffectInfos[effect].forms;
  for (std::size_t f = active_form(best.model, effect).form + 1; f < forms.size(); ++f) {
    if (forms[f].local) continue;
    Trial richer = try_form(problem, from, {effect, f}, problem.fitted());
    if (richer.chi2 < best.chi2) from = richer.model;
    if (richer.sound && richer.determined && richer_wins(richer, best)) best = std::move(richer);
  }
  return best;
}

double p_of(const ScoreTest& ranking, std::size_t effect) {
  double p = 1.0;
  for (const Score& s : ranking.scores) {
    if (s.candidate.effect == effect) p = std::min(p, s.p_value);
  }
  return p;
}

double excess(const Trial& trial, double values) { return std::max(0.0, trial.left_out_chi2 - values); }

std::vector<Candidate> candidates_for(const GlobalProblem& problem, const WorkingModel& model,
                                      bool by_record) {
  const bool series = std::any_of(problem.entries().begin(), problem.entries().end(),
                                  [](const auto& e) { return e.series != nullptr; });
  std::vector<Candidate> out;
  for (std::size_t k = 0; k < kEffects; ++k) {
    if (model.has(k) || std::count(model.barred.begin(), model.barred.end(), k) > 0) continue;
    const EffectInfo& info = kEffectInfos[k];
    if (info.correction || (info.needs == Needs::kTorque && !problem.has_torque())) continue;
    if (info.needs == Needs::kSeries && !series) continue;
    const std::string_view name = info.name;
    const bool heat = name == "rotor_heating" || name == "stator_heating";
    for (std::size_t f = 0; f < info.forms.size(); ++f) {
      if (info.forms[f].richer) continue;
      if (heat && (info.forms[f].local ? !by_record : !problem.has_stator_C())) continue;
      if (info.forms[f].local && !series) continue;
      out.push_back({k, f});
    }
  }
  return out;
}

SearchStep search_step(const GlobalProblem& problem, Trial base, bool by_record, const SearchReport& report) {
  SearchStep step;
  const auto which = problem.fitted();
  const auto tell = [&](const std::string& what, std::size_t done, std::size_t total) {
    if (report) report({what, done, total});
  };
  step.base = std::move(base);
  step.noise_gain = noise_gain(problem, step.base);
  tell("ranking", 0, 1);
  step.ranking =
      score_test(problem, step.base.model, candidates_for(problem, step.base.model, by_record), which);
  std::vector<const Score*> wanted;
  const double largest = step.ranking.scores.empty() ? 0.0 : step.ranking.scores.front().lambda;
  const double least =
      std::max(kWorthTrying * std::max(1.0, 0.2 * scale_of(step.base)), kShareWorthTrying * largest);
  for (const Score& score : step.ranking.scores) {
    if (wanted.size() < kMostTrials && score.lambda > least && worth_trying(problem, score, step.base))
      wanted.push_back(&score);
  }
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    tell(name_of(wanted[k]->candidate), k, wanted.size());
    step.trials.push_back(try_adding(problem, step.base.model, *wanted[k], which));
  }
  tell("done", wanted.size(), wanted.size());
  const double values = values_of(step.base);
  sort_and_claim(problem, step);
  if (step.claims.empty() && !torque_inside_band(problem, step.base.torque)) {
    enrich_losses(problem, step);
    sort_and_claim(problem, step);
  }
  enrich_claims(problem, step, step.claims, values);
  sort_and_claim(problem, step);
  prefer_laws(step, step.claims, values);
  find_confusable(step, values);
  return step;
}

}  // namespace imrig::est
