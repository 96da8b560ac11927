// A bad file or a missing wire ends in one clear sentence and exit code 2, and leaves nothing behind.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "rig/base/file.h"
#include "tests/e2e/command.h"

namespace imrig::test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

void expect_one_sentence(const Outcome& outcome, const std::string& about) {
  EXPECT_EQ(outcome.exit_code, 2) << outcome.out << outcome.err;
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr(about));
  EXPECT_THAT(outcome.err, ::testing::Not(HasSubstr("terminate")));
}

TEST(BadInput, MalformedPlanNamesFileAndKey) {
  const Folder folder;
  write_text_atomically(folder / "plan.toml", "version = 1\nname = \"x\"\nodd_key = 3\n");
  expect_one_sentence(run({"imrig", "campaign", "check", folder / "plan.toml"}), "odd_key");
  write_text_atomically(folder / "plan.toml", "version = [\n");
  expect_one_sentence(run({"imrig", "campaign", "check", folder / "plan.toml"}), "plan.toml");
  expect_one_sentence(run({"imrig", "campaign", "check", folder / "none.toml"}), "none.toml");
  write_text_atomically(folder / "plan.toml", "version = 1\nname = \"x\"\nodd_key = 3\n");
  expect_one_sentence(run({"imrig", "campaign", "run", folder / "plan.toml", "--out", folder / "out", "--emulate",
                           source("models/plants/proca_5hp.toml")}),
                      "odd_key");
  EXPECT_THAT(folder.names(), ::testing::ElementsAre("plan.toml"));
}

TEST(BadInput, MalformedModelIsRefused) {
  const Folder folder;
  write_text_atomically(folder / "model.toml", "version = 1\n[parameters]\nR_s = \"big\"\n");
  expect_one_sentence(run({"imrig", "compare", folder / "model.toml", source("tests/data/motor_18k5")}), "model.toml");
}

TEST(BadInput, MalformedManifestAndCsvNameTheirLine) {
  const Folder folder;
  write_text_atomically(folder / "dataset.toml",
                        "name = \"x\"\npole_pairs = 2\nconnection = \"star\"\nquantities = \"phase\"\n[[record]]\nid = \"a\"\n"
                        "kind = \"points\"\nfile = \"a.csv\"\n");
  write_text_atomically(folder / "a.csv", "v_rms_V,f_Hz,i_rms_A,p_in_W,speed_rpm\n100,50,1,oops,1490\n");
  expect_one_sentence(run({"imrig", "info", folder.path()}), "a.csv:2");
  const auto identified = run({"imrig", "identify", folder.path(), "--out", folder / "m.toml"});
  expect_one_sentence(identified, "a.csv:2");
  write_text_atomically(folder / "dataset.toml", "name = \"x\"\n");
  expect_one_sentence(run({"imrig", "info", folder.path()}), "pole_pairs");
  const auto imported = run({"imrig", "import", folder.path(), "--out", folder / "log.lcm"});
  expect_one_sentence(imported, "pole_pairs");
  EXPECT_THAT(folder.names(), ::testing::ElementsAre("a.csv", "dataset.toml"));
}

TEST(BadInput, GarbageIsNoLog) {
  const Folder folder;
  std::mt19937_64 random(7);
  std::string garbage(100000, '\0');
  for (auto& byte : garbage) byte = static_cast<char>(random());
  write_text_atomically(folder / "log.lcm", garbage);
  expect_one_sentence(run({"imrig", "info", folder / "log.lcm"}), "log.lcm");
  expect_one_sentence(run({"imrig", "identify", folder / "log.lcm", "--out", folder / "m.toml"}), "log.lcm");
  expect_one_sentence(run({"imrig", "replay", folder / "log.lcm"}), "log.lcm");
  write_text_atomically(folder / "log.lcm", "");
  expect_one_sentence(run({"imrig", "info", folder / "log.lcm"}), "log.lcm");
  EXPECT_THAT(folder.names(), ::testing::ElementsAre("log.lcm"));
}

TEST(BadInput, UnknownVerbOptionOrMissingFileIsUsage) {
  expect_one_sentence(run({"imrig", "frobnicate"}), "usage");
  expect_one_sentence(run({"imrig", "info", "/nonexistent/place"}), "/nonexistent/place");
  expect_one_sentence(run({"imrig", "identify", source("tests/data/motor_18k5"), "--out", "/nonexistent/m.toml"}), "/nonexistent");
  expect_one_sentence(run({"imrig", "identify", source("tests/data/motor_18k5"), "--out", "/tmp/imrig_never.toml", "--method", "magic"}),
                      "magic");
}

