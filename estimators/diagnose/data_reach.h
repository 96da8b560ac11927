#pragma once
// What a data set cannot reveal, whatever the model: conditions that it does not vary, channels that it does
// not have. Sentences for people.

#include <string>
#include <vector>

#include "estimators/diagnose/compare.h"

namespace imrig::est {

std::vector<std::string> data_reach(const DataSet& data, const CompareResult& result);

}  // namespace imrig::est
