#pragma once
// A diagnosis and an improvement as the terminal shows them.

#include "estimators/diagnose/diagnose.h"

namespace imrig {

void print_diagnosis(const est::Diagnosis& diagnosis);
void print_steps(const est::Search& search);

// Where the search is, on a terminal; nothing in a pipe.
est::SearchReport search_report();

}  // namespace imrig
