#pragma once
// From a data set to a model: which records say what about which parameter, and what follows from all of
// them. docs/identification.md describes the methods: dc (R_s from direct current), transient (L_m, R_r, L_l
// by output error, per record), standstill (all four, current along one axis), points (phasor circuit fitted
// to a table of steady points), auto (whatever the records allow; what they leave open one by one is fitted to all
// together). Hold-out records are never fitted.

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "estimators/model/model.h"
#include "rig/data/record.h"

namespace imrig::est {

struct StandstillReport;  // standstill/standstill_records.h

struct Progress {
  std::size_t done = 0;
  std::size_t total = 0;
  std::string record;
};

struct IdentifyOptions {
  std::string method = "auto";   // auto | dc | transient | standstill | points
  std::optional<Model> nominal;  // start and bounds; without it both come from the data
  double max_relative_sigma =
      0.01;  // a record speaks for a parameter when its own relative sigma is below this
  double slip_rule =
      0.0;          // > 0: also the paper's rule, R_r and L_l from slips above it and L_m below (0.02 there)
  double least_sensitivity =
      0.0;          // > 0: also S_y / I of (8)-(9) at the record's frequency and slip (maps/sensitivity.h) not below this
  bool together = true;  // method auto: what the records one by one leave open is fitted to all of them (global/start_from_data.h)
  int threads = 2;       // the result does not depend on it
  std::function<void(const Progress&)>
      progress;  // called from the calling thread's workers one at a time; may be empty
};

// One record's estimate of one parameter.
struct RecordEstimate {
  double value = kMissing;
  double sigma = kMissing;  // noise of this record alone
  double per_R_s = 0.0;     // d value / d R_s, for the R_s that was given
  std::string unit;
  std::string left_out;  // why it was not used; empty when it was
  bool weak = false;     // sound, left out only because other records may know better
  bool by_rule = false;        // left out by the slip rule or the computed sensitivity alone
  double sensitivity = kMissing;  // S_y / I of (7)-(8) in Proca and Keyhani 2002, over this record itself
};

struct RecordResult {
  std::string id;
  RecordKind kind = RecordKind::kFree;
  bool holdout = false;
  std::vector<std::string> used_for;  // parameters of the model that this record entered
  std::string rejected;               // why it was used for nothing; empty otherwise
  std::map<std::string, RecordEstimate> parameters;
  std::vector<std::string> notes;
  double f_Hz = kMissing, slip = kMissing, v_peak_V = kMissing, i_peak_A = kMissing;  // mean conditions
  double nrmse = kMissing;         // residual over signal, rms
  double chi2_per_dof = kMissing;  // against the declared noise; NaN without it
  std::shared_ptr<const StandstillReport>
      standstill;  // of a standstill record: T circuit, published estimator
};

struct IdentifyResult {
  Model model;
  std::vector<RecordResult> records;  // in the data set's order
  std::vector<std::string> notes;     // what the user should know: R_s not measured, flat directions, ...
};

// Throws Error: unknown method, no record that the method can use, nothing identified.
IdentifyResult identify(const DataSet& data, const IdentifyOptions& options = {});

}  // namespace imrig::est
