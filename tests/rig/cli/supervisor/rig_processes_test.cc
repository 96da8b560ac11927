// The real processes of a rig on the emulator, over LCM, DSP link and Modbus.

#include "rig/cli/supervisor/rig_processes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>

#include "rig/base/error.h"
#include "rig/base/file.h"
#include "tests/e2e/command.h"
#include "tests/rig/cli/supervisor/processes.h"

namespace imrig {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class RigProcessesTest : public ::testing::Test {
 protected:
  RigRequest request() {
    RigRequest r;
    r.folder = folder_.path();
    r.rig_copy = folder_ / "rig.toml";
    r.plant_path = test::source("models/plants/proca_5hp.toml");
    r.private_ports = true;
    r.pace = "realtime";
    r.recorder_out = folder_ / "rig.lcm";
    return r;
  }

  std::string complaint(const RigRequest& r) {
    try {
      RigProcesses rig(r);
    } catch (const Error& e) {
      return e.what();
    }
    return "no complaint";
  }

  test::Folder folder_;
};

TEST_F(RigProcessesTest, AllStartOnPortsOfTheirOwnAndStopByThemselves) {
  RigProcesses rig(request());
  std::vector<std::string> names;
  for (const auto& child : rig.children()) names.push_back(child->name());
  EXPECT_THAT(names, ElementsAre("imrig-emulator", "imrig-recorder", "imrig-estimator", "imrig-bridge", "imrig-dyno"))
      << "who reads the samples is there before who publishes them";
  const RigConfig written = load_rig_config(rig.rig_path());
  EXPECT_EQ(written.bridge.link, rig.rig().bridge.link);
  EXPECT_NE(written.bridge.link, RigConfig{}.bridge.link);
  EXPECT_NE(written.dyno.link, RigConfig{}.dyno.link);
  EXPECT_NE(written.bus.url, RigConfig{}.bus.url);
  EXPECT_EQ(rig.fallen(), "");
  EXPECT_THAT(rig.stop(30000), IsEmpty());
  for (const auto& child : rig.children())
    EXPECT_EQ(child->exit_code(), 0) << child->name() << ": " << child->last_words();
}

TEST_F(RigProcessesTest, BeyondRealTimeAnEmulatedRigOfItsOwnWaitsLongerAndHardwareNever) {
  const LimitsConfig usual;
  EXPECT_EQ(RigProcesses(request()).rig().limits.device_watchdog_ms, usual.device_watchdog_ms);
  test::Folder other;
  RigRequest fast = request();
  fast.pace = "max";
  fast.folder = other.path();
  fast.rig_copy = other / "rig.toml";
  fast.recorder_out = other / "rig.lcm";
  EXPECT_EQ(RigProcesses(fast).rig().limits.device_watchdog_ms, 2000);
}

TEST_F(RigProcessesTest, FallenProcessIsNamed) {
  RigProcesses rig(request());
  ::kill(rig.pid_of("imrig-dyno"), SIGKILL);
  EXPECT_TRUE(test::wait_until([&] { return !rig.fallen().empty(); }));
  EXPECT_THAT(rig.fallen(), HasSubstr("imrig-dyno ended with code 137"));
}

TEST_F(RigProcessesTest, BadPlantIsToldAndNothingRuns) {
  write_text_atomically(folder_ / "plant.toml", "version = 1\nnonsense = 1\n");
  RigRequest r = request();
  r.plant_path = folder_ / "plant.toml";
  EXPECT_THAT(complaint(r), HasSubstr("plant.toml"));
  EXPECT_THAT(test::descendants(::getpid()), IsEmpty());
}

TEST_F(RigProcessesTest, LinkPortInUseIsToldAndNothingRuns) {
  RigProcesses first(request());
  test::Folder other;
  RigRequest second = request();
  second.folder = other.path();
  second.rig_copy = other / "rig.toml";
  second.recorder_out = other / "rig.lcm";
  second.private_ports = false;
  second.rig = first.rig();
  const std::string what = complaint(second);
  EXPECT_THAT(what, HasSubstr("imrig-emulator"));
  EXPECT_THAT(what, HasSubstr(first.rig().bridge.link.substr(first.rig().bridge.link.rfind(':') + 1)));
  EXPECT_EQ(first.fallen(), "");
}

TEST_F(RigProcessesTest, BadRegisterMapStopsTheOthersAgain) {
  RigRequest r = request();
  r.rig.dyno.register_map = "/nonexistent/map.toml";
  EXPECT_THAT(complaint(r), HasSubstr("/nonexistent/map.toml"));
  EXPECT_THAT(test::descendants(::getpid()), IsEmpty());
}

}  // namespace
}  // namespace imrig
