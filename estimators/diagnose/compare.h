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
// each record is estimated by linear least squares (of hold-out records too: it is a state, not a parameter),
// and so is the constant by which a speed that was rounded is off.
// Points are solved by phasors. With a voltage filter, currents and powers are those behind the same filter.

#include <complex>
#include <map>
#include <string>
#include <vector>

#include "estimators/diagnose/channel.h"
#include "estimators/diagnose/failure_map.h"
#include "estimators/diagnose/order_spectrum.h"
#include "rig/data/conditions.h"
#include "rig/data/record.h"

namespace imrig::est {

struct Model;

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
  Channels channels;
  std::vector<PointResult> points;
  std::vector<Stretch> stretches;  // of a table: its points
  Overlay overlay;
  RecordLines lines;       // empty for tables
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
  std::vector<FailureMap> maps;    // of time series, of tables
  OrderSpectrum spectrum;          // no line without time series
  std::vector<std::string> reach;  // what these data cannot reveal, whatever the model
  std::vector<std::string> notes;
};

struct CompareOptions {
  int noise_draws = 8;           // seeded voltage and speed noise passed through the model
  std::uint64_t noise_seed = 1;  // same input, same bits
  std::uint64_t shuffle_seed = 1;
  std::size_t stretches = 0;  // most of one record; 0: by the number of records
};

// A record that the model cannot judge is kept with its reason in left_out. Throws Error: pole pairs differ,
// a parameter of the model is not known, no record can be compared.
CompareResult compare(const Model& model, const DataSet& data, const CompareOptions& options = {});

}  // namespace imrig::est
