#pragma once
// The verbs of the command imrig, one file each (verb_NAME.cc). A verb adds its options and a callback to the app; the callback sets
// exit_code: 0 done, 1 the answer is "no". Bad input throws Error, which main turns into one sentence and exit code 2.

#include <CLI/CLI.hpp>

namespace imrig {

void add_campaign(CLI::App& app, int& exit_code);
void add_compare(CLI::App& app, int& exit_code);
void add_diagnose(CLI::App& app, int& exit_code);
void add_estop(CLI::App& app, int& exit_code);
void add_export(CLI::App& app, int& exit_code);
void add_identify(CLI::App& app, int& exit_code);
void add_import(CLI::App& app, int& exit_code);
void add_improve(CLI::App& app, int& exit_code);
void add_info(CLI::App& app, int& exit_code);
void add_model(CLI::App& app, int& exit_code);
void add_replay(CLI::App& app, int& exit_code);
void add_reset(CLI::App& app, int& exit_code);
void add_status(CLI::App& app, int& exit_code);
void add_up(CLI::App& app, int& exit_code);

}  // namespace imrig
