#include "rig/campaign/runner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "rig/bus/channels.h"
#include "rig/safety/command_result.h"
#include "rig/safety/trip.h"
#include "tests/rig/campaign/predictors.h"
#include "tests/rig/campaign/scripted_rig.h"

namespace imrig {
namespace {

using namespace imrig_msg;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr char kPlan[] =
    "version = 1\nname = \"small\"\n[dc]\nlevels_A = [5]\nsettle_s = 0.1\nrecord_s = 0.06\n"
    "[grid]\nfrequencies_Hz = [40]\nvoltages_percent = [50, 80]\nloads = 2\nsettle_s = 0.1\nsettle_bound_s = "
    "0.5\nbefore_s = 0.03\nrecord_s = 0.09\n";
constexpr int kPoints = 5;

// A runner and a scripted rig on one memory bus, in simulated time.
class RunnerTest : public ::testing::Test {
 protected:
  RunnerTest() : hub_(make_memory_hub()), rig_(hub_), bus_(open_memory_bus(hub_)) {}

  RunnerConfig config(int trips_allowed = 0) {
    RunnerConfig c;
    c.plan = parse_plan(kPlan, "plan");
    c.plan.limits.trips_allowed = trips_allowed;
    c.points = order_points(travel_of(c.plan, c.rig, 60e-6),
                            check_points(c.plan, c.rig, test::circuit(c.rig.motor)));
    c.points_total = static_cast<int>(c.points.size());
    c.holder = 77;
    c.config_hash = 5;
    return c;
  }

  template <class Message>
  void feed(const char* name, Runner& runner) {
    subscribe<Message>(*bus_, name, [&](const Message& m) { runner.on(m, now_); });
  }

  // Runs to the end, or to the limit of simulated seconds.
  RunnerEnd run(Runner& runner, double limit_s = 120.0, const std::function<void(Runner&)>& each = {}) {
    return run(runner, rig_, limit_s, each);
  }
  RunnerEnd run(Runner& runner, test::ScriptedRig& rig, double limit_s = 120.0,
                const std::function<void(Runner&)>& each = {}) {
    feed<bridge_status_t>(channel::kBridgeStatus, runner);
    feed<dyno_status_t>(channel::kDynoStatus, runner);
    feed<samples_t>(channel::kSamples, runner);
    feed<estimate_t>(channel::kEstimate, runner);
    feed<lease_t>(channel::kBridgeLease, runner);
    feed<lease_t>(channel::kDynoLease, runner);
    feed<ack_t>(channel::kAck, runner);
    for (double t = 0; t < limit_s && runner.end() == RunnerEnd::kRunning; t += 0.005) {
      now_.steady_us += 5000;
      now_.wall_us += 5000;
      rig.tick(now_);
      bus_->wait(0);
      if (each) each(runner);
      for (const RunnerOutput& output : runner.step(now_)) take(output);
    }
    rig.tick(now_);
    return runner.end();
  }

  void take(const RunnerOutput& output) {
    std::visit(
        [this](const auto& m) {
          using M = std::decay_t<decltype(m)>;
          if constexpr (std::is_same_v<M, RunnerEvent>) events_.push_back(m);
          if constexpr (std::is_same_v<M, bridge_cmd_t>) publish(*bus_, channel::kBridgeCmd, m);
          if constexpr (std::is_same_v<M, dyno_cmd_t>) publish(*bus_, channel::kDynoCmd, m);
          if constexpr (std::is_same_v<M, lease_cmd_t>) publish(*bus_, channel::kLeaseCmd, m);
          if constexpr (std::is_same_v<M, record_t>) publish(*bus_, channel::kRecord, m);
          if constexpr (std::is_same_v<M, dataset_t>) publish(*bus_, channel::kDataset, m);
          if constexpr (std::is_same_v<M, ack_t>) publish(*bus_, channel::kAck, m);
          if constexpr (std::is_same_v<M, campaign_status_t>) publish(*bus_, channel::kCampaignStatus, m);
        },
        output);
  }

