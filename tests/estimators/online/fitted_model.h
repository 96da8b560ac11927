#pragma once
// The model with effects that an ideal identification of a plant would write: saturation of main flux and
// leakage, deep bars, core loss, fitted to the phasors of the plant's truth over frequency, voltage and slip,
// cold. Without noise, by Levenberg and Marquardt's method on the logarithms.

#include "estimators/model/model.h"
#include "plant/plant_config.h"

namespace imrig::test {

struct FittedModel {
  est::Model model;
  double rms_share = 0.0;  // of the current, over the points fitted
  int points = 0;
};

FittedModel fitted_model(const plant::PlantConfig& config, double rated_Hz, double rated_V, double cold_C);

}  // namespace imrig::test
