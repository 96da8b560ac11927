// imrig export DATA --out FOLDER: records as CSV at full precision, with the dataset.toml that reads them
// back.

#include "rig/cli/data_copy.h"
#include "rig/cli/verbs.h"
#include "rig/data/folder.h"

namespace imrig {

void add_export(CLI::App& app, int& exit_code) {
  add_data_copy(app, exit_code,
                {"export", "Write records as CSV files with their dataset.toml, exact to the bit", "data",
                 "data-set folders or event logs", "folder to write; new or empty", write_folder});
}

}  // namespace imrig
