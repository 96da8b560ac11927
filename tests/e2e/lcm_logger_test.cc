// Debian's lcm-logger during a campaign keeps what the recorder keeps: both logs identify to the same numbers.
// Run at real time, since lcm-logger's queue of 30 messages loses bursts (docs/event-log.md).

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "rig/base/file.h"
#include "rig/base/rig_config.h"
#include "tests/e2e/command.h"

namespace imrig::test {
namespace {

using nlohmann::json;

TEST(LcmLogger, LogOfACampaignIdentifiesToTheRecordersNumbers) {
  const Folder folder;
  RigConfig rig = load_rig_config(source("models/rigs/proca_5hp.toml"));
  rig.bus.url = "udpm://239.255.76.77:" + std::to_string(free_udp_port()) + "?ttl=0&recv_buf_size=4194304";
  rig.bridge.link = "udp://127.0.0.1:" + std::to_string(free_udp_port());
  rig.dyno.link = "tcp://127.0.0.1:" + std::to_string(free_tcp_port());
  write_text_atomically(folder / "rig.toml", to_toml(rig));
  Background logger({"lcm-logger", "--lcm-url=" + rig.bus.url, folder / "logger.lcm"});
  const auto campaign = run({"imrig", "campaign", "run", source("campaigns/smoke.toml"), "--config", folder / "rig.toml", "--emulate",
                             source("models/plants/proca_5hp.toml"), "--pace", "realtime", "--out", folder / "campaign"});
  ASSERT_EQ(campaign.exit_code, 0) << campaign.out << campaign.err;
  logger.stop();
  const auto ours = run({"imrig", "identify", folder / "campaign", "--out", folder / "a.toml", "--json"});
  const auto theirs = run({"imrig", "identify", folder / "logger.lcm", "--out", folder / "b.toml", "--json"});
  ASSERT_EQ(ours.exit_code, 0) << ours.err;
  ASSERT_EQ(theirs.exit_code, 0) << theirs.err;
  EXPECT_EQ(json::parse(ours.out).at("model"), json::parse(theirs.out).at("model"));
}

}  // namespace
}  // namespace imrig::test
