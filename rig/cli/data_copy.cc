#include "rig/cli/data_copy.h"

#include <fmt/format.h>

#include <memory>

#include "rig/cli/load_data.h"
#include "rig/cli/text_table.h"

namespace imrig {

namespace {

struct Options {
  std::vector<std::string> data;
  std::string out;
};

void run(const Options& options, const DataCopy& copy) {
  const DataSet data = load_data(options.data);
  copy.write(data, options.out);
  fmt::print("{}: {} records written to {}\n", printable(data.name), data.records.size(), options.out);
  for (const auto& record : data.records) {
    for (const auto& warning : record.warnings)
      fmt::print("warning: {}: {}\n", printable(record.id), printable(warning));
  }
  for (const auto& note : data.notes) fmt::print("note: {}\n", printable(note));
}

}  // namespace

void add_data_copy(CLI::App& app, int& exit_code, const DataCopy& copy) {
  const auto options = std::make_shared<Options>();
  CLI::App* verb = app.add_subcommand(copy.verb, copy.help);
  verb->add_option(copy.source, options->data, copy.source_help)->required();
  verb->add_option("--out", options->out, copy.out_help)->required();
  verb->callback([options, copy, &exit_code] {
    run(*options, copy);
    exit_code = 0;
  });
}

}  // namespace imrig
