#pragma once
// How far a model is from measurements, record by record and channel by channel, against the floor that measurement noise sets.
//   rmse          root of the mean squared error of the channel, in its unit (for space vectors: of |error|)
//   nrmse         rmse over the signal's rms
//   chi2_per_dof  sum of squared errors over the noise's own expected sum; 1 for a model that leaves only noise. NaN without known noise
//   floor         the nrmse that pure measurement noise gives: from repeats, else from the declared noise, which counts the channel's own
//                 noise and the voltage and speed noise passed through the model. NaN if neither is known
// Time series are simulated with measured voltage and speed; the initial flux states of each record are estimated by linear least
// squares (also for hold-out records: they are states, not parameters). Points are solved by phasors.

#include <complex>
#include <map>
#include <string>
#include <vector>

#include "rig/data/conditions.h"
#include "rig/data/record.h"

namespace imrig::est {

class Model;

struct ChannelResult {
  double rmse = kMissing;
  double nrmse = kMissing;
  double chi2_per_dof = kMissing;
  double floor = kMissing;
  std::string unit;
  // What pooling needs: sums over the values compared, in the channel's unit squared.
  double error2 = 0.0;
  double signal2 = 0.0;
  double noise2 = kMissing;      // expected from noise alone
  std::size_t values = 0;        // real values compared
  std::size_t dof = 0;           // values less the initial states estimated
};

// Measured beside predicted at one point; NaN where the table has no value.
struct PointResult {
  struct Pair {
    double measured = kMissing;
    double predicted = kMissing;
  };
  Conditions conditions;
  std::map<std::string, Pair> channels;  // current_A (rms, line), input_power_W, power_factor, torque_Nm, output_power_W
};

// A stretch for the eye: at most 1200 samples of the measured current vector and the model's.
struct Overlay {
  std::vector<double> t_s;
  std::vector<std::complex<double>> measured, predicted;
};

struct ComparedRecord {
  std::string id;
  RecordKind kind = RecordKind::kFree;
  bool holdout = false;
  Conditions conditions;
  std::map<std::string, ChannelResult> channels;  // "current_A", "input_power_W", ...
  std::vector<PointResult> points;
  Overlay overlay;
  std::string left_out;  // why this record was not compared; empty if it was
  std::string floor_from;  // "repeats", "declared noise" or ""
};

// Pooled over the current channel of the records, each value counted alike.
struct PooledResult {
  std::size_t records = 0;
  double nrmse = kMissing;
  double chi2_per_dof = kMissing;
  double floor_nrmse = kMissing;
};

struct CompareResult {
  std::string data_name;
  std::vector<ComparedRecord> records;  // in the data set's order
  PooledResult fitted, holdout;
  std::vector<std::string> notes;
};

struct CompareOptions {
  int noise_draws = 2;            // seeded voltage and speed noise passed through the model
  std::uint64_t noise_seed = 1;
};

// Same input, same bits. A record the model cannot judge is kept with its reason in left_out. Throws Error when the pole pairs differ.
CompareResult compare(const Model& model, const DataSet& data, const CompareOptions& options = {});

}  // namespace imrig::est
