#pragma once
// All records of a data set at once: shared parameters of the motor and its effects, and per record what
// belongs to it alone (initial fluxes, a temperature nobody measured). The record's own unknowns are
// eliminated record by record (Schur complement), so the work grows with the data, not with the records'
// unknowns.

#include <memory>
#include <string>
#include <vector>

#include "estimators/fit/global/driven_record.h"
#include "estimators/fit/global/noise_levels.h"
#include "estimators/fit/global/points_terms.h"
#include "estimators/fit/global/record_terms.h"
#include "estimators/model/model.h"
#include "rig/data/record.h"
#include "rig/data/speed_rounding.h"

namespace imrig::est {

// Where a fit stands.
struct GlobalPoint {
  SharedVector<double> shared{};
  std::vector<LocalVector<double>> local;  // one an entry of the problem
};

struct Bounds {
  double low, high;
};

// What is free: entries of the shared vector, entries of each record's own vector.
struct Freedom {
  std::vector<std::size_t> shared;
  std::vector<std::size_t> local;
  std::array<Bounds, kBase> base{{{1e-9, 1e6}, {1e-9, 1e6}, {1e-9, 1e6}, {1e-9, 1e6}}};

  Bounds bounds_of(std::size_t shared_entry) const;
};

// Gaussian knowledge about an entry: value +- sigma.
struct Prior {
  std::size_t entry = 0;
  double value = 0.0;
  double sigma = 0.0;
};

// Sums over the records, their own unknowns eliminated.
struct GlobalTerms {
  double chi2 = 0.0;  // priors included
  std::size_t values = 0;
  Eigen::MatrixXd normal;  // over the shared unknowns
  Eigen::VectorXd gradient;
  std::vector<RecordTerms> records;      // as they were evaluated
  std::vector<Eigen::VectorXd> scores;   // reduced gradient of each record
  std::vector<Eigen::MatrixXd> normals;  // reduced normal matrix of each record
};

class GlobalProblem {
 public:
  GlobalProblem(const GlobalProblem& other);
  GlobalProblem& operator=(const GlobalProblem&) = delete;

  struct Entry {
    std::size_t index = 0;  // in the data set
    std::string id;
    bool holdout = false;
    const Record* record = nullptr;
    std::vector<SteadyPoint> point;        // of a table: this row
    std::unique_ptr<DrivenRecord> series;  // null: a row of a table
    std::unique_ptr<Whitener> whitener;
    int steps = 1;
  };
  struct LeftOut {
    std::string id, why;
  };

  // Takes the records that can be simulated; a rough circuit for whitening is `theta`. data must outlive
  // this. longest_sample_s: that averaging of samples may make (driven_record.h).
  // judge_torque: shaft torque of series too (torque_windows.h), which only a model with the shaft's losses
  // follows.
  GlobalProblem(const DataSet& data, const MachineParameters<double>& theta, int threads,
                double longest_sample_s = kThinnedTime_s, bool judge_torque = false);

  const DataSet& data() const { return data_; }
  const std::vector<Entry>& entries() const { return entries_; }
  const std::vector<LeftOut>& left_out() const { return left_out_; }
  const NoiseEstimate& noise() const { return noise_; }
  double sample_time_s() const { return sample_time_; }  // longest of the series; 0: tables only
  double mean_stator_C() const { return mean_stator_C_; }
  bool has_stator_C() const { return spread_stator_C_ > 1.0; }  // a winding temperature that moves, K
  const SpeedRounding& speed_rounding() const { return rounding_; }
  double speed_sigma() const;  // of a held speed that was rounded, electrical rad/s; 0: none was
  bool has_torque() const { return torque_; }
  bool has_torque_of_series() const { return torque_of_series_; }
  double largest_torque_Nm() const { return largest_torque_Nm_; }  // of tables and steady stretches; 0: none
  TransducerAccuracy transducer() const { return {.zero_Nm = kTorqueZero * largest_torque_Nm_}; }
  // Why the torque of the series is not judged: torque_windows.h. Empty: it is, or there is none.
  const std::string& torque_refused() const { return torque_refused_; }
  double largest_flux_Wb() const { return largest_flux_; }
  double largest_current_A() const { return largest_current_; }
  // Steps and whitening for a better circuit than the first.
  void refresh(const SharedVector<double>& shared);

  // The same without the shaft torque of its series.
  GlobalProblem without_torque() const;

  // The problem of an experiment that was not made: the same records and `more`, each with its noise.
  // data must outlive it too.
  GlobalProblem with(std::vector<DrivenRecord> more, const SharedVector<double>& shared,
                     const std::vector<NoiseLevels>& noise) const;
  // Puts what the model at `at` would have measured, without noise, in the place of all that was measured;
  // records of an experiment have a torque where those of the data do.
  void pretend(const GlobalPoint& at);

  GlobalPoint start(const SharedVector<double>& shared) const;

  // which: entries to evaluate, by number.
  GlobalTerms evaluate(const GlobalPoint& at, const Freedom& free, const std::vector<std::size_t>& which,
                       const std::vector<Prior>& priors = {}) const;
  RecordTerms evaluate_one(std::size_t entry, const SharedVector<double>& shared,
                           const LocalVector<double>& local, const Lanes& lanes,
                           RecordTrace* trace = nullptr) const;

  // Expected gradient of chi2/2 at the true parameters (noise_bias.h).
  Eigen::VectorXd noise_gradient(const GlobalPoint& at, const std::vector<std::size_t>& entries,
                                 const std::vector<std::size_t>& which) const;

  // Brings each record's own unknowns to their best for the given shared vector.
  void settle(GlobalPoint& at, const std::vector<std::size_t>& local,
              const std::vector<std::size_t>& which) const;

  std::vector<std::size_t> fitted() const;  // entries that are no hold-outs
  std::vector<std::size_t> holdout() const;
  std::vector<std::size_t> all() const;
  // The record's own unknowns that this entry has: a table has none.
  std::vector<std::size_t> locals_of(std::size_t entry, const std::vector<std::size_t>& local) const;

 private:
  void add_rows(std::size_t index);
  void weigh_torque(double R_s_ohm);

  const DataSet& data_;
  int threads_;
  NoiseEstimate noise_;
  PointNoise point_noise_;
  std::vector<Entry> entries_;
  std::vector<LeftOut> left_out_;
  double mean_stator_C_ = kMissing, spread_stator_C_ = 0.0;
  double largest_flux_ = 0.1, largest_current_ = 1.0;
  double sample_time_ = 0.0;
  SpeedRounding rounding_;
  double largest_torque_Nm_ = 0.0;
  std::string torque_refused_;
  bool torque_ = false, torque_of_series_ = false;
};

}  // namespace imrig::est
