// imrig status, estop and reset on a whole rig: emulator, bridge and dyno as processes.

#include <gtest/gtest.h>
#include <signal.h>
#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/rig/bridge/commander.h"
#include "tests/rig/bridge/process.h"

namespace imrig {
namespace {

using imrig_msg::bridge_cmd_t;

std::string word_after(const std::string& line, const std::string& key) {
  const auto from = line.find(key);
  return from == std::string::npos ? ""
                                   : line.substr(from + key.size(), line.find(' ', from) - from - key.size());
}

class Verbs : public ::testing::Test {
 protected:
  Verbs() {
    std::string pattern = (std::filesystem::temp_directory_path() / "imrig-verbs-XXXXXX").string();
    folder_ = ::mkdtemp(pattern.data());
    config_ = test_rig("udp://127.0.0.1:9");
  }
  ~Verbs() override { std::filesystem::remove_all(folder_); }

  std::string rig_file() const { return folder_ + "/rig.toml"; }
  void write_rig() const { std::ofstream(rig_file()) << to_toml(config_); }

  void start_rig() {
    emulator_ = std::make_unique<Process>(std::vector<std::string>{
        "imrig-emulator", "--config", std::string(IMRIG_SOURCE_DIR) + "/models/plants/proca_5hp.toml",
        "--link", "udp://127.0.0.1:0", "--modbus", "tcp://127.0.0.1:0", "--pace", "realtime"});
    const std::string ready = emulator_->first_line();
    config_.bridge.link = word_after(ready, "link=");
    config_.dyno.link = word_after(ready, "modbus=");
    write_rig();
    bridge_ = std::make_unique<Process>(std::vector<std::string>{"imrig-bridge", "--config", rig_file()});
    dyno_ = std::make_unique<Process>(std::vector<std::string>{"imrig-dyno", "--config", rig_file()});
    ASSERT_EQ(bridge_->first_line(), "ready");
    ASSERT_EQ(dyno_->first_line(), "ready");
  }

  struct Said {
    int code;
    std::string out, err;
  };
  Said imrig(std::vector<std::string> words) const {
    words.insert(words.begin(), "imrig");
    words.insert(words.end(), {"--config", rig_file()});
    Process process(words);
    Said said;
    said.code = process.wait(30'000);
    said.out = process.output();
    said.err = process.errors();
    return said;
  }
  nlohmann::json status() const { return nlohmann::json::parse(imrig({"status", "--json"}).out); }
  // The rig needs a moment to meet its wires.
  bool link_comes_up() const {
    for (int k = 0; k < 10; ++k) {
      const auto now = status();
      if (now["bridge"].is_object() && now["bridge"]["link"] == "up" && now["dyno"].is_object() &&
          now["dyno"]["link"] == "up")
        return true;
    }
    return false;
  }

  std::string folder_;
  RigConfig config_;
  std::unique_ptr<Process> emulator_, bridge_, dyno_;
};

TEST_F(Verbs, WithoutARigEachSaysSoAndEndsWithOne) {
  write_rig();
  const Said status = imrig({"status"});
  EXPECT_EQ(status.code, 1);
  EXPECT_NE(status.out.find("no rig is alive"), std::string::npos) << status.out;
  const Said estop = imrig({"estop"});
  EXPECT_EQ(estop.code, 1);
  EXPECT_NE(estop.err.find("nobody answered"), std::string::npos) << estop.err;
  const Said reset = imrig({"reset"});
  EXPECT_EQ(reset.code, 1);
  EXPECT_NE(reset.err.find("no rig is alive"), std::string::npos) << reset.err;
}

TEST_F(Verbs, BadConfigurationEndsWithTwo) {
  for (const char* verb : {"status", "estop", "reset"}) {
    const Said said = imrig({verb});  // no file was written
    EXPECT_EQ(said.code, 2) << verb;
    EXPECT_NE(said.err.find(rig_file()), std::string::npos) << said.err;
  }
}

TEST_F(Verbs, StopTripsBothActuatorsAndResetClearsBoth) {
  start_rig();
  ASSERT_TRUE(link_comes_up());
  const auto before = status();
  EXPECT_EQ(before["alive"], true);
  EXPECT_EQ(before["bridge"]["run_state"], "idle");
  EXPECT_EQ(before["bridge"]["trip"], 0);
  EXPECT_TRUE(before["bridge"]["lease"].is_null());
  EXPECT_EQ(before["processes"].size(), 2u);

  const Said stop = imrig({"estop"});
  EXPECT_EQ(stop.code, 0) << stop.err;
  EXPECT_NE(stop.out.find("imrig-bridge: tripped"), std::string::npos) << stop.out;
  EXPECT_NE(stop.out.find("imrig-dyno: tripped"), std::string::npos) << stop.out;
  const auto tripped = status();
  EXPECT_EQ(tripped["bridge"]["run_state"], "tripped");
  EXPECT_EQ(tripped["dyno"]["run_state"], "tripped");

  const Said reset = imrig({"reset"});
  EXPECT_EQ(reset.code, 0) << reset.err;
  const auto after = status();
  EXPECT_EQ(after["bridge"]["trip"], 0);
  EXPECT_EQ(after["bridge"]["run_state"], "idle");
  EXPECT_EQ(after["dyno"]["trip"], 0);
}

TEST_F(Verbs, StopStopsARunningMotorAndResetIsRefusedWhileAnotherCommands) {
  start_rig();
  Commander commander(config_);
  ASSERT_TRUE(commander.drive());
  ASSERT_TRUE(commander.until([&] { return commander.status()->current_peak_A > 1.0; }))
      << "the motor draws current";
  Process stop({"imrig", "estop", "--config", rig_file()});
  ASSERT_TRUE(commander.until([&] { return commander.is(imrig_msg::bridge_status_t::TRIPPED); }));
  EXPECT_EQ(stop.wait(), 0);
  ASSERT_TRUE(commander.lease.held());
  Process reset({"imrig", "reset", "--config", rig_file()});
  int code = -1;
  commander.until([&] { return (code = reset.wait(0)) != -1; },
                  30'000);  // we keep the bridge's lease meanwhile
  EXPECT_EQ(code, 1);
  EXPECT_NE(reset.errors().find("somebody else commands it"), std::string::npos);
  EXPECT_TRUE(commander.is(imrig_msg::bridge_status_t::TRIPPED));
}

}  // namespace
}  // namespace imrig
