#pragma once
// What voltage noise does to an estimate in the second order. The noise passes through the model into the
// predicted current, so error and Jacobian hold the same noise and the gradient of chi2 does not vanish at
// the true parameters:
//   E[J'e] = N sigma_v^2 sum_k Re(dg_k/dtheta* g_k),   g: whitened response of the current to a pulse of
//   voltage
// A fit that wants no bias moves by H^-1 E[J'e]. (The same as transient_noise.h says of a single record.)

#include "estimators/fit/global/record_terms.h"

namespace imrig::est {

// Over the given entries of the shared vector; those of effects get 0. By the linear machine.
Eigen::VectorXd noise_gradient(const DrivenRecord& record, const Whitener& whitener, int steps,
                               const SharedVector<double>& shared, const std::vector<std::size_t>& entries,
                               const NoiseLevels& noise);

}  // namespace imrig::est
