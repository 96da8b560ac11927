#pragma once
// Predictions of a model with effects, at the record's own rate: what compare needs. Without effects the
// linear machine's own prediction is used (estimators/model/predict.h, output.h).

#include "estimators/model/effects/effect_list.h"
#include "estimators/model/model.h"
#include "estimators/model/predict.h"

namespace imrig::est {

class ModelPrediction {
 public:
  // Throws Error: base parameter not known, unknown effect.
  explicit ModelPrediction(const Model& model);

  const MachineParameters<double>& machine() const { return machine_; }

  // The record's own unknowns (initial flux, a temperature nobody measured) are estimated from it. Throws
  // Error when the record cannot be used.
  CurrentPrediction current(const TimeSeries& series) const;

  SteadyPoint point(const SteadyPoint& measured) const;

 private:
  int pole_pairs_;
  MachineParameters<double> machine_;
  bool linear_;
  SharedVector<double> shared_{};
  std::vector<std::size_t> local_;
};

}  // namespace imrig::est
