#pragma once
// Which physical effect does a model lack? The search (missing/search.h), and what may honestly be said of
// it:
//   adequate     nothing can be claimed, and the error is inside the band that noise leaves
//   missing      one effect explains the misfit
//   ambiguous    several do, and these data cannot tell them apart
//   unknown      the misfit stays, or what was accepted does not hold still: not in the library
//   cannot_tell  the data could not show the effects that matter; or a loss may be why the torque is off, not
//                surely; or rounding of the speed may be why a small error is left
// Reads the data set and the model, nothing else.

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "estimators/diagnose/missing/search.h"
#include "estimators/diagnose/missing/stability.h"
#include "estimators/diagnose/missing/value_pattern.h"
#include "estimators/diagnose/next/next_experiment.h"
#include "estimators/model/model.h"
#include "rig/data/record.h"

namespace imrig::est {

struct CandidateResult {
  std::string effect;
  std::string form;
  std::string verdict;   // missing, confusable, negligible, absent, cannot tell
  double score = 0.0;    // lambda
  double p_value = 1.0;  // family-wise over the library; of a refit from record to record
  std::map<std::string, Parameter> estimate;
  double holdout_nrmse_before = kMissing, holdout_nrmse_after = kMissing;
  double distinguishability = kMissing;  // d from the best other candidate
};

// What is left over, when the library holds no explanation.
struct Unexplained {
  std::string channel;
  std::string depends_on;        // the condition that the misfit follows best; empty: none
  std::vector<double> lines_Hz;  // in the stationary frame, of the worst record
  std::string description;
};

struct Diagnosis {
  std::string verdict;
  std::string effect;                   // empty: none
  std::vector<std::string> confusable;  // the effect among them; empty without an effect
  std::size_t ranked_among = 0;
  std::vector<CandidateResult> candidates;
  std::vector<std::string> losses_in_doubt;  // at the shaft: may be why the torque is off, not surely
  bool rounding_in_doubt = false;  // a small error that is left may be that of a speed that was rounded
  std::optional<Unexplained> unexplained;
  std::optional<NextExperiment> next_experiment;
  std::vector<std::string> explanation;  // sentences for people
  std::vector<ValuePattern> patterns;    // of accepted values for each record
  Model model;                           // that was diagnosed: as it came, what it lacked fitted to the data
  Search search;
};

struct DiagnoseOptions {
  int threads = 2;
  std::size_t most_additions = 6;
  std::vector<std::string> without;  // effects that are ruled out, by name
  SearchReport report;
  std::optional<RigRange> range;  // of the next experiment; without: what the data have seen
};

// Base parameters that the model lacks are fitted to the data first (fit/global/start_from_data.h), and it is said.
// Throws Error: pole pairs differ, no effect has such a name, no record can be simulated.
Diagnosis diagnose(const Model& model, const DataSet& data, const DiagnoseOptions& options = {});

struct Improvement {
  Diagnosis diagnosis;  // of the first step, with the whole search
  Model model;  // with the accepted effects, and its history; the diagnosed one where the verdict is unknown
};

Improvement improve(const Model& model, const DataSet& data, const DiagnoseOptions& options = {});

}  // namespace imrig::est
