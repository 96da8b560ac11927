#include "rig/safety/stop_machine.h"

#include <gtest/gtest.h>

#include <functional>
#include <random>
#include <string>
#include <vector>

namespace imrig {
namespace {

constexpr StopState kIdle = StopState::kIdle, kRunning = StopState::kRunning, kHolding = StopState::kHolding,
                    kStopping = StopState::kStopping, kTripped = StopState::kTripped;

StopMachine machine_in(StopState state) {
  StopMachine m;
  if (state == kRunning || state == kHolding || state == kStopping) m.start();
  if (state == kHolding) m.held();
  if (state == kStopping) m.stop();
  if (state == kTripped) m.trip(Trip::kOverSpeed);
  return m;
}

struct Event {
  std::string name;
  std::function<bool(StopMachine&)> fire;
};

const std::vector<Event>& events() {
  static const std::vector<Event> all = {
      {"start", [](StopMachine& m) { return m.start(); }},
      {"held", [](StopMachine& m) { return m.held(); }},
      {"stop", [](StopMachine& m) { return m.stop(); }},
      {"gates_off", [](StopMachine& m) { return m.gates_off(); }},
      {"trip", [](StopMachine& m) { return m.trip(Trip::kOverCurrent); }},
      {"trip without a cause", [](StopMachine& m) { return m.trip(Trip::kNone); }},
      {"reset", [](StopMachine& m) { return m.reset(true, true); }},
      {"reset, cause still there", [](StopMachine& m) { return m.reset(false, true); }},
      {"reset, gates perhaps on", [](StopMachine& m) { return m.reset(true, false); }},
  };
  return all;
}

TEST(StopMachine, EveryEventInEveryStateLeadsWhereTheTableSays) {
  // rows: events in the order above; columns: idle, running, holding, stopping, tripped
  const StopState table[][5] = {
      {kRunning, kRunning, kRunning, kStopping, kTripped},  // start
      {kIdle, kHolding, kHolding, kStopping, kTripped},     // held
      {kIdle, kStopping, kStopping, kStopping, kTripped},   // stop
      {kIdle, kIdle, kIdle, kIdle, kTripped},               // gates_off
      {kTripped, kTripped, kTripped, kTripped, kTripped},   // trip
      {kIdle, kRunning, kHolding, kStopping, kTripped},     // trip without a cause
      {kIdle, kRunning, kHolding, kStopping, kIdle},        // reset
      {kIdle, kRunning, kHolding, kStopping, kTripped},     // reset, cause still there
      {kIdle, kRunning, kHolding, kStopping, kTripped},     // reset, gates perhaps on
  };
  const bool taken[][5] = {
      {true, false, true, false, false},    // start
      {false, true, false, false, false},   // held
      {false, true, true, false, false},    // stop
      {false, true, true, true, false},     // gates_off
      {true, true, true, true, false},      // trip
      {false, false, false, false, false},  // trip without a cause
      {false, false, false, false, true},   // reset
      {false, false, false, false, false},  // reset, cause still there
      {false, false, false, false, false},  // reset, gates perhaps on
  };
  const StopState states[] = {kIdle, kRunning, kHolding, kStopping, kTripped};
  ASSERT_EQ(std::size(table), events().size());
  for (std::size_t e = 0; e < events().size(); ++e) {
    for (std::size_t s = 0; s < 5; ++s) {
      StopMachine m = machine_in(states[s]);
      ASSERT_EQ(m.state(), states[s]);
      EXPECT_EQ(events()[e].fire(m), taken[e][s]) << events()[e].name << " in state " << s;
      EXPECT_EQ(m.state(), table[e][s]) << events()[e].name << " in state " << s;
    }
  }
}

TEST(StopMachine, FirstCauseStaysUntilTheReset) {
  StopMachine m;
  m.trip(Trip::kOverSpeed);
  EXPECT_FALSE(m.trip(Trip::kOverCurrent));
  EXPECT_EQ(m.cause(), Trip::kOverSpeed);
  EXPECT_TRUE(m.reset(true, true));
  EXPECT_EQ(m.cause(), Trip::kNone);
  m.trip(Trip::kOverCurrent);
  EXPECT_EQ(m.cause(), Trip::kOverCurrent);
}

// The machine beside a device that does what it is told, at once or never: gates switch only where
// may_drive() allows it.
TEST(StopMachine, NoSequenceOfEventsLeavesTheGatesOnInATrippedState) {
  std::mt19937_64 random(20260101);
  for (int run = 0; run < 200; ++run) {
    StopMachine m;
    Trip first = Trip::kNone;
    for (int step = 0; step < 500; ++step) {
      const Event& event = events()[random() % events().size()];
      const StopState before = m.state();
      event.fire(m);
      if (before != kTripped && m.state() == kTripped) first = m.cause();
      if (m.state() == kTripped) {
        ASSERT_FALSE(m.may_drive()) << "after " << event.name;
        ASSERT_NE(m.cause(), Trip::kNone);
        ASSERT_EQ(m.cause(), first);
      } else {
        ASSERT_EQ(m.cause(), Trip::kNone);
      }
      if (before == kTripped && m.state() != kTripped) {
        ASSERT_EQ(event.name, "reset");
        ASSERT_EQ(m.state(), kIdle) << "a reset must not resume";
      }
      if (m.may_drive() && (before == kIdle || before == kTripped)) {
        ASSERT_EQ(event.name, "start");
      }
    }
  }
}

}  // namespace
}  // namespace imrig