  int count(RunnerEvent::Kind kind) const {
    return static_cast<int>(
        std::count_if(events_.begin(), events_.end(), [&](const auto& e) { return e.kind == kind; }));
  }

  // Of the records that ended complete, in order.
  std::vector<record_t> complete() const {
    std::vector<record_t> found;
    for (const record_t& r : rig_.records)
      if (r.phase == record_t::END && r.status == record_t::COMPLETE) found.push_back(r);
    return found;
  }

  void expect_rig_at_rest() {
    EXPECT_FALSE(rig_.driven());
    EXPECT_FALSE(rig_.load_on());
  }

  Moment now_ = {1'000'000'000, 1'800'000'000'000'000};
  std::shared_ptr<MemoryHub> hub_;
  test::ScriptedRig rig_;
  std::unique_ptr<Bus> bus_;
  std::vector<RunnerEvent> events_;
};

TEST_F(RunnerTest, TakesEveryPointOnceAndLeavesTheRigAtRest) {
  Runner runner(config());
  ASSERT_EQ(run(runner), RunnerEnd::kDone) << runner.end_reason();
  EXPECT_EQ(runner.tally().done, kPoints);
  EXPECT_EQ(count(RunnerEvent::kPointDone), kPoints);
  EXPECT_EQ(count(RunnerEvent::kPointRetried), 0);
  EXPECT_EQ(rig_.datasets, 1);
  EXPECT_EQ(rig_.last_campaign_state, campaign_status_t::DONE);
  EXPECT_GT(rig_.acks, 10);
  std::set<std::string> ids;
  for (const record_t& r : complete()) {
    EXPECT_TRUE(ids.insert(r.id).second);
    EXPECT_EQ(r.samples, rig_.record_samples.at(r.number)) << r.id;
    EXPECT_EQ(r.config_hash, 5);
    EXPECT_EQ(r.campaign, "small");
  }
  EXPECT_EQ(ids.size(), static_cast<std::size_t>(kPoints));
  expect_rig_at_rest();
}

TEST_F(RunnerTest, InverterSeesNoJumpButTheSteps) {
  Runner runner(config());
  ASSERT_EQ(run(runner), RunnerEnd::kDone) << runner.end_reason();
  EXPECT_LT(rig_.most_frequency_step_Hz, 1e-9);
  EXPECT_NEAR(rig_.most_voltage_ratio, 1.1, 1e-9);
}

TEST_F(RunnerTest, RecordsBeginBeforeTheirSamplesAndCarryTheirSetPoints) {
  Runner runner(config());
  ASSERT_EQ(run(runner), RunnerEnd::kDone);
  ASSERT_EQ(rig_.records.size(), 2u * kPoints);
  for (std::size_t k = 0; k < rig_.records.size(); k += 2) {
    EXPECT_EQ(rig_.records[k].phase, record_t::BEGIN);
    EXPECT_EQ(rig_.records[k + 1].phase, record_t::END);
    EXPECT_EQ(rig_.records[k].number, rig_.records[k + 1].number);
  }
  EXPECT_TRUE(std::isnan(rig_.records[0].set_frequency_Hz));  // dc
  const record_t& step = rig_.records.back();
  EXPECT_EQ(step.kind, "step");
  EXPECT_EQ(step.set_frequency_Hz, 40);
  EXPECT_EQ(step.set_step, 0.1);
  EXPECT_EQ(step.pole_pairs, 2);
}

TEST_F(RunnerTest, WithoutAnEstimatorTheBoundDecides) {
  rig_.faults.estimator_runs = false;
  Runner runner(config());
  EXPECT_EQ(run(runner), RunnerEnd::kDone) << runner.end_reason();
}

TEST_F(RunnerTest, RecordWithALostBlockIsAbortedAndRunAgain) {
  rig_.faults.lose_blocks_of_record[3] = 1;
  Runner runner(config());
  ASSERT_EQ(run(runner), RunnerEnd::kDone) << runner.end_reason();
  EXPECT_EQ(count(RunnerEvent::kPointRetried), 1);
  EXPECT_EQ(complete().size(), static_cast<std::size_t>(kPoints));
  const auto aborted = std::find_if(rig_.records.begin(), rig_.records.end(), [](const record_t& r) {
    return r.phase == record_t::END && r.status == record_t::ABORTED;
  });
  ASSERT_NE(aborted, rig_.records.end());
  EXPECT_EQ(aborted->number, 3);
  EXPECT_EQ(std::next(aborted)->id, aborted->id) << "run again at once";
  EXPECT_EQ(std::next(aborted)->number, 4) << "under a number of its own";
  EXPECT_EQ(runner.lost_blocks(), 1);
}

TEST_F(RunnerTest, PointThatAlwaysLosesSamplesIsGivenUpAndTheOthersAreTaken) {
  for (const int number : {2, 3, 4}) rig_.faults.lose_blocks_of_record[number] = 1;
  Runner runner(config());
  EXPECT_EQ(run(runner), RunnerEnd::kFailed);
  EXPECT_EQ(count(RunnerEvent::kPointRetried), 2);
  EXPECT_EQ(count(RunnerEvent::kPointFailed), 1);
  EXPECT_EQ(runner.tally().done, kPoints - 1);
  EXPECT_THAT(runner.end_reason(), HasSubstr("1 of 5 points"));
  expect_rig_at_rest();
}

TEST_F(RunnerTest, ThreePointsThatFailInARowEndTheCampaign) {
  for (int number = 1; number < 40; ++number) rig_.faults.lose_blocks_of_record[number] = 1;
  Runner runner(config());
  EXPECT_EQ(run(runner), RunnerEnd::kFailed);
  EXPECT_EQ(count(RunnerEvent::kPointFailed), 3);
  EXPECT_THAT(runner.end_reason(), HasSubstr("in a row"));
  expect_rig_at_rest();
}

TEST_F(RunnerTest, BusyBridgeIsAskedAgain) {
  rig_.faults.refuse_uploads[static_cast<int>(CommandResult::kBusy)] = 3;
  rig_.faults.refuse_starts[static_cast<int>(CommandResult::kStale)] = 2;
  Runner runner(config());
  EXPECT_EQ(run(runner), RunnerEnd::kDone) << runner.end_reason();
  EXPECT_EQ(count(RunnerEvent::kPointRetried), 0);
}

TEST_F(RunnerTest, RefusedProfileFailsTheAttemptWithTheReason) {
  rig_.faults.refuse_uploads[static_cast<int>(CommandResult::kOverLimit)] = 1;
  Runner runner(config());
  EXPECT_EQ(run(runner), RunnerEnd::kDone) << runner.end_reason();
  ASSERT_EQ(count(RunnerEvent::kPointRetried), 1);
  const auto event = std::find_if(events_.begin(), events_.end(),
                                  [](const auto& e) { return e.kind == RunnerEvent::kPointRetried; });
  EXPECT_THAT(event->text, HasSubstr("over a limit"));
}

TEST_F(RunnerTest, DeviceRefusalIsToldWithItsCode) {
  rig_.faults.refuse_starts[106] = 40;
  Runner runner(config());
  EXPECT_EQ(run(runner), RunnerEnd::kFailed);
  EXPECT_THAT(runner.end_reason(), HasSubstr("code 6"));
  expect_rig_at_rest();
}

TEST_F(RunnerTest, TripEndsTheCampaignWithItsName) {
  rig_.faults.trip_in_record = 2;
  rig_.faults.trip = static_cast<std::int32_t>(Trip::kOverCurrent);
  Runner runner(config());
  EXPECT_EQ(run(runner), RunnerEnd::kTripped);
  EXPECT_THAT(runner.end_reason(), HasSubstr("over-current"));
  EXPECT_EQ(runner.tally().done, 1);
  ASSERT_FALSE(rig_.records.empty());
  EXPECT_EQ(rig_.records.back().status, record_t::ABORTED);
  EXPECT_EQ(events_.back().kind, RunnerEvent::kEnded);
  expect_rig_at_rest();
}

TEST_F(RunnerTest, TripThatThePlanAllowsCostsItsPointAndNoMore) {
  rig_.faults.trip_in_record = 3;
  rig_.faults.trip = static_cast<std::int32_t>(Trip::kDeviceOverCurrent);
  Runner runner(config(1));
  EXPECT_EQ(run(runner), RunnerEnd::kFailed);
  EXPECT_EQ(runner.end_reason(), "1 of 5 points could not be taken: 1 because the device tripped");
  EXPECT_EQ(runner.tally().done, kPoints - 1);
  EXPECT_EQ(runner.tally().tripped, 1);
  EXPECT_EQ(rig_.resets, 1);
  EXPECT_EQ(count(RunnerEvent::kPointRetried), 0);
  const auto event = std::find_if(events_.begin(), events_.end(),
                                  [](const auto& e) { return e.kind == RunnerEvent::kPointFailed; });
  EXPECT_THAT(event->text, HasSubstr("over-current"));
  expect_rig_at_rest();
}

TEST_F(RunnerTest, MoreTripsThanThePlanAllowsEndTheCampaign) {
  rig_.faults.trip_in_every_record_from = 2;
  rig_.faults.trip = static_cast<std::int32_t>(Trip::kDeviceOverCurrent);
  Runner runner(config(2));
  EXPECT_EQ(run(runner), RunnerEnd::kTripped);
  EXPECT_THAT(runner.end_reason(), HasSubstr("over-current"));
  EXPECT_EQ(rig_.resets, 2);
  EXPECT_EQ(count(RunnerEvent::kPointFailed), 2);
  expect_rig_at_rest();
}

TEST_F(RunnerTest, NoOtherTripIsEverReset) {
  for (const Trip trip :
       {Trip::kOperatorStop, Trip::kOverSpeed, Trip::kOverTemperature, Trip::kLinkSilent, Trip::kPeerTripped,
        Trip::kDeviceOverSpeed, Trip::kDeviceOverTemperature, Trip::kDeviceWatchdog, Trip::kDeviceOrdered}) {
    hub_ = make_memory_hub();
    test::ScriptedRig rig(hub_);
    rig.faults.trip_in_record = 2;
    rig.faults.trip = static_cast<std::int32_t>(trip);
    bus_ = open_memory_bus(hub_);
    Runner runner(config(5));
    EXPECT_EQ(run(runner, rig), RunnerEnd::kTripped) << trip_name(trip);
    EXPECT_EQ(rig.resets, 0) << trip_name(trip);
  }
}

TEST_F(RunnerTest, EmergencyStopWhileATripStandsEndsTheCampaign) {
  rig_.faults.trip_in_record = 2;
  rig_.faults.trip = static_cast<std::int32_t>(Trip::kDeviceOverCurrent);
  Runner runner(config(5));
  const auto press = [this](Runner& r) {
    if (r.tally().tripped == 1) r.on(estop_cmd_t{}, now_);
  };
  EXPECT_EQ(run(runner, 120.0, press), RunnerEnd::kTripped);
  EXPECT_THAT(runner.end_reason(), HasSubstr("emergency stop"));
  EXPECT_EQ(rig_.resets, 0);
}

TEST_F(RunnerTest, ResetThatIsRefusedEndsTheCampaign) {
  rig_.faults.trip_in_record = 2;
  rig_.faults.trip = static_cast<std::int32_t>(Trip::kDeviceOverCurrent);
  rig_.faults.refuses_resets = true;
  Runner runner(config(5));
  EXPECT_EQ(run(runner), RunnerEnd::kTripped);
  EXPECT_THAT(runner.end_reason(), HasSubstr("reset: "));
  EXPECT_EQ(runner.tally().done, 1);
}

TEST_F(RunnerTest, LoadIsOffWhenTheFieldsCurrentIsNotWhenTheSetPointIs) {
  rig_.faults.field_lag_s = 1.5;
  Runner runner(config());
  ASSERT_EQ(run(runner), RunnerEnd::kDone) << runner.end_reason();
  EXPECT_EQ(rig_.most_readback_when_moved_A, 0.0);
}

TEST_F(RunnerTest, StandingTripIsNotIgnored) {
  rig_.faults.standing_trip = static_cast<std::int32_t>(Trip::kOperatorStop);
  Runner runner(config());
  EXPECT_EQ(run(runner), RunnerEnd::kFailed);
  EXPECT_THAT(runner.end_reason(), HasSubstr("imrig reset"));
  EXPECT_THAT(rig_.records, IsEmpty());
}

TEST_F(RunnerTest, LostDynoCommandIsSentAgain) {
  rig_.faults.ignore_dyno_commands = 2;
  Runner runner(config());
  EXPECT_EQ(run(runner), RunnerEnd::kDone) << runner.end_reason();
}

TEST_F(RunnerTest, DeadDynoEndsTheCampaignAndStopsTheMotor) {
  rig_.faults.dyno_silent_after_set = true;
  Runner runner(config());
  EXPECT_EQ(run(runner), RunnerEnd::kFailed);
  EXPECT_THAT(runner.end_reason(), HasSubstr("imrig-dyno is silent"));
  EXPECT_FALSE(rig_.driven());
}

TEST_F(RunnerTest, DeadBridgeEndsTheCampaignAndTakesTheLoadOff) {
  rig_.faults.bridge_silent_in_record = true;
  Runner runner(config());
  EXPECT_EQ(run(runner), RunnerEnd::kFailed);
  EXPECT_THAT(runner.end_reason(), HasSubstr("imrig-bridge is silent"));
  EXPECT_EQ(rig_.records.back().status, record_t::ABORTED);
  EXPECT_FALSE(rig_.load_on());
}

TEST_F(RunnerTest, RebootedDspEndsTheCampaign) {
  rig_.faults.reboots_in_record = true;
  Runner runner(config());
  EXPECT_EQ(run(runner), RunnerEnd::kFailed);
  EXPECT_THAT(runner.end_reason(), HasSubstr("restarted"));
}

TEST_F(RunnerTest, PointIsNotDoneBeforeTheRecorderHasItOnDisk) {
  rig_.faults.recorder_confirms = false;
  Runner runner(config());
  EXPECT_EQ(run(runner), RunnerEnd::kFailed);
  EXPECT_THAT(runner.end_reason(), HasSubstr("does not confirm"));
  EXPECT_EQ(runner.tally().done, 0);
  EXPECT_EQ(count(RunnerEvent::kPointDone), 0);
  expect_rig_at_rest();
}

TEST_F(RunnerTest, MissingPartsOfTheRigAreToldByName) {
  rig_.faults.recorder_speaks = false;
  Runner no_recorder(config());
  EXPECT_EQ(run(no_recorder), RunnerEnd::kFailed);
  EXPECT_THAT(no_recorder.end_reason(), HasSubstr("imrig-recorder"));
  rig_.faults.dsp_absent = true;
  Runner no_dsp(config());
  EXPECT_EQ(run(no_dsp), RunnerEnd::kFailed);
  EXPECT_THAT(no_dsp.end_reason(), HasSubstr("no DSP"));
}

TEST_F(RunnerTest, AnotherRecordersWordDoesNotCount) {
  RunnerConfig c = config();
  c.recorder_pid = 99;
  Runner runner(c);
  EXPECT_EQ(run(runner), RunnerEnd::kFailed);
  EXPECT_THAT(runner.end_reason(), HasSubstr("imrig-recorder"));
}

TEST_F(RunnerTest, TakenLeaseIsTold) {
  rig_.faults.lease_taken = true;
  Runner runner(config());
  EXPECT_EQ(run(runner), RunnerEnd::kFailed);
  EXPECT_THAT(runner.end_reason(), HasSubstr("somebody else"));
}

TEST_F(RunnerTest, StalledMotorIsStoppedAndItsPointsAreGivenUpWithoutAnotherTry) {
  rig_.faults.stalls = true;
  Runner runner(config());
  EXPECT_EQ(run(runner), RunnerEnd::kFailed);
  EXPECT_EQ(runner.end_reason(), "4 of 5 points could not be taken: 4 because the motor stalled");
  EXPECT_EQ(count(RunnerEvent::kPointRetried), 0);
  EXPECT_EQ(count(RunnerEvent::kPointFailed), 4);
  EXPECT_THAT(events_[events_.size() - 2].text, HasSubstr("stalled"));
  EXPECT_EQ(runner.tally().done, 1);  // dc
  expect_rig_at_rest();
}

TEST_F(RunnerTest, MotorThatSlipsAwayBehindARecordIsStoppedBeforeItsVoltageRises) {
  rig_.faults.stalls_when_unloaded = true;
  Runner runner(config());
  ASSERT_EQ(run(runner), RunnerEnd::kDone) << runner.end_reason();
  EXPECT_FALSE(rig_.faults.stalls_when_unloaded) << "it did stall";
  EXPECT_EQ(rig_.starts_while_stalled, 0);
  const auto event = std::find_if(events_.begin(), events_.end(),
                                  [](const auto& e) { return e.kind == RunnerEvent::kPointRetried; });
  ASSERT_NE(event, events_.end()) << "the next point is tried again, from rest";
  EXPECT_THAT(event->text, HasSubstr("at the point before"));
  expect_rig_at_rest();
}

TEST_F(RunnerTest, OperatorsStopIsSafeAtAnyMoment) {
  for (const int at_ms : {5, 30, 60, 100, 150, 205, 300, 430, 600, 785, 1000, 1200, 1400}) {
    hub_ = make_memory_hub();
    test::ScriptedRig rig(hub_);
    bus_ = open_memory_bus(hub_);
    events_.clear();
    Runner runner(config());
    feed<bridge_status_t>(channel::kBridgeStatus, runner);
    feed<dyno_status_t>(channel::kDynoStatus, runner);
    feed<samples_t>(channel::kSamples, runner);
    feed<lease_t>(channel::kBridgeLease, runner);
    feed<lease_t>(channel::kDynoLease, runner);
    feed<ack_t>(channel::kAck, runner);
    for (int t_ms = 0; t_ms < 60000 && runner.end() == RunnerEnd::kRunning; t_ms += 5) {
      now_.steady_us += 5000;
      now_.wall_us += 5000;
      rig.tick(now_);
      bus_->wait(0);
      if (t_ms == at_ms) runner.request_stop("stopped by the operator");
      for (const RunnerOutput& output : runner.step(now_)) take(output);
    }
    rig.tick(now_);
    EXPECT_EQ(runner.end(), RunnerEnd::kStopped) << at_ms;
    EXPECT_FALSE(rig.driven()) << at_ms;
    EXPECT_FALSE(rig.load_on()) << at_ms;
    std::set<int> open;
    for (const record_t& r : rig.records) {
      if (r.phase == record_t::BEGIN) open.insert(r.number);
      if (r.phase == record_t::END) open.erase(r.number);
    }
    EXPECT_THAT(open, IsEmpty()) << "a record without an end at " << at_ms;
  }
}

}  // namespace
}  // namespace imrig
