// imrig export DATA --out FOLDER: records as CSV at full precision, with the dataset.toml that reads them
// back.

#include <fmt/format.h>

#include <memory>

#include "rig/cli/load_data.h"
#include "rig/cli/text_table.h"
#include "rig/cli/verbs.h"
#include "rig/data/folder.h"

namespace imrig {

namespace {

struct Options {
  std::vector<std::string> data;
  std::string out;
};

void run(const Options& options) {
  const DataSet data = load_data(options.data);
  write_folder(data, options.out);
  fmt::print("{}: {} records written to {}\n", printable(data.name), data.records.size(), options.out);
  for (const auto& note : data.notes) fmt::print("note: {}\n", printable(note));
}

}  // namespace

void add_export(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();
  CLI::App* verb =
      app.add_subcommand("export", "Write records as CSV files with their dataset.toml, exact to the bit");
  verb->add_option("data", options->data, "data-set folders or event logs")->required();
  verb->add_option("--out", options->out, "folder to write; new or empty")->required();
  verb->callback([options, &exit_code] {
    run(*options);
    exit_code = 0;
  });
}

}  // namespace imrig
