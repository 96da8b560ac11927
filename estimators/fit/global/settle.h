#pragma once
// A record's own unknowns at their best for given parameters of the motor: initial flux, and what nobody
// measured. Gauss-Newton with damping; the current is nearly linear in them.

#include "estimators/fit/global/record_terms.h"

namespace imrig::est {

// Prior of a record's own entry: what is physically possible, or a rounding; infinite for the initial state.
double local_prior_sigma(std::size_t entry);

// free: entries of `local` that move; local: start, and result.
void settle_record(const DrivenRecord& record, const Whitener& whitener, int steps,
                   const SharedVector<double>& shared, const std::vector<std::size_t>& free,
                   LocalVector<double>& local);

}  // namespace imrig::est
