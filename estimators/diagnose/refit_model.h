#pragma once
// A model with its effects fitted to all records at once (estimators/fit/global), with a revision that says
// so.

#include <string>

#include "estimators/model/model.h"
#include "rig/data/record.h"

namespace imrig::est {

// Throws Error: pole pairs differ, a base parameter is not known, the fit does not settle.
Model refit_model(const Model& model, const DataSet& data, const std::string& change, int threads);

}  // namespace imrig::est
