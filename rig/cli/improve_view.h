#pragma once
// What imrig improve shows beside its result, in the terminal and in the report: the candidates before any
// refit, the model as it was beside the one proposed, and words where the waterfall shows no step.

#include <string>
#include <vector>

#include "estimators/diagnose/diagnose.h"

namespace imrig {

// A candidate of one step of the search: what the linear forecast promised, and what the refit gave.
struct OverviewRow {
  std::string effect, form;
  double expected_gain = 0.0;        // drop of chi2, forecast
  double expected_share = kMissing;  // of the misfit that noise does not explain
  std::string parameters;            // forecast
  double gain = kMissing;            // drop of chi2 after the refit; NaN: not worth one
  std::string warning;               // forecast and refit disagree, or the refit is of no use
};
std::vector<OverviewRow> overview(const est::SearchStep& step);  // one row an effect, largest gain first

struct ModelRow {
  std::string name, unit, mark;  // "", "moved" (out of its interval), "new", "gone"
  double current = kMissing, proposed = kMissing, change_percent = kMissing;
};
std::vector<ModelRow> side_by_side(const est::Model& current, const est::Model& proposed);

// One bar of the waterfall: error over its signal, and over what noise leaves (sqrt of chi2 a value).
struct Fall {
  std::string text;
  double fitted = kMissing, holdout = kMissing, floor = kMissing, holdout_floor = kMissing;
  double fitted_over_noise = kMissing, holdout_over_noise = kMissing;
};
std::vector<Fall> waterfall(const est::Search& search);

// Sentences on steps that show no drop, and why they are steps all the same.
std::vector<std::string> waterfall_notes(const est::Search& search);

// Where the search ended.
std::string ending(const est::Diagnosis& diagnosis);

}  // namespace imrig
