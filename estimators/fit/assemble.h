#pragma once
// Record estimates to the model's parameters: combine.h over the records that speak for a parameter, then the
// systematic part: R_s that was given moves the others (d theta / d R_s), and the gains of the sensors scale
// every impedance alike.

#include <vector>

#include "estimators/fit/identify.h"

namespace imrig::est {

// Relative sigma of every impedance from the declared gains of both sensors.
double gain_sigma(const Accuracy& accuracy);

// Combines the estimates named `name` of the given results. Records set aside as outliers lose the parameter
// from used_for and gain a reason; where no record is good enough the best ones are taken and the notes say
// so. Returns a parameter without value when nothing is there.
Parameter assemble(const char* name, const std::vector<RecordResult*>& results, double R_s_sigma,
                   const Accuracy& accuracy, std::vector<std::string>& notes);

}  // namespace imrig::est
