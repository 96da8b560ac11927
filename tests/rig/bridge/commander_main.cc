// A process that takes the bridge's lease, starts the motor and keeps the lease until it is killed. Says
// "driving".

#include <cstdio>

#include "rig/base/error.h"
#include "tests/rig/bridge/commander.h"

namespace imrig {
namespace {

int body(int argc, char** argv) {
  if (argc != 2) throw Error("usage", "bridge_commander rig.toml");
  Commander commander(load_rig_config(argv[1]));
  if (!commander.drive()) throw Error("bridge_commander", "the motor did not start");
  std::puts("driving");
  std::fflush(stdout);
  commander.until([] { return false; }, 120'000);
  return 0;
}

}  // namespace
}  // namespace imrig

int main(int argc, char** argv) { return imrig::run_main("bridge_commander", imrig::body, argc, argv); }
