// imrig campaign run and imrig up as a user runs them: real processes, real sockets, real files.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <csignal>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

#include "rig/base/file.h"
#include "rig/base/rig_config.h"
#include "rig/bus/event_log.h"
#include "rig/campaign/journal.h"
#include "rig/campaign/log_scan.h"
#include "rig/cli/campaign_folder.h"
#include "rig/cli/supervisor/child_process.h"
#include "tests/e2e/command.h"
#include "tests/rig/cli/supervisor/processes.h"

namespace imrig {
namespace {

using nlohmann::json;
using test::Folder;
using test::run;
using test::source;
using ::testing::HasSubstr;

constexpr int kQuickPoints = 27;

std::vector<std::string> command(const std::string& out, const std::vector<std::string>& more = {},
                                 const std::string& pace = "max") {
  std::vector<std::string> argv = {"imrig",     "campaign",
                                   "run",       source("campaigns/quick.toml"),
                                   "--emulate", source("models/plants/proca_5hp.toml"),
                                   "--pace",    pace,
                                   "--out",     out};
  argv.insert(argv.end(), more.begin(), more.end());
  return argv;
}

// Lines of a kind in the journal, by id.
std::multiset<std::string> journalled(const std::string& folder, const std::string& event) {
  std::multiset<std::string> ids;
  std::istringstream lines(read_text(journal_path(folder)));
  for (std::string line; std::getline(lines, line);) {
    const json entry = json::parse(line);
    if (entry.at("event") == event) ids.insert(entry.value("id", ""));
  }
  return ids;
}

RigConfig rig_on_free_ports(const std::string& bus_options = "") {
  RigConfig rig;
  rig.bus.url = "udpm://239.255.76.77:" + std::to_string(test::free_udp_port()) + "?ttl=0" + bus_options;
  rig.bridge.link = "udp://127.0.0.1:" + std::to_string(test::free_udp_port());
  rig.dyno.link = "tcp://127.0.0.1:" + std::to_string(test::free_tcp_port());
  return rig;
}

TEST(CampaignRun, QuickPlanRunsWholeWithoutALostSample) {
  const Folder folder;
  const auto outcome = run(command(folder / "c", {"--json"}));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const json result = json::parse(outcome.out);
  EXPECT_EQ(result.at("end"), "done");
  EXPECT_EQ(result.at("points_done"), kQuickPoints);
  EXPECT_EQ(result.at("lost_blocks"), 0);
  std::printf("quick campaign at pace max: %.1f s of wall time\n", result.at("wall_s").get<double>());
  const DataSet set = read_campaign_folder(folder / "c");
  EXPECT_EQ(set.records.size(), static_cast<std::size_t>(kQuickPoints));
  EXPECT_EQ(read_text(folder / "c/plan.toml"), read_text(source("campaigns/quick.toml")));
  EXPECT_NO_THROW(load_rig_config(folder / "c/rig.toml"));
  EXPECT_EQ(outcome.err, "") << "quiet in a pipe";
  const auto again = run(command(folder / "c"));
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, HasSubstr("--resume"));
  const auto nothing_left = run(command(folder / "c", {"--resume"}));
  EXPECT_EQ(nothing_left.exit_code, 0) << nothing_left.err;
  EXPECT_EQ(journalled(folder / "c", "point").size(), static_cast<std::size_t>(kQuickPoints));
}

// Kills everything at a moment drawn from the seed, several times over, and resumes; no point may be lost and
// none recorded twice.
class CampaignKilled : public ::testing::TestWithParam<int> {};

TEST_P(CampaignKilled, LosesNoPointAndTakesNoneTwice) {
  std::mt19937_64 random(static_cast<std::uint64_t>(GetParam()));
  const Folder folder;
  const std::string out = folder / "c";
  std::set<std::string> finished;  // in the journal when a kill struck
  int kills = 0;
  for (; kills < 3; ++kills) {
    std::vector<std::string> argv = command(out);
    argv[0] = std::string(IMRIG_BIN_DIR) + "/imrig";
    if (has_journal(out)) argv.push_back("--resume");
    ChildProcess campaign({"imrig", argv, folder / "campaign.log"});
    const std::size_t target = finished.size() + 1 + random() % 8;
    const auto far_enough = [&] {
      return (has_journal(out) && read_journal(out).done.size() >= target) || !campaign.running();
    };
    ASSERT_TRUE(test::wait_until(far_enough, 120));
    std::this_thread::sleep_for(std::chrono::milliseconds(random() % 100));
    std::vector<pid_t> all = test::descendants(campaign.pid());
    if (GetParam() % 2 == 0) all.clear();  // the others must go by themselves then
    all.insert(all.begin(), campaign.pid());
    for (const pid_t pid : all) ::kill(pid, SIGKILL);
    EXPECT_TRUE(test::wait_until([&] { return !campaign.running(); }));
    for (const DonePoint& p : read_journal(out).done) finished.insert(p.id);
    if (finished.size() >= kQuickPoints) break;
  }
  write_text_atomically(log_part_path(out, count_log_parts(out)),
                        "");  // killed between the log's and the journal's first line
  const auto outcome = run(command(out, {"--resume", "--json"}));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(json::parse(outcome.out).at("points_done"), kQuickPoints);

  const auto points = journalled(out, "point");
  EXPECT_EQ(points.size(), static_cast<std::size_t>(kQuickPoints));
  EXPECT_EQ(std::set<std::string>(points.begin(), points.end()).size(), points.size())
      << "a point was taken twice";
  EXPECT_TRUE(journalled(out, "withdrawn").empty()) << "the journal ran ahead of the log";
  std::set<std::string> whole;
  std::set<int> numbers;
  for (const DonePoint& p : scan_log_parts(out, "IMRIG").whole) {
    whole.insert(p.id);
    EXPECT_TRUE(numbers.insert(p.number).second) << "record numbers are unique over all parts";
  }
  EXPECT_EQ(whole.size(), static_cast<std::size_t>(kQuickPoints));
  for (const std::string& id : finished) EXPECT_TRUE(whole.contains(id)) << id << " was finished and is lost";
  EXPECT_EQ(read_campaign_folder(out).records.size(), static_cast<std::size_t>(kQuickPoints));
}

INSTANTIATE_TEST_SUITE_P(Seeds, CampaignKilled, ::testing::Values(1, 2, 3, 4));

TEST(CampaignRun, CtrlCStopsSafelyWithExitCodeOneAndAnIntactJournal) {
  const Folder folder;
  std::vector<std::string> argv = command(folder / "c", {}, "2");
  argv[0] = std::string(IMRIG_BIN_DIR) + "/imrig";
  ChildProcess campaign({"imrig", argv, folder / "campaign.log"});
  ASSERT_TRUE(test::wait_until(
      [&] { return has_journal(folder / "c") && !read_journal(folder / "c").done.empty(); }, 120));
  const std::vector<pid_t> others = test::descendants(campaign.pid());
  ASSERT_GE(others.size(), 5u);
  ::kill(campaign.pid(), SIGINT);
  ASSERT_TRUE(test::wait_until([&] { return !campaign.running(); }, 120));
  EXPECT_EQ(campaign.exit_code(), 1) << read_text(folder / "campaign.log");
  EXPECT_THAT(campaign.last_words(), HasSubstr("stopped by the operator"));
  EXPECT_TRUE(test::wait_until([&] { return std::none_of(others.begin(), others.end(), test::alive); }));
  EXPECT_EQ(journalled(folder / "c", "ended").size(), 1u);
  EXPECT_FALSE(read_journal(folder / "c").torn);
}

TEST(CampaignRun, EmergencyStopEndsItWithTheReasonAndExitCodeOne) {
  const Folder folder;
  const RigConfig rig = rig_on_free_ports("&recv_buf_size=4194304");
  write_text_atomically(folder / "rig.toml", to_toml(rig));
  std::vector<std::string> argv = command(folder / "c", {"--config", folder / "rig.toml"}, "2");
  argv[0] = std::string(IMRIG_BIN_DIR) + "/imrig";
  ChildProcess campaign({"imrig", argv, folder / "campaign.log"});
  ASSERT_TRUE(test::wait_until(
      [&] { return has_journal(folder / "c") && read_journal(folder / "c").done.size() >= 3; }, 120));
  const auto estop = run({"imrig", "estop", "--config", folder / "rig.toml"});
  EXPECT_EQ(estop.exit_code, 0) << estop.err << read_text(folder / "campaign.log");
  ASSERT_TRUE(test::wait_until([&] { return !campaign.running(); }, 120));
  EXPECT_EQ(campaign.exit_code(), 1) << read_text(folder / "campaign.log");
  EXPECT_THAT(campaign.last_words(), HasSubstr("emergency stop"));
  EXPECT_THAT(read_text(journal_path(folder / "c")), HasSubstr("emergency stop"));
}

// A rig's configuration that knows of more than three times the motor's leakage sees no trip coming.
TEST(CampaignRun, TripThatThePlanAllowsCostsItsPointAndNoMore) {
  const Folder folder;
  RigConfig rig = rig_on_free_ports("&recv_buf_size=4194304");
  rig.limits.device_watchdog_ms = 1500;
  rig.limits.link_silence_ms = rig.limits.lease_ms = 3000;
  rig.motor.L_l_H = 0.02;
  rig.limits.current_A = 25.0;
  write_text_atomically(folder / "rig.toml", to_toml(rig));
  const std::string points =
      "[[point]]\nid = \"start\"\nkind = \"startup\"\nfrequency_Hz = 60\nvoltage_percent = 40\n"
      "[[point]]\nid = \"idle\"\nkind = \"steady\"\nfrequency_Hz = 40\nvoltage_percent = 50\n";
  const auto taken = [&](const std::string& name, int allowed) {
    const std::string limits = "[limits]\ntrips_allowed = " + std::to_string(allowed) + "\n";
    write_text_atomically(folder / (name + ".toml"), "version = 1\nname = \"trips\"\n" + limits + points);
    const auto outcome = run({"imrig", "campaign", "run", folder / (name + ".toml"), "--config", folder / "rig.toml",
                              "--emulate", source("models/plants/proca_5hp.toml"), "--pace", "max", "--out",
                              folder / name, "--json"});
    EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
    return json::parse(outcome.out);
  };
  const json none = taken("none", 0), one = taken("one", 1);
  EXPECT_EQ(none.at("end"), "tripped");
  EXPECT_EQ(none.at("points_done"), 0);
  EXPECT_EQ(one.at("end"), "failed") << "a point is missing";
  EXPECT_EQ(one.at("points_tripped"), 1);
  EXPECT_EQ(one.at("points_done"), 1);
  EXPECT_EQ(journalled(folder / "one", "point"), std::multiset<std::string>{"idle"});
}

TEST(CampaignRun, ChangedPlanIsNotResumed) {
  const Folder folder;
  write_text_atomically(folder / "plan.toml",
                        "version = 1\nname = \"d\"\n[dc]\nlevels_A = [5]\nsettle_s = 0.1\nrecord_s = 0.06\n");
  const std::vector<std::string> argv = {"imrig",     "campaign",
                                         "run",       folder / "plan.toml",
                                         "--emulate", source("models/plants/proca_5hp.toml"),
                                         "--pace",    "max",
                                         "--out",     folder / "c"};
  ASSERT_EQ(run(argv).exit_code, 0);
  write_text_atomically(folder / "plan.toml",
                        "version = 1\nname = \"d\"\n[dc]\nlevels_A = [6]\nsettle_s = 0.1\nrecord_s = 0.06\n");
  auto resumed = argv;
  resumed.push_back("--resume");
  const auto outcome = run(resumed);
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("the plan has changed"));
}

