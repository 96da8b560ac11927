#pragma once
// What identification works on: records of one motor, however they came (event log, CSV folder, table of points).
// Everything here is SI and star-equivalent: voltages and currents are space vectors (peak values) of the star that behaves at the
// terminals like the motor, whatever its connection and whatever the columns held. Speeds are mechanical, rad/s.

#include <complex>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "rig/base/space_vector.h"

namespace imrig {

inline constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

enum class RecordKind { kDc, kStandstill, kLockedSweep, kNoLoad, kSteady, kStep, kStartup, kCoastDown, kFree, kPoints };

// The word used in files and messages ("dc", "locked_sweep", ...).
std::string record_kind_word(RecordKind kind);
std::optional<RecordKind> record_kind_from(const std::string& word);

// Noise of one sample, one sigma; NaN where nothing is known.
struct Noise {
  double current_A = kMissing;   // of each component of the space vector
  double voltage_V = kMissing;   // likewise
  double speed_rad_s = kMissing;
  double torque_Nm = kMissing;
  double power_W = kMissing;
};

// Systematic errors that may be there, one sigma, relative (gains). They bias every record alike and no averaging removes them.
struct Accuracy {
  double current_gain = 0.0;
  double voltage_gain = 0.0;
};

// A uniformly sampled stretch. All vectors that are not empty have the same length.
struct TimeSeries {
  double sample_time_s = kMissing;
  std::int64_t first_index = 0;          // on the device's clock; 0 for imported files
  std::vector<SpaceVector> v;            // V
  std::vector<SpaceVector> i;            // A
  std::vector<double> speed_rad_s;       // mechanical
  std::vector<double> torque_Nm;         // shaft; may be empty
  std::vector<double> stator_C;          // may be empty; one value a sample, NaN where missing
  std::vector<std::int32_t> segment;     // profile segment a sample belongs to; may be empty
  std::vector<std::uint8_t> gates_on;    // may be empty: always on
  double voltage_filter_s = 0.0;         // time constant of the first-order filter that the voltage channels passed and the currents did not
  std::size_t size() const { return i.size(); }
};

// One steady operating point of a table. NaN where the cell was empty.
struct SteadyPoint {
  double v_peak_V = kMissing;   // phase, peak, star-equivalent
  double f_Hz = kMissing;
  double i_peak_A = kMissing;
  double p_in_W = kMissing;
  double power_factor = kMissing;
  double q_var = kMissing;
  double speed_rad_s = kMissing;
  double torque_Nm = kMissing;
  double p_out_W = kMissing;
  double stator_C = kMissing;
};

// Set-points of the record as commanded; NaN where they have no meaning. For display and grouping, never for fitting.
struct SetPoint {
  double f_Hz = kMissing;
  double v_peak_V = kMissing;
  double step = kMissing;       // relative voltage step
  double load_Nm = kMissing;
  double excitation_A = kMissing;
};

struct Record {
  std::string id;
  RecordKind kind = RecordKind::kFree;
  bool holdout = false;         // never fitted, only judged
  std::string repeat_of;        // empty if none
  SetPoint set;
  TimeSeries series;            // empty for kPoints
  std::vector<SteadyPoint> points;  // empty for the other kinds
  std::vector<std::string> warnings;  // found at import: gaps, clipping, swapped phases, ...
};

struct DataSet {
  std::string name;
  int pole_pairs = 0;
  bool delta = false;           // connection of the motor; values are star-equivalent all the same
  Noise noise;                  // star-equivalent
  Accuracy accuracy;
  std::vector<Record> records;
  std::vector<std::string> notes;   // about the set as a whole
  std::uint64_t hash = 0;       // of the data, for the model's history
};

}  // namespace imrig
