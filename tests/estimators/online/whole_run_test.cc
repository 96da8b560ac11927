// A log that imrig itself has recorded, read again, gives the estimates that were published live, from the very first
// block on: recorder and estimator listen before the bridge speaks.

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <imrig_msg/motor_estimate_t.hpp>
#include <imrig_msg/samples_t.hpp>

#include "rig/base/file.h"
#include "rig/bus/guarded_decode.h"
#include "tests/e2e/command.h"
#include "tests/estimators/online/estimate_stream.h"

namespace imrig::test {
namespace {

constexpr std::size_t kEnd = 8;  // estimates that the end of a run may cut off on either side

void expect_live_equals_replay(const Folder& folder, const std::string& log, const std::string& config) {
  EventLogReader reader(log);
  LogEvent event;
  std::int64_t first_seq = -1;
  while (first_seq < 0 && reader.next(event)) {
    if (!event.channel.ends_with("_SAMPLES")) continue;
    if (const auto block = guarded_decode<imrig_msg::samples_t>(event.data)) first_seq = block->seq;
  }
  EXPECT_EQ(first_seq, 0) << "the log begins with the stream's first block";
  const std::string again = folder / "again.lcm";
  const Outcome read = run({"imrig-estimator", "--config", config, "--url", "file://" + log + "?speed=0", "--out", again});
  ASSERT_EQ(read.exit_code, 0) << read.err;
  EstimateStream live = estimates_of(log), replayed = estimates_of(again);
  ASSERT_GT(live.messages.size(), 10u);
  const std::size_t common = std::min(live.messages.size(), replayed.messages.size());
  ASSERT_LE(std::max(live.messages.size(), replayed.messages.size()) - common, kEnd);
  live.messages.resize(common);
  replayed.messages.resize(common);
  EXPECT_EQ(hash_of(live), hash_of(replayed));
}

// The folder of a campaign on the emulated 5 hp motor.
std::string campaign_on_the_rig(const Folder& folder, const std::string& plan) {
  const std::string out = folder / "campaign";
  const Outcome campaign = run({"imrig", "campaign", "run", source("campaigns/" + plan), "--emulate",
                                source("models/plants/proca_5hp.toml"), "--pace", "max", "--out", out});
  EXPECT_EQ(campaign.exit_code, 0) << campaign.out << campaign.err;
  return out;
}

TEST(WholeRun, CampaignsLogReplaysToItsLiveEstimates) {
  const Folder folder;
  const std::string out = campaign_on_the_rig(folder, "smoke.toml");
  ASSERT_FALSE(HasFailure());
  expect_live_equals_replay(folder, out + "/log-000.lcm", out + "/rig.toml");
}

// Tones at standstill: while they run, every message brings the four parameters, ever better known.
TEST(WholeRun, StandstillEstimatesArePublishedWhileTheirProfileRuns) {
  const Folder folder;
  const std::string out = campaign_on_the_rig(folder, "standstill_slow.toml");
  ASSERT_FALSE(HasFailure());
  using imrig_msg::motor_estimate_t;
  std::int64_t from = -1, to = -1;  // samples of the record
  std::vector<motor_estimate_t> during;
  EventLogReader reader(out + "/log-000.lcm");
  LogEvent event;
  while (reader.next(event)) {
    if (event.channel.ends_with("_SAMPLES")) {
      const auto block = guarded_decode<imrig_msg::samples_t>(event.data);
      ASSERT_TRUE(block);
      if (block->record == 0) continue;
      if (from < 0) from = block->first_index;
      to = block->first_index + block->n;
    }
    if (!event.channel.ends_with(std::string("_") + channel::kMotorEstimate)) continue;
    const auto e = guarded_decode<motor_estimate_t>(event.data);
    ASSERT_TRUE(e);
    if (e->standstill == motor_estimate_t::TONES && e->last_index < to) during.push_back(*e);
  }
  const auto span_s = [](std::int64_t samples) { return static_cast<double>(samples) * 60e-6; };
  ASSERT_GT(static_cast<double>(during.size()), 1.5 * span_s(to - from)) << "one every half second at least";
  EXPECT_LT(span_s(to - during.back().last_index), 1.0) << "up to the end";
  const motor_estimate_t& last = during.back();
  const struct {
    const imrig_msg::quantity_t* q;
    double truth;
  } found[] = {{&last.standstill_R_s_ohm, 0.39}, {&last.standstill_R_r_ohm, 0.22}, {&last.standstill_L_l_H, 0.006}, {&last.standstill_L_m_H, 0.068}};
  for (const auto& [q, truth] : found) {
    EXPECT_NEAR(q->value, truth, 0.02 * truth);
    EXPECT_LT(q->low, truth);
    EXPECT_GT(q->high, truth);
  }
  const auto width = [](const imrig_msg::quantity_t& q) { return q.high - q.low; };
  EXPECT_LT(width(last.standstill_L_m_H), 0.5 * width(during[during.size() / 10].standstill_L_m_H));
}

TEST(WholeRun, LogOfImrigUpReplaysToItsLiveEstimates) {
  const Folder folder;
  const std::string out = folder / "up", words = folder / "up.out";
  Background up({"imrig", "up", "--emulate", source("models/plants/proca_5hp.toml"), "--pace", "4", "--out", out}, words);
  for (int k = 0; k < 600 && read_text(words).find("up; other commands") == std::string::npos; ++k) ::usleep(50'000);
  ::usleep(3'000'000);
  EXPECT_EQ(up.stop(), 0) << read_text(words);
  expect_live_equals_replay(folder, out + "/rig.lcm", out + "/rig.toml");
}

}  // namespace
}  // namespace imrig::test
