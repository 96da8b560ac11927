#pragma once
// What an effect with a value for each record found: those values, and what of them a user would write down.

#include <map>
#include <string>
#include <vector>

#include "estimators/diagnose/missing/trial.h"

namespace imrig::est {

struct RecordValues {
  std::vector<double> y, sigma;  // one an entry of `which`; NaN where the record says nothing
};

// terms: of trial's model at `which`. local: the entry.
RecordValues record_values(const GlobalProblem& problem, const Trial& trial, const GlobalTerms& terms,
                           const std::vector<std::size_t>& which, std::size_t local);

// Of an active effect with one value (a warmth): NAME_highest and NAME_lowest over the fitted records that
// know theirs, relative to the parameter that the model holds. With two that only a phase tells apart (a
// broken bar): beta, their mean size. Empty where no record knows.
std::map<std::string, Parameter> estimates_by_record(const GlobalProblem& problem, const Trial& trial,
                                                     const Candidate& candidate);

}  // namespace imrig::est
