#pragma once
// A record's own unknowns at their best for given parameters of the motor: initial flux, and what nobody
// measured. Gauss-Newton with damping; the current is nearly linear in them.

#include "estimators/fit/global/record_terms.h"

namespace imrig::est {

// Adds to a record's terms what is known of its own entries beforehand (what is physically possible, or what
// a rounding leaves; nothing of the initial state). The terms' lanes from `first` on are the entries `free`
// at x. An entry on a bound that wants beyond it is held there: its lane says nothing any more.
void add_local_priors(const std::vector<std::size_t>& free, const LocalVector<double>& x, Eigen::Index first,
                      RecordTerms& terms);

// The step d of a record's own entries from x that makes d'D d/2 + g'd least; where it would leave a bound it
// ends there, and the others make up for that.
Eigen::VectorXd bounded_step(const Eigen::MatrixXd& D, const Eigen::VectorXd& g,
                             const std::vector<std::size_t>& free, const LocalVector<double>& x);

// free: entries of `local` that move; local: start, and result.
void settle_record(const DrivenRecord& record, const Whitener& whitener, int steps,
                   const SharedVector<double>& shared, const std::vector<std::size_t>& free,
                   LocalVector<double>& local);

}  // namespace imrig::est
