#pragma once
// Which experiment of the rig's own menu would settle a doubt? For every record of the menu the confusable
// models predict what they would measure; each is then fitted to what each other one would have measured, on
// the data at hand and the new records together. What the fit leaves is the noncentrality
//   Delta = min over B of |y_A - f_B|^2,  d = sqrt(Delta)/2
// and A is told from B with probability Phi(d); d = sqrt(lambda) sin(theta/2) where the models are close to
// linear, cos(theta) = sqrt(1 - Delta/lambda) with lambda the misfit of the model without either. Chosen is
// the experiment with the largest smallest d over all ordered pairs, each pair counting no more than what
// the difference of forms allows (kSameShare): models are never exact.
// All with one linearised fit each; the one chosen with a whole refit.

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "estimators/diagnose/missing/search.h"
#include "estimators/diagnose/next/experiment.h"

namespace imrig::est {

inline constexpr double kConfusable = 1.64;  // d below which two effects are one set
inline constexpr double kSettled = 3.0;      // d that an experiment is repeated for
inline constexpr double kGauge = 0.995;      // cosine from which on no record separates

struct NextExperiment {
  std::string kind;  // of a record: "locked_sweep"; "reference" where no record helps
  std::string plan;  // path, when one was written
  std::string why;
  double distinguishability_before = kMissing, distinguishability_after = kMissing;
  std::string what;                                         // the experiment in plain words
  std::string toml;                                         // the campaign plan; empty where no record helps
  std::vector<PlannedRecord> records;                       // once each
  std::vector<std::pair<std::string, std::string>> gauges;  // effects that no record tells apart
  int repeats = 1;
};

// Models that the data cannot choose between, and the one without the effect that is in doubt.
struct Doubt {
  WorkingModel base;
  std::vector<WorkingModel> members;
  std::vector<std::string> names;  // the effect of each
};
Doubt doubt_of(const SearchStep& step);
// Of the first finding: its rivals in its place, beside all other findings.
Doubt doubt_of(const GlobalProblem& problem, const Search& search);

// Empty where there is no doubt, or no experiment fits into the range.
std::optional<NextExperiment> separating_experiment(const GlobalProblem& problem, const Doubt& doubt,
                                                    const RigRange& range);

// Shows the effects (numbers) that the data cannot.
std::optional<NextExperiment> revealing_experiment(const GlobalProblem& problem, const SearchStep& step,
                                                   const std::vector<std::size_t>& effects,
                                                   const RigRange& range);

}  // namespace imrig::est
