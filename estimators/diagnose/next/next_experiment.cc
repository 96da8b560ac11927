#include "estimators/diagnose/next/next_experiment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "estimators/diagnose/next/plan_text.h"
#include "estimators/diagnose/next/separation.h"
#include "estimators/diagnose/next/visibility.h"
#include "estimators/model/effects/registry.h"
#include "rig/base/listed.h"

namespace imrig::est {

namespace {

constexpr std::size_t kMostMembers = 4;
constexpr double kAmple = 3.0;   // strength from which on the quicker experiment is the better one
constexpr double kAsGood = 0.9;  // the quicker of two experiments that differ by less
constexpr int kMostRepeats = 4;
constexpr std::size_t kMostRefits = 2;
constexpr double kMuchBetter = 2.0;
constexpr double kSeen = 0.5 * kSure;  // d of an effect of the size that matters

// How surely a pair would be told apart, 1: just so; by the noise, and by the forms, which are never exact.
double strength(const Apart& pair) {
  const double form = pair.whole > 0.0 ? std::sqrt(pair.left / (kSameShare * pair.whole)) : 0.0;
  return std::min(pair.d() / kConfusable, form);
}

using Pairs = std::vector<Apart>;
using Wanted = std::vector<bool>;  // of the ordered pairs: those that some record separates

template <class Value>
double least(const Pairs& pairs, const Wanted& wanted, Value&& value) {
  double out = 1e300;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    if (wanted[k]) out = std::min(out, value(pairs[k]));
  }
  return out;
}
double weakest(const Pairs& pairs, const Wanted& wanted) { return least(pairs, wanted, strength); }
double smallest_d(const Pairs& pairs, const Wanted& wanted) {
  return least(pairs, wanted, [](const Apart& p) { return p.d(); });
}

// Some experiment tells a's records from what b makes of them. One way may be closed where b holds a as a
// special case, or a is inside what the sensors' accuracy allows; a pair closed both ways is a gauge.
Wanted separable(const Separation& all) {
  Wanted out(all.now().size(), false);
  for (std::size_t e = 0; e < all.experiments(); ++e) {
    for (std::size_t k = 0; k < out.size(); ++k) out[k] = out[k] || all.with(e)[k].cosine() < kGauge;
  }
  return out;
}

// The first of those that come close to the best in what they add to `now`. Both go with the root of the
// data.
std::size_t best_of(const std::vector<double>& values, double now) {
  const auto added = [now](double x) { return std::copysign(x * x, x) - now * now; };
  const double most = added(*std::max_element(values.begin(), values.end()));
  const double enough = most > 0.0 ? kAsGood * kAsGood * most : most;
  return static_cast<std::size_t>(
      std::find_if(values.begin(), values.end(), [&](double x) { return added(x) >= enough; }) -
      values.begin());
}

struct Choice {
  std::size_t experiment = 0;
  Pairs pairs;
};

// By linearised fits; the winner is fitted to the end, and stays only if it still wins.
Choice choose(const Separation& all, const Wanted& wanted) {
  std::vector<double> values;
  const double now = weakest(all.now(), wanted);
  // Records that disagree with each other leave a doubt that more of the same would not: then the most
  // counts.
  const double ample = now < kAmple ? kAmple : std::numeric_limits<double>::infinity();
  const auto value = [&](const Pairs& pairs) { return std::min(ample, weakest(pairs, wanted)); };
  for (std::size_t e = 0; e < all.experiments(); ++e) values.push_back(value(all.with(e)));
  std::map<std::size_t, Pairs> refitted;
  while (true) {
    const std::size_t e = best_of(values, now);
    if (refitted.contains(e)) return {e, refitted.at(e)};
    if (refitted.size() == kMostRefits) {
      for (std::size_t k = 0; k < values.size(); ++k) values[k] = refitted.contains(k) ? values[k] : -1.0;
      continue;
    }
    refitted[e] = all.refitted(e);
    values[e] = value(refitted[e]);
  }
}

// What tells two effects apart that no record does.
std::string reference_for(const std::string& a, const std::string& b) {
  const auto either = [&](const char* name) { return a == name || b == name; };
  if (either("speed_bias")) return "a second speed reference (stroboscope, or another encoder)";
  if (either("current_gain") || either("supply_unbalance") || either("stator_unbalance"))
    return "a swap of the phases at the motor and at the sensors: does it follow supply, terminals or sensor";
  if (either("voltage_lag")) return "a reference channel for the delay between voltage and current";
  if (either("inverter_dead_time")) return "a voltage measured at the terminals";
  if (either("rotor_heating") || either("stator_heating"))
    return "a measured temperature, or a pause to cool down";
  return "an independent measurement: " + std::string(kEffectInfos[*effect_number(a)].experiment);
}

NextExperiment planned(const Experiment& experiment, const RigRange& range, const WorkingModel& base,
                       int repeats, const std::string& why) {
  const SharedVector<double>& x = base.at.shared;
  NextExperiment out;
  out.kind = record_kind_word(experiment.records.front().kind);
  out.what = experiment.name;
  out.why = why;
  out.records = experiment.records;
  out.repeats = repeats;
  out.toml = plan_text(experiment, range, {x[0], x[1], x[2], x[3]}, repeats,
                       fmt::format("{}: {}", experiment.name, why));
  return out;
}

std::vector<Experiment> menu_of(const GlobalProblem& problem, const WorkingModel& base,
                                const RigRange& range) {
  const SharedVector<double>& x = base.at.shared;
  return menu(range, {x[0], x[1], x[2], x[3]}, problem.data().pole_pairs);
}

}  // namespace

