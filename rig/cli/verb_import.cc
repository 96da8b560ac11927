// imrig import FOLDER --out LOG.lcm: a folder of CSV or MAT files as one event log that every LCM tool can
// read.

#include <fmt/format.h>

#include <memory>

#include "rig/bus/log_import.h"
#include "rig/cli/load_data.h"
#include "rig/cli/text_table.h"
#include "rig/cli/verbs.h"

namespace imrig {

namespace {

struct Options {
  std::vector<std::string> data;
  std::string out;
};

void run(const Options& options) {
  const DataSet data = load_data(options.data);
  write_log(data, options.out);
  fmt::print("{}: {} records written to {}\n", printable(data.name), data.records.size(), options.out);
  for (const auto& record : data.records) {
    for (const auto& warning : record.warnings)
      fmt::print("warning: {}: {}\n", printable(record.id), printable(warning));
  }
  for (const auto& note : data.notes) fmt::print("note: {}\n", printable(note));
}

}  // namespace

void add_import(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();
  CLI::App* verb =
      app.add_subcommand("import", "Turn a folder with dataset.toml and CSV or MAT files into an event log");
  verb->add_option("folder", options->data, "data-set folder")->required();
  verb->add_option("--out", options->out, "event log to write")->required();
  verb->callback([options, &exit_code] {
    run(*options);
    exit_code = 0;
  });
}

}  // namespace imrig
