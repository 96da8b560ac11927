#pragma once
// How far a model is from measurements, record by record and channel by channel, against the floor that
// measurement noise sets.
//   rmse          root of the mean squared error of the channel, in its unit (for space vectors: of |error|)
//   nrmse         rmse over the signal's rms
//   chi2_per_dof  mean of squared error over its variance from noise alone; 1 for a model that leaves only
//   noise floor         the nrmse that measurement noise alone gives: from repeats, else from the declared
//   noise,
//                 which counts the channel's own noise and the voltage and speed noise passed through the
//                 model
// NaN where the noise is not known. Time series are driven by measured voltage and speed; the initial flux of
// each record is estimated by linear least squares (of hold-out records too: it is a state, not a parameter).
// Points are solved by phasors. With a voltage filter, currents and powers are those behind the same filter.

#include <complex>
#include <map>
#include <string>
#include <vector>

#include "rig/data/conditions.h"
#include "rig/data/record.h"

namespace imrig::est {

struct Model;

// Channels: current_A (space vector, peak; of points: line, rms), input_power_W; of points also power_factor,
// torque_Nm (shaft) and output_power_W, where the table has them.
struct ChannelResult {
  double rmse = kMissing;
  double nrmse = kMissing;
  double chi2_per_dof = kMissing;
  double floor = kMissing;
  std::string unit;
  // What pooling needs: sums over the values compared, in the unit squared.
  double error2 = 0.0;
  double signal2 = 0.0;
  double noise2 = kMissing;  // expected of error2 from noise alone
  double chi2 = kMissing;
  std::size_t values = 0;  // samples or points
  double dof = 0.0;        // real values less the initial states estimated
};

// Measured beside predicted at one point; NaN where the table has no value.
struct PointResult {
  struct Pair {
    double measured = kMissing;
    double predicted = kMissing;
  };
  Conditions conditions;
  std::map<std::string, Pair> channels;
};

// A stretch for the eye: at most 1200 samples of the measured current vector and the model's, where the error
// is largest.
struct Overlay {
  std::vector<double> t_s;
  std::vector<std::complex<double>> measured, predicted;
};

struct ComparedRecord {
  std::string id;
  RecordKind kind = RecordKind::kFree;
  bool holdout = false;
  Conditions conditions;
  std::map<std::string, ChannelResult> channels;
  std::vector<PointResult> points;
  Overlay overlay;
  std::string left_out;    // why this record was not compared; empty if it was
  std::string floor_from;  // "repeats", "declared noise" or "" where it is not known
};

// Pooled over the current channel of the records compared; floor_nrmse over those whose noise is known.
struct PooledResult {
  std::size_t records = 0;
  double nrmse = kMissing;
  double chi2_per_dof = kMissing;
  double floor_nrmse = kMissing;
};

struct CompareResult {
  std::string model_name, data_name;
  std::vector<ComparedRecord> records;  // in the data set's order
  PooledResult fitted, holdout;
  std::vector<std::string> notes;
};

struct CompareOptions {
  int noise_draws = 8;           // seeded voltage and speed noise passed through the model
  std::uint64_t noise_seed = 1;  // same input, same bits
};

// A record that the model cannot judge is kept with its reason in left_out. Throws Error: pole pairs differ,
// a parameter of the model is not known, no record can be compared.
CompareResult compare(const Model& model, const DataSet& data, const CompareOptions& options = {});

}  // namespace imrig::est
