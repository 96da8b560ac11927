// The real process on a real bus: what it publishes is what its core computes, bit for bit.

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <imrig_msg/ack_t.hpp>
#include <imrig_msg/estimate_t.hpp>
#include <imrig_msg/heartbeat_t.hpp>
#include <imrig_msg/samples_t.hpp>
#include <vector>

#include "rig/base/file.h"
#include "rig/bus/channels.h"
#include "tests/e2e/command.h"
#include "tests/estimators/online/sample_message.h"
#include "tests/estimators/online/synthetic.h"
#include "tests/rig/bus/wire.h"

namespace imrig::est {
namespace {

using imrig_msg::heartbeat_t;

Signal bench() {
  Signal s;
  s.f_Hz = 47.3;
  s.v_noise_V = 0.3;
  s.i_noise_A = 0.03;
  s.filter_s = 60e-6;
  s.v_scale = 0.125;  // exact as a float
  s.i_scale = 0.015625;
  return s;
}

TEST(EstimatorProcess, PublishesTheCoresEstimatesAndAcknowledgesWhatItHasRead) {
  const test::Folder folder;
  RigConfig config;
  config.bus = test::bus_config(test::free_udp_port());
  write_text_atomically(folder / "rig.toml", to_toml(config));
  const auto bus = open_lcm_bus(config.bus);
  std::vector<imrig_msg::estimate_t> estimates;
  imrig_msg::ack_t ack = {};
  heartbeat_t beat = {};
  subscribe<imrig_msg::estimate_t>(*bus, channel::kEstimate, [&](const auto& m) { estimates.push_back(m); });
  subscribe<imrig_msg::ack_t>(*bus, channel::kAck, [&](const auto& m) { ack = m; });
  subscribe<heartbeat_t>(*bus, channel::kHeartbeat, [&](const auto& m) { beat = m; });
  test::Background process({"imrig-estimator", "--config", folder / "rig.toml"}, folder / "out");
  ASSERT_TRUE(test::wait_until(*bus, [&] { return beat.process == heartbeat_t::ESTIMATOR; }))
      << read_text(folder / "out");
  EXPECT_EQ(beat.state, heartbeat_t::STARTING);

  Signal s = bench();
  s.filter_s = static_cast<double>(static_cast<float>(s.filter_s));
  const std::size_t n = 100 * 256, lost = 60 * 256;
  const Samples x = make_samples(s, n);
  std::vector<OperatingPoint> expected;
  OperatingPointEstimator core({.pole_pairs = config.motor.pole_pairs, .voltage_held = true, .leakage_H = config.motor.L_l_H},
                               [&](const auto& p) { expected.push_back(p); });
  std::int64_t seq = 0;
  for (std::size_t at = 0; at < n; at += 256, ++seq) {
    if (at == lost) continue;
    publish(*bus, channel::kSamples, sample_message(s, x, at, 256, seq));
    core.feed(block_of(s, x, at, 256, static_cast<std::int64_t>(at)));
    // As the bridge does: not further ahead than the follower allows.
    const auto behind = static_cast<std::int64_t>(at) - 8 * 256;
    ASSERT_TRUE(test::wait_until(*bus, [&] { return ack.read_index >= behind; }));
  }
  ASSERT_TRUE(test::wait_until(*bus, [&] { return ack.read_index == static_cast<std::int64_t>(n); }));
  ASSERT_TRUE(test::wait_until(*bus, [&] { return estimates.size() >= expected.size(); }));
  EXPECT_EQ(ack.boot_id, 77);
  EXPECT_EQ(ack.lost_blocks, 1);
  EXPECT_EQ(ack.process, heartbeat_t::ESTIMATOR);

  ASSERT_EQ(estimates.size(), expected.size());
  ASSERT_GE(estimates.size(), 6u);
  std::int64_t gaps = 0;
  for (std::size_t k = 0; k < estimates.size(); ++k) {
    const auto same = [](double a, double b) {
      return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
    };
    EXPECT_EQ(estimates[k].seq, static_cast<std::int64_t>(k) + 1);
    EXPECT_EQ(estimates[k].first_index, expected[k].first_index);
    EXPECT_EQ(estimates[k].last_index, expected[k].last_index);
    EXPECT_EQ(estimates[k].steady, expected[k].steady ? 1 : 0);
    EXPECT_TRUE(same(estimates[k].frequency_Hz, expected[k].frequency_Hz));
    EXPECT_TRUE(same(estimates[k].voltage_V, expected[k].voltage_V));
    EXPECT_TRUE(same(estimates[k].phi_rad, expected[k].phi_rad));
    EXPECT_TRUE(same(estimates[k].slip, expected[k].slip));
    EXPECT_TRUE(same(estimates[k].input_power_W, expected[k].input_power_W));
    EXPECT_NEAR(estimates[k].frequency_Hz, s.f_Hz, 1e-3);
    gaps += estimates[k].gaps;
  }
  EXPECT_EQ(gaps, 256);
  ASSERT_TRUE(test::wait_until(*bus, [&] { return beat.state == heartbeat_t::OK; }));
  EXPECT_EQ(process.stop(), 0);
  EXPECT_EQ(read_text(folder / "out"), "ready\n");
}

TEST(EstimatorProcess, ABadConfigurationIsOneSentenceAndExitCodeTwo) {
  const test::Folder folder;
  write_text_atomically(folder / "bad.toml", "version = 1\n[motor]\npole_pairs = 0\n");
  const test::Outcome out = test::run({"imrig-estimator", "--config", folder / "bad.toml"}, 60);
  EXPECT_EQ(out.exit_code, 2);
  EXPECT_NE(out.err.find("pole_pairs"), std::string::npos) << out.err;
}

}  // namespace
}  // namespace imrig::est
