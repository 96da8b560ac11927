#pragma once
// A diagnosis as the terminal shows it.

#include "estimators/diagnose/diagnose.h"

namespace imrig {

void print_diagnosis(const est::Diagnosis& diagnosis);

// Where the search is, on a terminal; nothing in a pipe.
est::SearchReport search_report();

}  // namespace imrig
