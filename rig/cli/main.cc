// The command imrig: composes the rooms, holds no logic of its own.

#include "rig/base/command_line.h"
#include "rig/cli/verbs.h"

namespace imrig {
namespace {

int body(int argc, char** argv) {
  CLI::App app{"imrig: run an induction-motor test rig, identify the motor, see where the model fails."};
  app.name("imrig");
  app.require_subcommand(1);
  app.set_version_flag("--version", IMRIG_VERSION);
  int exit_code = 0;
  for (const auto add : {add_up, add_status, add_estop, add_reset, add_campaign, add_info, add_import, add_export, add_identify,
                         add_compare, add_diagnose, add_improve, add_model, add_replay}) {
    add(app, exit_code);
  }
  return parse_command_line(app, "imrig", argc, argv).value_or(exit_code);
}

}  // namespace
}  // namespace imrig

int main(int argc, char** argv) { return imrig::run_main("imrig", imrig::body, argc, argv); }
