#pragma once
// A verb that reads a data set, writes it in another form, and tells what was noticed on the way.

#include <CLI/CLI.hpp>
#include <string>

#include "rig/data/record.h"

namespace imrig {

struct DataCopy {
  const char* verb;
  const char* help;
  const char* source;  // name of the positional argument
  const char* source_help;
  const char* out_help;
  void (*write)(const DataSet& data, const std::string& path);
};

void add_data_copy(CLI::App& app, int& exit_code, const DataCopy& copy);

}  // namespace imrig
