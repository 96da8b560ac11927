// imrig import FOLDER --out LOG.lcm: a folder of CSV or MAT files as one event log that every LCM tool can
// read.

#include "rig/bus/log_import.h"
#include "rig/cli/data_copy.h"
#include "rig/cli/verbs.h"

namespace imrig {

void add_import(CLI::App& app, int& exit_code) {
  add_data_copy(app, exit_code,
                {"import", "Turn a folder with dataset.toml and CSV or MAT files into an event log", "folder",
                 "data-set folder", "event log to write", write_log});
}

}  // namespace imrig
