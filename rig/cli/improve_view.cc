#include "rig/cli/improve_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "estimators/model/effects/registry.h"
#include "rig/cli/text_table.h"

namespace imrig {

namespace {

constexpr double kDisagree = 2.0;       // ratio of refit and forecast from which the forecast was no guide
constexpr double kWorthTelling = 20.0;  // chi2
constexpr double kNoStep = 0.97;        // of the error before
constexpr double kBeyond = 2.0;         // times its accuracy: a correction that should be looked at

std::string forecast(const est::Score& score) {
  std::string out;
  for (std::size_t k = 0; k < score.change.size(); ++k) {
    const est::EffectParameter& p = est::shared_parameter(score.amplitudes[k]);
    const std::string unit = std::string(p.unit) == "1" ? "" : fmt::format(" {}", p.unit);
    out += fmt::format("{}{} {}{}", out.empty() ? "" : ", ", p.name, shown(p.neutral + score.change[k], 3),
                       unit);
  }
  return out.empty() ? "a value for each record" : out;
}

const est::Trial* trial_of(const est::SearchStep& step, std::size_t effect) {
  const auto found = std::find_if(step.trials.begin(), step.trials.end(),
                                  [&](const est::Trial& t) { return t.candidate.effect == effect; });
  return found == step.trials.end() ? nullptr : &*found;
}

std::string warning_of(const est::Score& score, const est::Trial& trial, double gain) {
  if (!trial.sound) return "refit of no use: " + trial.unsound;
  const double larger = std::max(gain, score.lambda), smaller = std::min(gain, score.lambda);
  if (larger < kWorthTelling || smaller * kDisagree > larger) return "";
  if (!(trial.candidate == score.candidate) && gain > score.lambda)
    return fmt::format("more than forecast, in the richer form \"{}\"", est::form_of(trial.candidate).name);
  return gain < score.lambda ? "the refit gains far less than forecast"
                             : "the refit gains far more than forecast";
}

using Values = std::map<std::string, est::Parameter>;

// Everything that a fit may move, by name, in the order of the file.
std::vector<std::pair<std::string, est::Parameter>> parameters_of(const est::Model& model) {
  std::vector<std::pair<std::string, est::Parameter>> out;
  for (const auto& base : est::base_parameters()) out.push_back({base.name, model.*base.place});
  for (const auto& effect : model.effects) {
    for (const auto& [name, p] : effect.parameters) out.push_back({effect.name + "." + name, p});
  }
  for (const auto& correction : model.corrections) {
    for (const auto& [name, p] : correction.parameters)
      out.push_back({correction.name + "." + name + " (correction)", p});
  }
  return out;
}

bool outside(const est::Parameter& interval, double value) {
  return std::isfinite(interval.ci95_low) && (value < interval.ci95_low || value > interval.ci95_high);
}

}  // namespace

std::vector<OverviewRow> overview(const est::SearchStep& step) {
  std::vector<OverviewRow> out;
  std::set<std::size_t> done;
  const double excess = step.base.chi2 - static_cast<double>(step.base.model.fit.values);
  for (const est::Score& score : step.ranking.scores) {
    if (!done.insert(score.candidate.effect).second) continue;
    OverviewRow row;
    row.effect = est::name_of(score.candidate);
    row.form = est::form_of(score.candidate).name;
    row.expected_gain = score.lambda;
    if (excess > 0.0) row.expected_share = std::min(1.0, score.lambda / excess);
    row.parameters = forecast(score);
    if (const est::Trial* trial = trial_of(step, score.candidate.effect)) {
      row.gain = step.base.chi2 - trial->chi2;
      row.warning = warning_of(score, *trial, row.gain);
    }
    out.push_back(std::move(row));
  }
  return out;
}

std::vector<ModelRow> side_by_side(const est::Model& current, const est::Model& proposed) {
  std::vector<ModelRow> out;
  const auto before = parameters_of(current);
  Values left(before.begin(), before.end());
  for (const auto& [name, p] : parameters_of(proposed)) {
    ModelRow row{name, p.unit, "new", kMissing, p.value, kMissing};
    if (const auto found = left.find(name); found != left.end()) {
      row.current = found->second.value;
      if (row.current != 0.0) row.change_percent = 100.0 * (p.value / row.current - 1.0);
      row.mark = outside(found->second, p.value) ? "moved" : "";
      left.erase(found);
    }
    out.push_back(row);
  }
  for (const auto& [name, p] : left) out.push_back({name, p.unit, "gone", p.value, kMissing, kMissing});
  return out;
}

std::vector<Fall> waterfall(const est::Search& search) {
  std::vector<Fall> out;
  for (const est::SearchChange& change : search.changes) {
    Fall fall;
    fall.text = change.text;
    fall.fitted = change.fitted.nrmse();
    fall.holdout = change.holdout.nrmse();
    fall.floor = change.fitted.floor();
    fall.holdout_floor = change.holdout.floor();
    fall.fitted_over_noise = std::sqrt(change.fitted.chi2_per_value());
    fall.holdout_over_noise = std::sqrt(change.holdout.chi2_per_value());
    out.push_back(fall);
  }
  return out;
}

// Sensor errors that are followed as corrections although they lie well outside their accuracy.
void add_large_corrections(const est::WorkingModel& model, std::vector<std::string>& out) {
  for (const est::Prior& prior : model.priors) {
    const auto& followed = model.nuisances;
    if (std::find(followed.begin(), followed.end(), prior.entry) == followed.end()) continue;
    const std::size_t effect = est::effect_of_shared(prior.entry);
    const double off = std::abs(model.at.shared[prior.entry] - prior.value) / prior.sigma;
    if (model.has(effect) || !(off > kBeyond)) continue;
    const est::EffectParameter& p = est::shared_parameter(prior.entry);
    out.push_back(fmt::format(
        "{}.{} is followed as a correction of {}, {} times its accuracy: the error of every "
        "model here is without it. Calibrate that sensor.",
        est::kEffectInfos[effect].name, p.name, shown(model.at.shared[prior.entry], 3), shown(off, 2)));
  }
}

std::vector<std::string> waterfall_notes(const est::Search& search) {
  std::vector<std::string> out;
  for (const est::SearchStep& step : search.steps) {
    if (step.claims.empty()) continue;
    const est::Trial& best = step.trials[step.claims.front()];
    const std::string name = est::name_of(best.candidate);
    const auto& followed = step.base.model.nuisances;
    const bool correction = std::any_of(followed.begin(), followed.end(), [&](std::size_t e) {
      return est::effect_of_shared(e) == best.candidate.effect;
    });
    if (correction) {
      out.push_back(
          fmt::format("{} shows hardly a step: a sensor error inside its accuracy is followed as a "
                      "correction, and this one "
                      "had been followed all the way. What is proven is that it is larger than the data set "
                      "says its sensors "
                      "are accurate. Calibrate, or mend the accuracy in dataset.toml.",
                      name));
    } else if (best.chi2 > kNoStep * kNoStep * step.base.chi2) {
      out.push_back(fmt::format(
          "{} takes away little of the error, but surely: its records prove it one by one.", name));
    }
  }
  add_large_corrections(search.final.model, out);
  return out;
}

std::string ending(const est::Diagnosis& diagnosis) {
  const est::Search& search = diagnosis.search;
  if (diagnosis.verdict == "unknown")
    return "the library holds no explanation that stands: nothing is proven, and the model stays as it came";
  if (diagnosis.verdict == "cannot_tell")
    return "nothing was added: these data cannot tell, so a small error is no proof (imrig compare says what "
           "they cannot reveal)";
  if (search.changes.size() == 1 && search.at_floor)
    return "nothing was added: the error is at the noise floor already";
  if (search.at_floor) return "the error has reached the noise floor";
  if (search.cut_short)
    return "more effects were found than are added at once: run it again on the new model";
  return "the library holds nothing that brings it closer to the floor: unknown remains";
}

}  // namespace imrig
