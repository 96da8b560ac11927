#pragma once
// A table of steady points beside the phasor solution at the measured voltage, frequency and speed.
// Variance of an error from noise alone: the channel's own, plus (d prediction / d voltage)^2 sigma_v^2 and
// the same for the speed, whose rounding matters most: at small slip the rotor current is proportional to it.

#include "estimators/diagnose/compare.h"
#include "estimators/diagnose/effect_prediction.h"
#include "estimators/model/base_machine.h"

namespace imrig::est {

void compare_points(const ModelPrediction& model, const DataSet& data, const Record& record,
                    ComparedRecord& out);

}  // namespace imrig::est
