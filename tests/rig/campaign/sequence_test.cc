#include "rig/campaign/sequence.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "tests/rig/campaign/predictors.h"

namespace imrig {
namespace {

using imrig_msg::segment_t;

Plan plan_of(const std::string& text) { return parse_plan("version = 1\nname = \"p\"\n" + text, "p"); }

const std::string kGrid =
    "[dc]\nlevels_A = [5]\n[standstill]\n[startup]\nfrequencies_Hz = [30]\nvoltages_percent = [15]\n"
    "[no_load]\nfrequencies_Hz = [40]\nvoltages_percent = [80]\n[steady]\nfrequencies_Hz = "
    "[60]\nvoltages_percent = [80]\nloads = 2\n"
    "[grid]\nfrequencies_Hz = [30, 50, 80]\nvoltages_percent = [20, 60, 100]\nloads = 3\n"
    "[coast_down]\nfrequencies_Hz = [60]\nvoltages_percent = [100]\n";

struct Prepared {
  Travel travel;
  std::vector<CheckedPoint> points;
};

Prepared prepare(const std::string& text, RigConfig rig = {}) {
  const Plan plan = plan_of(text);
  Prepared p;
  p.travel = travel_of(plan, rig, 60e-6);
  p.points = order_points(p.travel, check_points(plan, rig, test::circuit(rig.motor)));
  return p;
}

// Everything the inverter is told over a campaign, in order, with the load that is on meanwhile.
struct Told {
  segment_t segment;
  double excitation_A;
  bool records;
  bool after_rest;  // the shaft was seen at rest just before
};

std::vector<Told> whole_campaign(const Prepared& p) {
  std::vector<Told> told;
  Operating here;
  double excitation = 0.0;
  bool rested = false;
  const auto take = [&](const std::vector<Action>& actions) {
    for (const Action& a : actions) {
      if (a.kind == ActionKind::kLoad) excitation = a.excitation_A;
      if (a.kind == ActionKind::kRest) rested = true;
      for (const auto& s : a.profile.segments) {
        told.push_back({s, excitation, a.kind == ActionKind::kRecord, rested});
        rested = false;
      }
    }
  };
  for (const CheckedPoint& point : p.points) {
    take(actions_for(p.travel, point, here, excitation));
    here = operating_after(point);
  }
  take(actions_to_rest(p.travel, here, excitation));
  return told;
}

TEST(Sequence, VoltageAndFrequencyNeverJumpButForTheWantedStep) {
  const Prepared p = prepare(kGrid);
  Operating here;
  int steps = 0;
  for (const Told& t : whole_campaign(p)) {
    if (t.segment.kind != segment_t::VOLTAGE) {
      here = {};
      continue;
    }
    const bool from_rest = here.voltage_V == 0.0 && t.after_rest;
    const bool starts = here.voltage_V == 0.0 && t.records;  // startup record: switched on at once
    if (!from_rest && !starts) {
      EXPECT_NEAR(t.segment.frequency_start_Hz, here.frequency_Hz, 1e-9);
      const double jump = t.segment.amplitude_start_V / here.voltage_V;
      if (std::abs(jump - 1.0) > 1e-9) {
        EXPECT_TRUE(t.records);
        EXPECT_NEAR(jump, 1.1, 1e-9);
        ++steps;
      }
    }
    if (from_rest && !t.records) {
      EXPECT_EQ(t.segment.amplitude_start_V, 0.0);
    }
    here = {t.segment.frequency_end_Hz, t.segment.amplitude_end_V};
  }
  EXPECT_EQ(steps, std::count_if(p.points.begin(), p.points.end(),
                                 [](const auto& c) { return c.point.kind == PointKind::kStep; }));
}

TEST(Sequence, SpeedChangesOnlyWithoutLoadAndNearRatedFlux) {
  const Prepared p = prepare(kGrid);
  int moves = 0;
  for (const Told& t : whole_campaign(p)) {
    if (t.segment.kind != segment_t::VOLTAGE || t.records) continue;
    if (t.segment.frequency_start_Hz == t.segment.frequency_end_Hz) continue;
    ++moves;
    EXPECT_EQ(t.excitation_A, 0.0);
    for (const double share : {0.0, 0.3, 0.7, 1.0}) {
      const double f =
          t.segment.frequency_start_Hz + share * (t.segment.frequency_end_Hz - t.segment.frequency_start_Hz);
      const double v =
          t.segment.amplitude_start_V + share * (t.segment.amplitude_end_V - t.segment.amplitude_start_V);
      EXPECT_NEAR(v, travelling_V(p.travel, f), 1e-6);
    }
  }
  EXPECT_GT(moves, 3);
}

// A voltage that goes down by less than a quarter is no long way, and yet may not carry the load of before.
TEST(Sequence, BetweenTwoPointsTheLoadIsNeverAboveWhatEitherOfThemCarries) {
  const Prepared p = prepare("[grid]\nfrequencies_Hz = [60]\nvoltages_percent = [70, 80, 90]\nloads = 3\n");
  for (const CheckedPoint& first : p.points) {
    for (const CheckedPoint& second : p.points) {
      double excitation = first.excitation_A;
      for (const Action& a : actions_for(p.travel, second, operating_after(first), excitation)) {
        if (a.kind == ActionKind::kLoad) excitation = a.excitation_A;
        if (a.kind != ActionKind::kProfile) continue;
        EXPECT_LE(excitation, first.excitation_A);
        EXPECT_LE(excitation, second.excitation_A) << first.point.id << " to " << second.point.id;
      }
      EXPECT_EQ(excitation, second.excitation_A);
    }
  }
}

TEST(Sequence, RampsKeepTheirRates) {
  const Prepared p = prepare(kGrid);
  for (const Told& t : whole_campaign(p)) {
    if (t.segment.kind != segment_t::VOLTAGE || t.records) continue;
    const double seconds = static_cast<double>(t.segment.duration_samples) * 60e-6;
    EXPECT_LE(std::abs(t.segment.frequency_end_Hz - t.segment.frequency_start_Hz),
              p.travel.frequency_ramp_Hz_per_s * (seconds + 60e-6));
    if (t.segment.frequency_end_Hz == t.segment.frequency_start_Hz &&
        t.segment.amplitude_end_V != t.segment.amplitude_start_V) {
      EXPECT_NEAR(std::abs(t.segment.amplitude_end_V - t.segment.amplitude_start_V),
                  p.travel.voltage_ramp_V_per_s * seconds, p.travel.voltage_ramp_V_per_s * 60e-6);
    }
  }
}

TEST(Sequence, EveryProfileFitsTheDevice) {
  const Prepared p = prepare(kGrid);
  Operating here;
  for (const CheckedPoint& point : p.points) {
    for (const Action& a : actions_for(p.travel, point, here, 0.0)) {
      EXPECT_LE(a.profile.segments.size(), 24u);
      for (const auto& s : a.profile.segments) {
        EXPECT_GE(s.duration_samples, 1);
        EXPECT_GE(s.amplitude_start_V, 0.0);
        EXPECT_GE(s.amplitude_end_V, 0.0);
      }
    }
    here = operating_after(point);
  }
}

TEST(Sequence, RecordsHaveExactlyTheirSamples) {
  const Prepared p = prepare(
      "[dc]\nlevels_A = [5]\nrecord_s = 0.5\n[standstill]\nrecord_s = 2\n[grid]\nfrequencies_Hz = [50]\n"
      "voltages_percent = [50]\nbefore_s = 0.12\nrecord_s = 0.6\n[coast_down]\nfrequencies_Hz = [50]\n"
      "voltages_percent = [50]\nbefore_s = 0.03\nrecord_s = 3\n[steady]\nfrequencies_Hz = "
      "[50]\nvoltages_percent = [50]\nrecord_s = 0.3\n"
      "[startup]\nfrequencies_Hz = [50]\nvoltages_percent = [15]\nbefore_s = 0.06\nrecord_s = 1.2\n");
  ASSERT_EQ(p.points.size(), 6u);
  const auto samples = [](double seconds) { return std::llround(seconds / 60e-6); };
  for (const CheckedPoint& c : p.points) {
    const Profile profile = record_profile(p.travel, c);
    EXPECT_EQ(profile.recorded_samples(),
              samples(c.point.before_s) * (c.point.before_s > 0) + samples(c.point.record_s))
        << point_kind_word(c.point.kind);
    EXPECT_EQ(profile.segments.back().record, 0) << "the last block of a record must be sent at once";
  }
}

TEST(Sequence, StepRecordHoldsTheBaseThenTheStep) {
  const Prepared p = prepare("[grid]\nfrequencies_Hz = [50]\nvoltages_percent = [50]\nstep_percent = -20\n");
  const Profile profile = record_profile(p.travel, p.points.front());
  ASSERT_EQ(profile.segments.size(), 3u);
  const double base = 0.5 * p.travel.rated_V;
  EXPECT_NEAR(profile.segments[0].amplitude_start_V, base, 1e-9);
  EXPECT_NEAR(profile.segments[0].amplitude_end_V, base, 1e-9);
  EXPECT_NEAR(profile.segments[1].amplitude_start_V, 0.8 * base, 1e-9);
  EXPECT_TRUE(profile.hold_at_end);
}

TEST(Sequence, DcTiesPhasesAAndCAgainstB) {
  const Prepared p = prepare("[dc]\nlevels_A = [7]\n");
  const Profile profile = record_profile(p.travel, p.points.front());
  const segment_t& s = profile.segments[1];
  EXPECT_EQ(s.kind, segment_t::DC);
  EXPECT_EQ(s.plus_phases, 5);
  EXPECT_EQ(s.minus_phases, 2);
  EXPECT_EQ(s.level_A, 7);
  EXPECT_FALSE(profile.hold_at_end);
}

TEST(Sequence, StandstillCurrentPointsBetweenPhasesBAndC) {
  const Prepared p = prepare("[standstill]\n");
  const Profile profile = record_profile(p.travel, p.points.front());
  const segment_t& s = profile.segments[1];
  EXPECT_EQ(s.kind, segment_t::CURRENT);
  EXPECT_NEAR(s.angle_rad, kPi / 2, 1e-12);
  EXPECT_EQ(s.n_tones, 3);
  EXPECT_NEAR(s.tone_Hz[1], 25 / (2 * kPi), 1e-12);
  EXPECT_EQ(s.kp_V_per_A, 1.6);
  EXPECT_EQ(s.ki_V_per_As, 116);
}

TEST(Sequence, OrderHoldsEveryFeasiblePointOnceAndRestingOnesFirst) {
  const Prepared p = prepare(kGrid);
  std::set<std::string> ids;
  bool running = false;
  for (const CheckedPoint& c : p.points) {
    EXPECT_TRUE(ids.insert(c.point.id).second);
    EXPECT_TRUE(c.feasible);
    if (!begins_at_rest(c.point.kind)) running = true;
    EXPECT_FALSE(running && begins_at_rest(c.point.kind)) << c.point.id;
  }
  EXPECT_EQ(p.points.front().point.kind, PointKind::kDc);
  EXPECT_EQ(p.points.back().point.kind, PointKind::kCoastDown);
  const Plan plan = plan_of(kGrid);
  const RigConfig rig;
  const auto all = check_points(plan, rig, test::circuit(rig.motor));
  EXPECT_EQ(static_cast<long>(ids.size()),
            std::count_if(all.begin(), all.end(), [](const auto& c) { return c.feasible; }));
}

TEST(Sequence, OrderIsQuickerThanThePlansOwnWhenThatOneZigzags) {
  std::string zigzag;
  for (int k = 0; k < 12; ++k)
    zigzag += "[[point]]\nfrequency_Hz = " + std::to_string(k % 2 == 0 ? 30 + k : 80 - k) +
              "\nvoltage_percent = " + std::to_string(40 + 5 * (k % 3)) + "\nload_share = 0.4\n";
  const Prepared p = prepare(zigzag);
  ASSERT_EQ(p.points.size(), 12u);
  double ordered = 0.0;
  for (const CheckedPoint& c : p.points) ordered += c.time_s;
  std::vector<CheckedPoint> as_planned = p.points;
  std::sort(as_planned.begin(), as_planned.end(),
            [](const auto& a, const auto& b) { return a.plan_index < b.plan_index; });
  double planned = 0.0;
  Operating here;
  double excitation = 0.0;
  for (const CheckedPoint& c : as_planned) {
    for (const Action& a : actions_for(p.travel, c, here, excitation))
      planned += a.wait_s + static_cast<double>(a.profile.total_samples()) * 60e-6;
    here = operating_after(c);
    excitation = c.excitation_A;
  }
  EXPECT_LT(ordered, 0.8 * planned);
}

TEST(Sequence, AnyTwoPointsAreJoinedWithoutAJump) {
  std::mt19937_64 random(3);
  const Travel travel = travel_of(plan_of("[dc]\nlevels_A = [1]\n"), RigConfig{}, 60e-6);
  const auto any = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() % 1000) / 999.0;
  };
  for (int k = 0; k < 500; ++k) {
    const Operating from = k % 7 == 0 ? Operating{} : Operating{any(1, 90), any(5, 200)};
    const Operating to = k % 11 == 0 ? Operating{} : Operating{any(1, 90), any(5, 200)};
    Operating here = from;
    for (const auto& s : move_profile(travel, from, to).segments) {
      EXPECT_NEAR(s.frequency_start_Hz, here.frequency_Hz, 1e-9);
      EXPECT_NEAR(s.amplitude_start_V, here.voltage_V, 1e-9);
      here = {s.frequency_end_Hz, s.amplitude_end_V};
    }
    EXPECT_NEAR(here.frequency_Hz, to.frequency_Hz, 1e-9);
    EXPECT_NEAR(here.voltage_V, to.voltage_V, 1e-9);
  }
}

}  // namespace
}  // namespace imrig