TEST(CampaignRun, BadInputLeavesNothingBehind) {
  const Folder folder;
  const auto bad_pace =
      run({"imrig", "campaign", "run", source("campaigns/dc.toml"), "--emulate",
           source("models/plants/proca_5hp.toml"), "--pace", "warp", "--out", folder / "c"});
  EXPECT_EQ(bad_pace.exit_code, 2);
  EXPECT_THAT(bad_pace.err, HasSubstr("warp"));
  const auto no_journal = run(command(folder / "c", {"--resume"}));
  EXPECT_EQ(no_journal.exit_code, 2);
  EXPECT_THAT(no_journal.err, HasSubstr("no journal"));
  EXPECT_THAT(folder.names(), ::testing::IsEmpty());
}

TEST(CampaignRun, WithoutARigItSaysSoAndLeavesNothingBehind) {
  const Folder folder;
  RigConfig rig;
  rig.bus.url = "udpm://239.255.76.77:" + std::to_string(test::free_udp_port()) + "?ttl=0";
  write_text_atomically(folder / "rig.toml", to_toml(rig));
  const auto outcome = run({"imrig", "campaign", "run", source("campaigns/dc.toml"), "--config",
                            folder / "rig.toml", "--out", folder / "c"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("imrig up"));
  EXPECT_THAT(folder.names(), ::testing::ElementsAre("rig.toml"));
}

TEST(CampaignCheck, ListsEveryPointOfThePaperGridWithItsReason) {
  const auto outcome = run({"imrig", "campaign", "check", source("campaigns/proca_grid.toml"), "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const json result = json::parse(outcome.out);
  EXPECT_EQ(result.at("points").size(), 484u);
  EXPECT_EQ(result.at("feasible").get<int>() + result.at("infeasible").get<int>(), 484);
  for (const json& p : result.at("points"))
    EXPECT_EQ(p.at("feasible").get<bool>(), p.at("why").get<std::string>().empty());
}

TEST(Up, StartsTheRigRunsACampaignOnItAndStops) {
  const Folder folder;
  const std::string imrig = std::string(IMRIG_BIN_DIR) + "/imrig";
  ChildProcess up({"imrig",
                   {imrig, "up", "--emulate", source("models/plants/proca_5hp.toml"), "--pace", "max",
                    "--out", folder / "up"},
                   folder / "up.log"});
  ASSERT_TRUE(test::wait_until([&] {
    return read_text(folder / "up.log").find("up; other commands") != std::string::npos || !up.running();
  }));
  ASSERT_TRUE(up.running()) << read_text(folder / "up.log");
  const std::vector<pid_t> others = test::descendants(up.pid());
  const auto campaign = run({"imrig", "campaign", "run", source("campaigns/dc.toml"), "--config",
                             folder / "up/rig.toml", "--out", folder / "c"});
  EXPECT_EQ(campaign.exit_code, 0) << campaign.out << campaign.err;
  ::kill(up.pid(), SIGINT);
  ASSERT_TRUE(test::wait_until([&] { return !up.running(); }));
  EXPECT_EQ(up.exit_code(), 0) << read_text(folder / "up.log");
  EXPECT_TRUE(test::wait_until([&] { return std::none_of(others.begin(), others.end(), test::alive); }));
  EXPECT_EQ(read_campaign_folder(folder / "c").records.size(), 8u);
}

TEST(Up, DeadProcessStopsTheRigWithExitCodeOne) {
  const Folder folder;
  ChildProcess up({"imrig",
                   {std::string(IMRIG_BIN_DIR) + "/imrig", "up", "--emulate",
                    source("models/plants/proca_5hp.toml"), "--out", folder / "up"},
                   folder / "up.log"});
  ASSERT_TRUE(test::wait_until([&] {
    return read_text(folder / "up.log").find("up; other commands") != std::string::npos || !up.running();
  }));
  const std::vector<pid_t> others = test::descendants(up.pid());
  for (const pid_t pid : others) {
    std::ifstream name("/proc/" + std::to_string(pid) + "/comm");
    std::string word;
    std::getline(name, word);
    if (word == "imrig-estimator") ::kill(pid, SIGKILL);
  }
  ASSERT_TRUE(test::wait_until([&] { return !up.running(); }));
  EXPECT_EQ(up.exit_code(), 1);
  EXPECT_THAT(read_text(folder / "up.log"), HasSubstr("imrig-estimator ended"));
  EXPECT_TRUE(test::wait_until([&] { return std::none_of(others.begin(), others.end(), test::alive); }));
}

TEST(Up, AbsentHardwareIsAWarningAndTheRigIsDegraded) {
  const Folder folder;
  const RigConfig rig = rig_on_free_ports();
  write_text_atomically(folder / "rig.toml", to_toml(rig));
  ChildProcess up(
      {"imrig",
       {std::string(IMRIG_BIN_DIR) + "/imrig", "up", "--config", folder / "rig.toml", "--out", folder / "up"},
       folder / "up.log"});
  EXPECT_TRUE(test::wait_until([&] {
    const std::string log = read_text(folder / "up.log");
    return log.find("no DSP answers") != std::string::npos &&
           log.find("no excitation supply answers") != std::string::npos;
  })) << read_text(folder / "up.log");
  EXPECT_TRUE(up.running());
  EXPECT_TRUE(up.stop(30000));
  EXPECT_EQ(up.exit_code(), 0);
}

}  // namespace
}  // namespace imrig
