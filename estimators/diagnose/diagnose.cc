#include "estimators/diagnose/diagnose.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>

#include "estimators/diagnose/missing/neutral_amplitude.h"
#include "estimators/diagnose/missing/parts.h"
#include "estimators/diagnose/missing/unexplained.h"
#include "estimators/fit/global/driven_record.h"
#include "estimators/fit/global/start_from_data.h"
#include "estimators/fit/student_t.h"
#include "estimators/model/effects/registry.h"
#include "rig/base/error.h"
#include "rig/base/listed.h"

namespace imrig::est {

namespace {

constexpr double kExplained = 0.85;  // share of the excess that an explanation must take away
constexpr double kWide = 5.0;  // an effect of so many times what matters must show, or the data cannot tell
constexpr double kFineTime_s = 1.3e-4;  // averages of samples, where those of kThinnedTime_s hide something
constexpr std::size_t kMostEffects = 4, kMostWithARest = 2;  // at once; the latter where something remains
constexpr std::size_t kMostWarnings = 3;
constexpr double kFollows = 0.7,
                 kFollowsMore = 0.3;  // of the values' variance; more than what goes with heat explains

double family_wise(double z) {
  return std::min(1.0, static_cast<double>(kLibrary) * std::erfc(z / std::sqrt(2.0)));
}

double chi2_per_value(const Trial& trial) {
  return trial.left_out_chi2 / static_cast<double>(trial.model.fit.values);
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

bool accepted(const Diagnosis& d, std::size_t effect) {
  return std::any_of(d.search.findings.begin(), d.search.findings.end(),
                     [&](const Finding& f) { return f.candidate.effect == effect; });
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

// One row an effect: its best trial, or its best score where it was not worth one.
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
      if (f.candidate.effect == effect) add_estimate(out.search.final.model, f.candidate, c);
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

bool few_could_be_seen(const Diagnosis& d) {
  std::size_t blind = 0;
  for (const CandidateResult& c : d.candidates) blind += c.verdict == "cannot tell" ? 1u : 0u;
  return d.candidates.empty() || 2 * blind > d.candidates.size();
}

void explain_findings(const SearchStep& step, Diagnosis& d) {
  const EffectInfo& info = kEffectInfos[d.search.findings.front().candidate.effect];
  d.explanation.push_back(fmt::format("{}.", info.sentence));
  if (info.alike[0] != '\0')
    d.explanation.push_back(fmt::format("The same equation holds for {}: measurements at the terminals cannot tell.", info.alike));
  std::string values;
  for (const auto& [name, p] : d.candidates.front().estimate) {
    const std::string interval = std::isfinite(p.ci95_low)
                                     ? fmt::format("95 %: {:.4g} to {:.4g}", p.ci95_low, p.ci95_high)
                                     : "on a bound, or not determined";
    values += fmt::format("{}{} = {:.4g}{} ({})", values.empty() ? "" : "; ", name, p.value,
                          p.unit == "1" ? std::string() : fmt::format(" {}", p.unit), interval);
  }
  if (!values.empty()) d.explanation.push_back(fmt::format("{}: {}.", info.equation, values));
  std::vector<std::string> also;
  for (std::size_t k = 1; k < d.search.findings.size(); ++k)
    also.push_back(name_of(d.search.findings[k].candidate));
  if (!also.empty()) d.explanation.push_back(fmt::format("Beside it: {}.", listed(also)));
  d.explanation.push_back(fmt::format(
      "{} takes the misfit on records left out from {:.3g} to {:.3g} times what noise leaves.",
      also.empty() ? "Adding it" : "Adding them", chi2_per_value(step.base), chi2_per_value(d.search.final)));
  if (d.confusable.size() > 1)
    d.explanation.push_back(fmt::format("These data cannot tell {} apart.", listed(d.confusable)));
}

void suggest(const GlobalProblem& problem, const Model& model, const DiagnoseOptions& options, Diagnosis& d) {
  const RigRange range = options.range.value_or(range_of(problem, model));
  const SearchStep& first = d.search.steps.front();
  if (d.confusable.size() > 1) {
    d.next_experiment = separating_experiment(problem, doubt_of(problem, d.search), range);
    return;
  }
  std::vector<std::size_t> blind;
  for (const CandidateResult& c : d.candidates) {
    if (c.verdict == "cannot tell") blind.push_back(*effect_number(c.effect));
  }
  if (!blind.empty()) d.next_experiment = revealing_experiment(problem, first, blind, range);
}

// Share of what was above noise that the search has left; of the error itself too, where its slow part stays.
double share_left(const GlobalProblem& problem, const Diagnosis& d) {
  const SearchChange &first = d.search.changes.front(), &last = d.search.changes.back();
  const auto left = [](double before, double after) {
    return before > kBand ? std::max(0.0, after - 1.0) / (before - 1.0) : 0.0;
  };
  const double before = chi2_per_value(d.search.steps.front().base), after = chi2_per_value(d.search.final);
  double most = before > 1.0 ? std::max(0.0, after - 1.0) / (before - 1.0) : 0.0;
  for (const auto& [a, b] :
       {std::pair{&first.fitted, &last.fitted}, std::pair{&first.holdout, &last.holdout}}) {
    if (!inside_band(problem, *b)) most = std::max(most, left(a->error_over_noise(), b->error_over_noise()));
    const auto torque = [&](const Judgement& j) { return torque_chi2_per_value(problem, j.torque); };
    if (!torque_inside_band(problem, b->torque)) most = std::max(most, left(torque(*a), torque(*b)));
  }
  return most;
}

// A value for each record that follows what the motor does at that moment is no heat.
bool follows(const ValuePattern& p) { return p.share > kFollows && p.share > p.by_heat + kFollowsMore; }

void judge_whole(const GlobalProblem& problem, Diagnosis& d) {
  const SearchStep& first = d.search.steps.front();
  const double before = chi2_per_value(first.base), after = chi2_per_value(d.search.final);
  // Where one record alone shows something, the others cannot predict it; records held out then have the last
  // word.
  const bool inside = d.search.at_floor && (after < kBand || !problem.holdout().empty());
  if (d.search.findings.empty()) {
    // Records left out that are off though the fit is not: too few to hold the parameters.
    const bool fits = first.base.chi2 < kBand * static_cast<double>(first.base.model.fit.values);
    if (before < kBand)
      d.verdict = few_could_be_seen(d) ? "cannot_tell" : d.search.at_floor ? "adequate" : "unknown";
    else
      d.verdict = fits ? "cannot_tell" : "unknown";
  } else {
    const Finding& main = d.search.findings.front();
    d.confusable.push_back(name_of(main.candidate));
    for (const std::size_t k : main.rivals) d.confusable.push_back(kEffectInfos[k].name);
    d.effect = d.confusable.front();
    d.verdict = d.confusable.size() > 1 ? "ambiguous" : "missing";
    d.patterns = value_patterns(problem, d.search.final);
    const bool moving = !inside && !unstable(problem, d.search.final).empty();
    // Effects of the model as it came may have gone.
    const std::size_t had = first.base.model.active.size(), has = d.search.final.model.active.size();
    const bool too_many = has > had + kMostEffects || (has > had + kMostWithARest && !inside);
    const bool no_heat = std::any_of(d.patterns.begin(), d.patterns.end(), follows);
    const bool empty = !inside && may_be_neutral(d.search.final.model, main.candidate);
    if ((!inside && share_left(problem, d) > 1.0 - kExplained) || moving || too_many || no_heat || empty)
      d.verdict = "unknown";
    if (too_many) d.explanation.push_back("So many effects at once explain anything.");
    if (empty)
      d.explanation.push_back(fmt::format(
          "The amplitude of {} may as well be zero: its shape takes the place of something else.", d.effect));
  }
  if (d.verdict == "unknown") {
    d.effect.clear();
    d.confusable.clear();
  }
  if (d.verdict == "unknown" || (!d.effect.empty() && !inside_band(problem, d.search.changes.back().fitted)))
    d.unexplained = describe_unexplained(problem, d.search.final);
}

bool found(const Diagnosis& d, const char* effect) {
  return std::any_of(d.search.findings.begin(), d.search.findings.end(),
                     [&](const Finding& f) { return name_of(f.candidate) == effect; });
}

// What a torque transducer may do in the place of a loss: an offset is friction as long as the shaft turns
// one way, a gain is stray load loss.
void doubt_transducer(const DataSet& data, Diagnosis& d) {
  if (d.effect.empty()) return;
  bool forward = false, backward = false;
  const auto turns = [&](double w) { forward |= w > 1.0, backward |= w < -1.0; };
  for (const Record& r : data.records) {
    for (const SteadyPoint& p : r.points) turns(p.speed_rad_s);
    if (!r.series.torque_Nm.empty())
      std::for_each(r.series.speed_rad_s.begin(), r.series.speed_rad_s.end(), turns);
  }
  if (found(d, "friction_windage") && forward != backward)
    d.explanation.push_back(
        "The shaft turns one way only: an offset of the torque sensor would look the same; check its zero at "
        "standstill.");
  if (found(d, "stray_load_loss"))
    d.explanation.push_back(
        "A torque sensor that reads low under load would look much the same; check its gain.");
}

// What became of the shaft torque of time series.
void explain_torque(const GlobalProblem& problem, Diagnosis& d) {
  if (!problem.torque_refused().empty())
    d.explanation.push_back(
        fmt::format("The torque of the time series {}: it is not judged. Check its sign, unit and scale "
                    "(columns.torque_Nm), and R_s.",
                    problem.torque_refused()));
  std::size_t measured = 0, judged = 0;
  for (const GlobalProblem::Entry& e : problem.entries()) {
    if (!e.series || e.record->series.torque_Nm.empty()) continue;
    ++measured;
    judged += e.series->torque.empty() ? 0u : 1u;
  }
  if (problem.torque_refused().empty() && judged < measured)
    d.explanation.push_back(
        fmt::format("The torque of {} of {} records is not judged: the shaft stands, its speed never does, "
                    "or samples are missing.",
                    measured - judged, measured));
  const SearchChange &first = d.search.changes.front(), &last = d.search.changes.back();
  const double before = first.fitted.torque.rmse_Nm(), after = last.fitted.torque.rmse_Nm();
  if (std::isnan(before)) return;
  std::string sentence = fmt::format("The shaft torque of {} steady stretches is off by {:.3g} Nm rms",
                                     first.fitted.torque.values(), before);
  if (!d.search.findings.empty()) sentence += fmt::format(", {:.3g} Nm with what was added", after);
  d.explanation.push_back(sentence + ".");
  if (!torque_inside_band(problem, last.fitted.torque))
    d.explanation.push_back(
        "That is more than a torque bridge and a power meter leave: it is not explained.");
}

// What was found at import: data that are wrong look like physics.
void repeat_warnings(const DataSet& data, Diagnosis& d) {
  std::size_t told = 0, all = 0;
  for (const Record& r : data.records) {
    for (const std::string& warning : r.warnings) {
      if (warning.starts_with("columns not used")) continue;
      if (++all > kMostWarnings) continue;
      d.explanation.push_back(fmt::format("Look at the data first: {}: {}.", r.id, warning));
      ++told;
    }
  }
  if (all > told)
    d.explanation.push_back(fmt::format("And {} more warnings: imrig info tells them.", all - told));
}

void explain(const GlobalProblem& problem, const std::vector<std::string>& without, Diagnosis& d) {
  const SearchStep& first = d.search.steps.front();
  if (!problem.noise().declared)
    d.explanation.push_back(
        "No noise is declared: it was taken from the data, and figures relative to it are estimates.");
  if (problem.noise().declared_factor > kBelieved || problem.noise().declared_factor < 1.0 / kBelieved)
    d.explanation.push_back(
        fmt::format("The current's noise is {:.2g} times what was declared; the data are believed.",
                    problem.noise().declared_factor));
  if (!d.search.findings.empty()) explain_findings(first, d);
  if (d.verdict == "adequate") {
    const std::size_t held = problem.holdout().size();
    d.explanation.push_back(fmt::format(
        "Nothing is missing that {} records{} could show: the misfit is {:.3g} times what noise leaves.",
        problem.fitted().size(), held > 0 ? fmt::format(" (and {} held out)", held) : "",
        chi2_per_value(first.base)));
  }
  explain_torque(problem, d);
  doubt_transducer(problem.data(), d);
  if (!d.effect.empty() && d.unexplained)
    d.explanation.push_back("Something remains that no effect of the library explains: " +
                            d.unexplained->description);
  if (!d.effect.empty() && !d.unexplained && !d.search.at_floor)
    d.explanation.push_back(
        "Records held out lie above what noise leaves: they may reach beyond what was fitted (larger current, flux "
        "or slip), where the form of an effect is not known.");
  if (d.verdict == "unknown")
    d.explanation.push_back((d.search.findings.empty()
                                 ? "No effect of the library explains the misfit: "
                                 : "That is no explanation: much remains, or it does not hold still: ") +
                            d.unexplained->description);
  if (!d.effect.empty() && d.search.at_floor && chi2_per_value(d.search.final) > kBand)
    d.explanation.push_back("One record alone shows part of this: the others would not predict it.");
  for (const ValuePattern& p : d.patterns) {
    if (follows(p))
      d.explanation.push_back(fmt::format(
          "A value of {} for each record would explain it, but these values follow {} ({:.0f} % of their "
          "variance): heat does not. Look for a law of {}.",
          p.effect, p.condition, 100.0 * p.share, p.condition));
  }
  if (d.verdict == "cannot_tell")
    d.explanation.push_back("The data excite the motor too little to show most effects.");
  d.explanation.push_back(fmt::format("Ranked among {} effects{}.", d.ranked_among,
                                      without.empty() ? "" : "; ruled out: " + listed(without)));
}

// A hard sign of the current switches within averaged samples.
bool wants_finer_samples(const DataSet& data, const Search& found) {
  if (found.at_floor && inside_band(found.final)) return false;
  const auto& active = found.final.model.active;
  const bool switches = std::any_of(active.begin(), active.end(),
                                    [](const Candidate& c) { return name_of(c) == "inverter_dead_time"; });
  return switches && std::any_of(data.records.begin(), data.records.end(), [](const Record& r) {
           return r.series.size() > 0 && 2.0 * r.series.sample_time_s <= kThinnedTime_s;
         });
}

std::vector<std::size_t> ruled_out(const std::vector<std::string>& names) {
  std::set<std::size_t> out;
  for (const std::string& name : names) {
    const auto effect = effect_number(name);
    if (!effect) throw Error("diagnose", fmt::format("no effect is called \"{}\"", name), "imrig model effects lists them");
    out.insert(*effect);
  }
  return {out.begin(), out.end()};
}

}  // namespace

Diagnosis diagnose(const Model& given, const DataSet& data, const DiagnoseOptions& options) {
  if (given.pole_pairs != data.pole_pairs) {
    throw Error("diagnose",
                fmt::format("the model \"{}\" has {} pole pairs, the data \"{}\" {}", given.name,
                            given.pole_pairs, data.name, data.pole_pairs),
                "they must be of one motor");
  }
  const DataStart known = start_from_data(given, data, options.threads);
  const Model& model = known.model;
  std::vector<std::string> cut;
  const DataSet parts = in_parts(data, cut);
  Diagnosis out;
  const auto searched = [&](double longest_sample_s) {
    auto problem = std::make_unique<const GlobalProblem>(parts, model.machine(), options.threads,
                                                         longest_sample_s, true);
    if (problem->fitted().empty())
      throw Error("diagnose", "finds hold-out records only", "some must be fitted");
    WorkingModel start = working_model(*problem, model);
    start.barred = ruled_out(options.without);
    keep_in_reach(model, start);
    out.ranked_among = kLibrary - start.barred.size();
    out.search = search(*problem, start, {options.most_additions, options.report});
    return problem;
  };
  auto current = searched(kThinnedTime_s);
  if (wants_finer_samples(parts, out.search)) current = searched(kFineTime_s);
  const GlobalProblem& problem = *current;
  add_candidates(problem, out.search.steps.front(), out);
  judge_whole(problem, out);
  repeat_warnings(data, out);
  const std::vector<std::string> far = at_the_end_of_reach(out.search.final.model);
  if (!far.empty())
    out.explanation.push_back(fmt::format(
        "{} went as far from the model as a search lets it: these data leave it open, or the model "
        "came with a wrong one; imrig identify {} first.",
        listed(far), far.size() == 1 ? "it" : "them"));
  if (!cut.empty())
    out.explanation.push_back(fmt::format("Few records: {} {} cut into parts, which are judged like records.",
                                          listed(cut), cut.size() == 1 ? "was" : "were"));
  explain(problem, options.without, out);
  if (!known.sentence.empty())
    out.explanation.insert(out.explanation.begin(), "The model does not know all of its parameters: " + known.sentence + ".");
  suggest(problem, model, options, out);
  return out;
}

Improvement improve(const Model& model, const DataSet& data, const DiagnoseOptions& options) {
  Improvement out;
  out.diagnosis = diagnose(model, data, options);
  out.model = to_model(model, out.diagnosis.search.final.model);
  for (const SearchChange& change : out.diagnosis.search.changes) {
    Revision r;
    r.number = out.model.history.empty() ? 1 : out.model.history.back().number + 1;
    r.change = change.text;
    r.data = data.name;
    r.data_hash = data.hash;
    r.fitted_nrmse = change.fitted.nrmse();
    r.holdout_nrmse = change.holdout.nrmse();
    r.floor_nrmse = change.fitted.floor();
    out.model.history.push_back(r);
  }
  return out;
}

}  // namespace imrig::est
