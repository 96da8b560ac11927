#pragma once
// The base parameters that a model lacks, from all records together (joint_circuit.h), so that no step after
// it has to refuse the model. What the model knows well stays and is held: to 1 %, R_s to 5 % where it was
// measured by itself, what has no interval because somebody gave it. What it knows less well is fitted again
// with the rest.

#include <string>
#include <vector>

#include "estimators/model/model.h"
#include "rig/data/record.h"

namespace imrig::est {

struct DataStart {
  Model model;
  std::vector<std::string> together;  // names of what was found from all records together
  std::vector<std::string>
      starts;  // what these data leave open: the model holds a rough start and no interval
  std::vector<std::size_t> records;  // of the data set, that were fitted
  std::string sentence;              // both, for people; empty where nothing was lacking
};

// A number that may be used: positive, and its 95 % interval, if it has one, no wider than itself.
bool is_result(const Parameter& p);

// Unchanged, with an empty sentence, where all four are results. Throws Error: no record can be simulated.
DataStart start_from_data(const Model& model, const DataSet& data, int threads);

}  // namespace imrig::est
