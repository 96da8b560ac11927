#pragma once
// The whole search: add the best claim, try richer forms of all that is active, try removing what has become
// idle, look again; until nothing can be claimed. Temperatures that a sensor may stand for are first tried as
// a law of that sensor; a value for each record explains too much too easily. In the end each accepted effect
// is tried against its rivals beside all the others. Choices are made on records left out, never by the fit
// alone.

#include <vector>

#include "estimators/diagnose/missing/search_step.h"

namespace imrig::est {

struct SearchOptions {
  std::size_t most_additions = 6;  // some of them go again
  SearchReport report;
};

// One change of the model, and where it left the errors.
struct SearchChange {
  std::string text;  // "added core_loss, eddy currents", "removed broken_bar"
  std::string effect;
  Judgement fitted, holdout;
};

// An effect that was accepted, and those that may stand in its place beside the other accepted ones.
struct Finding {
  Candidate candidate;
  std::vector<std::size_t> rivals;
};

struct Search {
  std::vector<SearchStep> steps;      // the last one claims nothing, unless the search was cut short
  std::vector<Finding> findings;      // in the order of their acceptance
  std::vector<SearchChange> changes;  // the first is the model as it came
  Trial final;
  bool cut_short = false;
  bool at_floor = false;  // chi2 and error of what was fitted, and of the hold-out, inside the band
};

// Whether noise alone may leave this, white and raw. The raw error's slow modes scatter by chance, and how
// strong slow noise is nobody knows where noise is coloured: then the white one decides.
bool inside_band(const GlobalProblem& problem, const Judgement& judgement);

// Writes down where search.final stands now.
void note_change(const GlobalProblem& problem, Search& search, std::string text, std::string effect);

Search search(const GlobalProblem& problem, const WorkingModel& start, const SearchOptions& options);

}  // namespace imrig::est
