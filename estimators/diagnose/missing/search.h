#pragma once
// The whole search: add the best claim, try its richer forms, try removing what has become idle, look again;
// until nothing can be claimed. DIAGNOSIS: choose on records left out, never by the fit alone.

#include <vector>

#include "estimators/diagnose/missing/search_step.h"

namespace imrig::est {

struct SearchOptions {
  std::size_t most_effects = 6;
  SearchReport report;
};

// One change of the model, and where it left the errors.
struct SearchChange {
  std::string text;  // "added core_loss, eddy currents", "removed broken_bar"
  std::string effect;
  Judgement fitted, holdout;
};

struct Search {
  std::vector<SearchStep> steps;      // the last one claims nothing, unless the search was cut short
  std::vector<SearchChange> changes;  // the first is the model as it came
  Trial final;
  bool cut_short = false;
  bool at_floor = false;  // chi2 of what was fitted, and of the hold-out, inside the band
};

// chi2 a value that noise may leave: noise is never known better than this.
inline constexpr double kBand = 1.3;

Search search(const GlobalProblem& problem, const WorkingModel& start, const SearchOptions& options);

}  // namespace imrig::est
