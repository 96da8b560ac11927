#pragma once
// Predictions of a model with effects, at the record's own rate: what compare needs. Without effects the
// linear machine's own prediction is used (estimators/model/predict.h, output.h).

#include "estimators/fit/global/record_terms.h"
#include "estimators/model/effects/effect_list.h"
#include "estimators/model/model.h"
#include "estimators/model/predict.h"

namespace imrig::est {

// Shaft torque over a steady stretch of a series (estimators/fit/global/torque_windows.h).
struct TorquePrediction {
  std::size_t middle = 0;  // sample of the series
  double measured_Nm = 0.0, predicted_Nm = 0.0, sigma_Nm = 0.0;
};

class ModelPrediction {
 public:
  // Throws Error: base parameter not known, unknown effect.
  explicit ModelPrediction(const Model& model);

  const MachineParameters<double>& machine() const { return machine_; }

  // The record's own unknowns (initial flux, a temperature nobody measured) are estimated from it. Throws
  // Error when the record cannot be used.
  CurrentPrediction current(const TimeSeries& series) const;
  // One value for each steady stretch with a measured torque; R_r and the slip matter little in them.
  std::vector<TorquePrediction> torque(const TimeSeries& series) const;

  SteadyPoint point(const SteadyPoint& measured) const;

 private:
  Whitener plain(const DrivenRecord& record) const;  // that weighs all alike
  // The record's own unknowns, by its current.
  LocalVector<double> settled(const DrivenRecord& record) const;
  RecordTrace trace(const DrivenRecord& record, const LocalVector<double>& local) const;

  int pole_pairs_;
  MachineParameters<double> machine_;
  bool linear_;
  SharedVector<double> shared_{};
  std::vector<std::size_t> local_;
};

}  // namespace imrig::est
