#include "estimators/diagnose/diagnose.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <set>

#include "estimators/diagnose/candidate_rows.h"
#include "estimators/diagnose/explanation.h"
#include "estimators/diagnose/late_channels.h"
#include "estimators/diagnose/missing/neutral_amplitude.h"
#include "estimators/diagnose/missing/parts.h"
#include "estimators/diagnose/missing/unexplained.h"
#include "estimators/fit/global/driven_record.h"
#include "estimators/fit/global/start_from_data.h"
#include "estimators/model/effects/registry.h"
#include "rig/base/error.h"
#include "rig/base/listed.h"

namespace imrig::est {

namespace {

constexpr double kExplained = 0.85;     // share of the excess that an explanation must take away
constexpr double kLittleMisfit = 1.6, kLittleError = 2.0;  // times what noise leaves; of the error itself
constexpr double kNearlyNothing = 0.02;                    // likewise, that no doubt is raised by
constexpr double kMostOfOff = 0.5;      // of the chi2 by which the torque is off
constexpr double kFineTime_s = 1.3e-4;  // averages of samples, where those of kThinnedTime_s hide something
constexpr std::size_t kMostEffects = 4, kMostWithARest = 2;  // at once; the latter where something remains

bool few_could_be_seen(const Diagnosis& d) {
  std::size_t blind = 0;
  for (const CandidateResult& c : d.candidates) blind += c.verdict == "cannot tell" ? 1u : 0u;
  return d.candidates.empty() || 2 * blind > d.candidates.size();
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
    const bool doubted =
        std::find(d.losses_in_doubt.begin(), d.losses_in_doubt.end(), c.effect) != d.losses_in_doubt.end();
    if (c.verdict == "cannot tell" || doubted) blind.push_back(*effect_number(c.effect));
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

// The torque alone is off, by what some loss would explain though not surely, or by so little that a loss
// worth all of it was worth no trial: that is no physics outside the library. Names of those losses.
std::vector<std::string> losses_in_doubt(const GlobalProblem& problem, const Search& search) {
  const auto current_inside = [&](Judgement j) {
    j.torque = {};
    return inside_band(problem, j);
  };
  const SearchChange& last = search.changes.back();
  if (!current_inside(last.fitted) || !current_inside(last.holdout)) return {};
  const SearchStep& step = search.steps.back();
  std::set<std::string> out;
  for (const Trial& t : step.trials) {
    if (needs_torque(t.candidate) && t.sound && torque_inside_band(problem, t.torque))
      out.insert(name_of(t.candidate));
  }
  const TorqueSums& torque = step.base.torque;
  const double off = (torque_chi2_per_value(problem, torque) - 1.0) * torque.values();
  for (const Score& s : step.ranking.scores) {
    const bool tried = std::any_of(step.trials.begin(), step.trials.end(),
                                   [&](const Trial& t) { return t.candidate.effect == s.candidate.effect; });
    if (needs_torque(s.candidate) && !tried && s.lambda > 0.0 && s.lambda > kMostOfOff * off)
      out.insert(name_of(s.candidate));
  }
  return {out.begin(), out.end()};
}

// Of the current alone.
bool only_a_little_off(const GlobalProblem& problem, const SearchChange& change) {
  const auto little = [&](const Judgement& j) {
    return torque_inside_band(problem, j.torque) && j.error_over_noise() < kLittleError * kLittleError &&
           (j.values <= 0.0 || j.chi2_per_value() < kLittleMisfit);
  };
  return little(change.fitted) && little(change.holdout);
}

void judge_whole(const GlobalProblem& problem, Diagnosis& d) {
  const SearchStep& first = d.search.steps.front();
  const double before = chi2_per_value(first.base), after = chi2_per_value(d.search.final);
  // Where one record alone shows something, the others cannot predict it; records held out then have the last
  // word.
  const bool inside = d.search.at_floor && (after < kBand || !problem.holdout().empty());
  if (d.search.findings.empty()) {
    // Records left out that are off though the fit is not: too few to hold the parameters.
    const bool fits = first.base.chi2 < kBand * static_cast<double>(first.base.model.fit.values);
    const bool rounding = problem.speed_sigma() > 0.0 && only_a_little_off(problem, d.search.changes.back());
    if (before >= kBand) {
      d.rounding_in_doubt = rounding && !fits;
      d.verdict = fits || rounding ? "cannot_tell" : "unknown";
    } else if (few_could_be_seen(d)) {
      d.verdict = "cannot_tell";
    } else if (d.search.at_floor) {
      d.verdict = "adequate";
    } else {
      d.losses_in_doubt = losses_in_doubt(problem, d.search);
      d.rounding_in_doubt = rounding;
      d.verdict = d.losses_in_doubt.empty() && !rounding ? "unknown" : "cannot_tell";
    }
  } else {
    const Finding& main = d.search.findings.front();
    d.confusable.push_back(name_of(main.candidate));
    for (const std::size_t k : main.rivals) d.confusable.push_back(kEffectInfos[k].name);
    d.effect = d.confusable.front();
    d.verdict = d.confusable.size() > 1 ? "ambiguous" : "missing";
    d.patterns = value_patterns(problem, d.search.final);
    // What takes nearly all of it is no less true for a small rest that pulls at it.
    const bool moving =
        share_left(problem, d) > kNearlyNothing && !inside && !unstable(problem, d.search.final).empty();
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
  out.model = model;
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
  // Two channels are ahead because the third is late: that is the lag between voltage and current.
  if (currents_are_late(out))
    std::stable_partition(out.search.findings.begin(), out.search.findings.end(),
                          [](const Finding& f) { return name_of(f.candidate) == "voltage_lag"; });
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
  out.model = out.diagnosis.model;
  if (out.diagnosis.verdict == "unknown") return out;  // nothing is proven
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