TEST(BadInput, PortInUseIsSaid) {
  const Folder folder;
  const int port = free_udp_port();
  const std::string link = "udp://127.0.0.1:" + std::to_string(port);
  const std::string plant = source("models/plants/proca_5hp.toml");
  const Background first({"imrig-emulator", "--config", plant, "--link", link, "--modbus", "tcp://127.0.0.1:0", "--pace", "max"},
                         folder / "first.log");
  for (int k = 0; k < 100 && read_text(folder / "first.log").find("ready") == std::string::npos; ++k) {
    run({"sleep", "0.1"});
  }
  expect_one_sentence(run({"imrig-emulator", "--config", plant, "--link", link, "--modbus", "tcp://127.0.0.1:0"}, 20),
                      std::to_string(port));
}

TEST(BadInput, AbsentRigIsANoAndNotAHang) {
  const Folder folder;
  write_text_atomically(folder / "rig.toml",
                        "version = 1\n[bus]\nurl = \"udpm://239.255.76.77:" + std::to_string(free_udp_port()) + "?ttl=0\"\n");
  EXPECT_EQ(run({"imrig", "status", "--config", folder / "rig.toml"}, 20).exit_code, 1);
  EXPECT_EQ(run({"imrig", "estop", "--config", folder / "rig.toml"}, 20).exit_code, 1);
}

// Nobody on the bus, then a bridge without a DSP, then a dyno without its supply.
TEST(BadInput, CampaignOnAnIncompleteRigNamesWhatIsMissingAndLeavesNoFolder) {
  const Folder folder;
  const std::string link = "udp://127.0.0.1:" + std::to_string(free_udp_port());
  write_text_atomically(folder / "rig.toml", "version = 1\n[bus]\nurl = \"udpm://239.255.76.77:" + std::to_string(free_udp_port()) +
                                                 "?ttl=0&recv_buf_size=4194304\"\n[bridge]\nlink = \"" + link +
                                                 "\"\n[dyno]\nlink = \"tcp://127.0.0.1:" + std::to_string(free_tcp_port()) + "\"\n");
  const std::vector<std::string> campaign = {"imrig",    "campaign", "run",         source("campaigns/smoke.toml"), "--config", folder / "rig.toml",
                                             "--out", folder / "out"};
  expect_one_sentence(run(campaign, 60), "imrig-bridge does not answer");
  const Background bridge({"imrig-bridge", "--config", folder / "rig.toml"});
  const Background dyno({"imrig-dyno", "--config", folder / "rig.toml"});
  expect_one_sentence(run(campaign, 60), "no DSP answers");
  const Background emulator({"imrig-emulator", "--config", source("models/plants/proca_5hp.toml"), "--link", link, "--modbus",
                             "tcp://127.0.0.1:0", "--pace", "realtime"});
  expect_one_sentence(run(campaign, 60), "no excitation supply answers");
  EXPECT_THAT(folder.names(), ::testing::ElementsAre("rig.toml"));
}

TEST(BadInput, BadBusUrlAndBadConfigurationAreSaid) {
  const Folder folder;
  write_text_atomically(folder / "rig.toml", "version = 1\n[bus]\nurl = \"carrier-pigeon://coop\"\n");
  for (const char* process : {"imrig-bridge", "imrig-dyno", "imrig-estimator"}) {
    expect_one_sentence(run({process, "--config", folder / "rig.toml"}, 20), "carrier-pigeon");
  }
  write_text_atomically(folder / "rig.toml", "version = 1\n[limits]\ncurrent_A = -3\n");
  for (const char* process : {"imrig-bridge", "imrig-dyno", "imrig-estimator"}) {
    expect_one_sentence(run({process, "--config", folder / "rig.toml"}, 20), "current_A");
  }
  write_text_atomically(folder / "rig.toml", "version = 1\n[bridge]\nlink = \"serial:///dev/nonexistent?baud=115200\"\n[bus]\nurl = \"udpm://239.255.76.77:" +
                                                 std::to_string(free_udp_port()) + "?ttl=0\"\n");
  expect_one_sentence(run({"imrig-bridge", "--config", folder / "rig.toml"}, 20), "/dev/nonexistent");
}

}  // namespace
}  // namespace imrig::test