Doubt doubt_of(const SearchStep& step) {
  Doubt out{step.base.model, {}, {}};
  for (const std::size_t k : step.confusable) {
    if (out.members.size() == kMostMembers) break;
    out.members.push_back(step.trials[k].model);
    out.names.push_back(name_of(step.trials[k].candidate));
  }
  return out;
}

Doubt doubt_of(const GlobalProblem& problem, const Search& search) {
  if (search.findings.empty()) return {};
  const std::size_t effect = search.findings.front().candidate.effect;
  if (search.findings.size() == 1) {
    for (const SearchStep& step : search.steps) {
      if (!step.confusable.empty() && step.trials[step.confusable.front()].candidate.effect == effect)
        return doubt_of(step);
    }
    return {};
  }
  Doubt out{try_removing(problem, search.final.model, effect, problem.fitted()).model,
            {search.final.model},
            {kEffectInfos[effect].name}};
  for (const std::size_t rival : search.findings.front().rivals) {
    const Trial* best = nullptr;
    for (const SearchStep& step : search.steps) {
      for (const Trial& t : step.trials) {
        if (t.candidate.effect == rival && t.sound && best == nullptr) best = &t;
      }
    }
    if (best == nullptr || out.members.size() == kMostMembers) continue;
    Trial swapped = try_swapping(problem, search.final.model, effect, *best, problem.fitted());
    if (!swapped.sound) continue;
    out.members.push_back(std::move(swapped.model));
    out.names.emplace_back(kEffectInfos[rival].name);
  }
  return out;
}

std::optional<NextExperiment> separating_experiment(const GlobalProblem& problem, const Doubt& doubt,
                                                    const RigRange& range) {
  if (doubt.members.size() < 2) return std::nullopt;
  const std::vector<std::string>& names = doubt.names;
  std::vector<const WorkingModel*> members;
  for (const WorkingModel& m : doubt.members) members.push_back(&m);
  const std::vector<Experiment> experiments = menu_of(problem, doubt.base, range);
  if (experiments.empty()) return std::nullopt;
  const Separation all(problem, doubt.base, members, experiments);
  const Wanted wanted = separable(all);
  std::string gauges;
  std::vector<std::pair<std::string, std::string>> told;
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    const Apart& p = all.now()[k];
    const bool back =
        least(all.now(), wanted, [&](const Apart& q) { return q.a == p.b && q.b == p.a ? 0.0 : 1.0; }) < 0.5;
    if (wanted[k] || back || p.a > p.b) continue;
    told.emplace_back(names[p.a], names[p.b]);
    gauges += fmt::format(
        "{}{} and {} look alike in every record this rig can take (cosine above {}): only {} tells them "
        "apart",
        gauges.empty() ? "" : "; ", names[p.a], names[p.b], kGauge, reference_for(names[p.a], names[p.b]));
  }
  const Wanted everything(wanted.size(), true);
  if (std::none_of(wanted.begin(), wanted.end(), [](bool w) { return w; })) {
    NextExperiment out;
    out.kind = "reference";
    out.what = reference_for(names[0], names[1]);
    out.why = gauges;
    out.gauges = told;
    out.distinguishability_before = smallest_d(all.now(), everything);
    return out;
  }
  const Choice choice = choose(all, wanted);
  const double before = smallest_d(all.now(), wanted), once = smallest_d(choice.pairs, wanted);
  const double gain2 = once * once - before * before;
  const int repeats =
      gain2 <= 0.0 ? 1
                   : static_cast<int>(std::clamp(std::ceil((kSettled * kSettled - before * before) / gain2),
                                                 1.0, static_cast<double>(kMostRepeats)));
  const double after = std::sqrt(before * before + repeats * std::max(0.0, gain2));
  std::string why = fmt::format("separates {}, d {:.2g} to {:.2g} (told apart from {} on)", listed(names),
                                before, after, kConfusable);
  if (after < kConfusable) why += "; it takes more than one such campaign";
  if (!gauges.empty()) why += "; " + gauges;
  NextExperiment out = planned(experiments[choice.experiment], range, doubt.base, repeats, why);
  out.gauges = told;
  out.distinguishability_before = before;
  out.distinguishability_after = after;
  return out;
}

std::optional<NextExperiment> revealing_experiment(const GlobalProblem& problem, const SearchStep& step,
                                                   const std::vector<std::size_t>& effects,
                                                   const RigRange& range) {
  const std::vector<Experiment> experiments = menu_of(problem, step.base.model, range);
  if (experiments.empty()) return std::nullopt;
  const Visibility seen = visibility(problem, step.base.model, effects, experiments);
  if (seen.effects.empty()) return std::nullopt;
  const auto worth = [](const std::vector<double>& d) {
    return std::accumulate(d.begin(), d.end(), 0.0,
                           [](double sum, double x) { return sum + std::min(x, kSeen); });
  };
  std::vector<double> values;
  for (const auto& d : seen.with) values.push_back(worth(d));
  const std::size_t best = best_of(values, worth(seen.now));
  std::vector<std::string> shown;
  double before = 1e300, after = 1e300;
  for (std::size_t k = 0; k < seen.effects.size(); ++k) {
    const double now = seen.now[k], then = seen.with[best][k];
    if (now >= kSeen || then < kMuchBetter * now) continue;
    shown.emplace_back(kEffectInfos[seen.effects[k]].name);
    before = std::min(before, now);
    after = std::min(after, then);
  }
  if (shown.empty()) return std::nullopt;
  NextExperiment out =
      planned(experiments[best], range, step.base.model, 1,
              fmt::format("shows {} where these data cannot, d {:.2g} to {:.2g} of what matters",
                          listed(shown), before, after));
  out.distinguishability_before = before;
  out.distinguishability_after = after;
  return out;
}

}  // namespace imrig::est
