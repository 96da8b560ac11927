#pragma once
// Channels that come late, and what they may be: samples that are means, an encoder's window, currents behind
// a filter.

#include "estimators/diagnose/diagnose.h"

namespace imrig::est {

// Voltage and speed were accepted as being ahead by the same time.
bool currents_are_late(const Diagnosis& d);

void explain_late_channels(const GlobalProblem& problem, Diagnosis& d);

}  // namespace imrig::est
