#pragma once
// From checked points to what the rig does: the order of points, and for each one the actions that lead to
// its record. Travelling: the load is off; the voltage is first brought to the travelling line v(f) = boost +
// (rated - boost) f / rated_f (capped at rated), then v and f ramp together along it, then the voltage goes
// to the point's. So V/f stays near rated while the speed changes, whatever the two points are. Ramps meet
// end to end: v and f never jump but for the wanted step.

#include <cstdint>
#include <imrig_msg/segment_t.hpp>
#include <vector>

#include "rig/campaign/feasibility.h"

namespace imrig {

// What the inverter is doing.
struct Operating {
  double frequency_Hz = 0.0;
  double voltage_V = 0.0;  // peak; 0 with frequency 0: gates off
};

struct Profile {
  std::vector<imrig_msg::segment_t> segments;
  bool hold_at_end = true;
  std::int64_t total_samples() const;
  std::int64_t recorded_samples() const;
};

enum class ActionKind { kLoad, kProfile, kRest, kSettle, kRecord };

// One thing to do and to wait for.
struct Action {
  ActionKind kind = ActionKind::kProfile;
  double excitation_A = 0.0;  // kLoad: field current
  double wait_s = 0.0;        // kLoad: rig time after the supply has reached it; kSettle: least time
  double bound_s = 0.0;       // kSettle: most time; kRest: most time
  double most_slip = 1.0;     // kLoad, kSettle, kRecord: a motor that slips more has stalled, or is about to
  bool leaving = false;       // kLoad: the motor still stands at the point before
  Profile profile;            // kProfile, kRecord (record numbers are filled in when it runs)
};

// Rates and voltages that hold for a whole campaign.
struct Travel {
  double sample_time_s = 60e-6;
  double rated_V = 180.0;  // peak phase
  double rated_Hz = 60.0;
  double boost_V = 4.0;
  double crawl_Hz = 16.0;  // below it, where 2 pi f L_l < R_s + R_r, rotor and field swing against each
                           // other: ramps are slower
  double frequency_ramp_Hz_per_s = 60.0;
  double voltage_ramp_V_per_s = 400.0;
  double unload_s = 0.4;
  double most_slip = 0.3;  // twice what the plan allows
  double R_s_ohm = 0.39, R_r_ohm = 0.22, L_l_H = 0.006;
};
Travel travel_of(const Plan& plan, const RigConfig& rig, double sample_time_s);

double travelling_V(const Travel& travel, double frequency_Hz);
// Slip above which a motor is taken for stalled: twice what the plan allows, and at most 2.5 times the
// nominal motor's pull-out slip R_r / |R_s + j w L_l|, since a warm, saturated one pulls out at up to twice
// that. Beyond it less voltage does not help and more draws the current of a start.
double stalling_slip(const Travel& travel, double frequency_Hz);

// Segments that bring the inverter from one operating point to another; empty when they are the same.
Profile move_profile(const Travel& travel, const Operating& from, const Operating& to);
// The profile of the point's record, and where it leaves the inverter.
Profile record_profile(const Travel& travel, const CheckedPoint& point);
Operating operating_before(const CheckedPoint& point);
Operating operating_after(const CheckedPoint& point);

// All actions of one point, given what the inverter does and what excitation is on before it.
std::vector<Action> actions_for(const Travel& travel, const CheckedPoint& point, const Operating& from,
                                double excitation_A);
// Brings the rig to rest from anywhere.
std::vector<Action> actions_to_rest(const Travel& travel, const Operating& from, double excitation_A);

// Feasible points in the order that takes least time of the orders tried: those at rest first, then by
// travel. Fills time_s.
std::vector<CheckedPoint> order_points(const Travel& travel, std::vector<CheckedPoint> points);

}  // namespace imrig
