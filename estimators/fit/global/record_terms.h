#pragma once
// One record's part of the least-squares problem: whitened errors e of the current, and of the shaft torque's
// means over steady stretches where it was measured (torque_windows.h), their Jacobian J along the machine's
// motion (driven_motion.h), and the sums that every step, test and interval is made from:
//   chi2 = e'e,  gradient = J'e,  normal = J'J
// over the lanes in their order. Sums over stretches of the record allow for noise that is not what it was
// declared to be.

#include <Eigen/Core>
#include <complex>
#include <vector>

#include "estimators/fit/global/lanes.h"
#include "estimators/fit/global/torque_sums.h"
#include "estimators/fit/global/whitener.h"
#include "estimators/model/effects/effect_list.h"

namespace imrig::est {

inline constexpr std::size_t kStretches = 8;

struct RecordTerms {
  double chi2 = 0.0;
  std::size_t values = 0;  // real values judged
  Eigen::VectorXd gradient;
  Eigen::MatrixXd normal;
  Eigen::MatrixXd stretch_gradient;  // lanes x kStretches
  std::array<double, kStretches> stretch_chi2{};
  double error2 = 0.0, signal2 = 0.0;  // raw, A^2
  TorqueSums torque;                   // of chi2 and values
};

// What an evaluation may be asked for beside the sums.
struct RecordTrace {
  std::vector<std::complex<double>> error;     // measured less predicted, A, in the frame, from judged_from
  std::vector<std::complex<double>> whitened;  // likewise
  std::vector<double> torque_Nm;               // predicted, one a window of the record
  Eigen::MatrixXd rows;                        // whitened Jacobian, two rows a sample, if wanted
  bool want_rows = false;
};

// steps: integration steps per sample (driven_motion.h).
RecordTerms record_terms(const DrivenRecord& record, const Whitener& whitener, int steps,
                         const SharedVector<double>& shared, const LocalVector<double>& local,
                         const Lanes& lanes, RecordTrace* trace = nullptr);

// The largest number of lanes one call takes when the four initial fluxes are among them.
inline constexpr std::size_t kMostLanes = 38;

// Enough steps for the machine's fastest motion.
int steps_for(const DrivenRecord& record, const SharedVector<double>& shared);

}  // namespace imrig::est
