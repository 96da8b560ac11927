#pragma once
// Inverse of a normal matrix over the free unknowns, zero elsewhere. Directions that the data does not see at
// all (relative eigenvalue below 1e-13 after scaling) get a very large variance, never a small one.

#include <vector>

#include "estimators/fit/record_problem.h"

namespace imrig::est {

Normal inverse_over(const Normal& normal, const std::vector<int>& free);

}  // namespace imrig::est
