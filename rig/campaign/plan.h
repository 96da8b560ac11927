#pragma once
// A campaign plan: strict TOML, version 1, docs/campaigns.md lists every key. Reading it expands grids,
// repeats and holdouts into a plain list of points; one point is one record. What a point can carry is not
// known here: a load may be a share of the most (feasibility.h).

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace imrig {

enum class PointKind { kDc, kStandstill, kLockedSweep, kStartup, kNoLoad, kSteady, kStep, kCoastDown };

// The word of record_t.kind.
std::string_view point_kind_word(PointKind kind);
// dc, standstill, locked_sweep: the shaft rests and the load plays no part. startup begins at rest,
// coast_down ends there.
bool begins_at_rest(PointKind kind);
bool stays_at_rest(PointKind kind);

// What load a point asks for: a torque, or a share of the most it can carry.
struct LoadRequest {
  double torque_Nm = 0.0;
  double share = std::numeric_limits<double>::quiet_NaN();  // 0..1; NaN: torque_Nm counts
};

// Sum of sines for the regulated current at standstill.
struct Tones {
  double offset_A = 0.0;
  std::vector<double> amplitude_A;  // same length as frequency_Hz, at most 8
  std::vector<double> frequency_Hz;
  double kp_V_per_A = 1.6;
  double ki_V_per_As = 116.0;
  double period_s = 0.3e-3;  // of the regulator
};

struct PlanPoint {
  std::string id;  // unique in the plan; record_t.id
  PointKind kind = PointKind::kStep;
  double frequency_Hz = 0.0;
  double voltage_percent = 0.0;  // of rated, before the step
  LoadRequest load;
  double step = 0.0;            // relative voltage step of kind step
  double level_A = 0.0;         // dc; locked_sweep: peak current wanted
  bool regulated = false;       // locked_sweep: current along one axis, regulated, instead of a turning field
  double ramp_s = 0.0;          // startup: 0 puts the voltage on at once; locked_sweep
  Tones tones;                  // standstill
  double settle_s = 0.0;        // at least so long between reaching the point and its record
  double settle_bound_s = 0.0;  // and at most so long, whether the estimator calls it steady or not
  double before_s = 0.0;        // recorded before the event (step, switching on, gates off)
  double record_s = 0.0;        // recorded after it, or in all where there is none
  bool holdout = false;
  std::string repeat_of;  // id of the first of its repeats, empty for that one itself
};

// What the plan keeps below the rig's own limits. NaN: the rig's limit, with the margin of docs/campaigns.md.
struct PlanLimits {
  double current_A = std::numeric_limits<double>::quiet_NaN();  // peak, the step's transient included
  double speed_rpm = std::numeric_limits<double>::quiet_NaN();
  double pull_out_margin = 0.75;  // largest load as a share of the pull-out torque
  double slip = 0.15;             // largest
  double flux_percent =
      std::numeric_limits<double>::quiet_NaN();  // largest V/f, of rated; NaN: no such limit
  int trips_allowed =
      0;  // over-current trips of the device in a point after which the campaign resets and goes on
};

// How the rig travels between points.
struct Motion {
  double frequency_ramp_Hz_per_s = 60.0;  // slower where the torque at travelling flux asks for it
  double voltage_ramp_V_per_s = 400.0;
  double unload_s = 0.4;  // wait after the load was taken off
};

struct Plan {
  std::string name;
  std::string description;
  PlanLimits limits;
  Motion motion;
  std::vector<PlanPoint> points;
  std::uint64_t hash = 0;  // of the file's text
};

// Throws Error: no such file, no TOML, unknown key, value out of range, two points with one id, nothing to
// do.
Plan load_plan(const std::string& path);
Plan parse_plan(const std::string& text, const std::string& name);

}  // namespace imrig
