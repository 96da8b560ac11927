#pragma once
// Standstill records within an identification: the rig's estimate (standstill_fit.h) enters the model, the
// published estimator (gradient_estimator.h) stands beside it for comparison.

#include <optional>

#include "estimators/fit/identify.h"
#include "estimators/fit/standstill/gradient_estimator.h"
#include "estimators/fit/standstill/standstill_fit.h"

namespace imrig::est {

struct StandstillReport {
  StandstillFit fit;
  double seconds = 0.0;   // of data
  double axis_rad = 0.0;  // direction of the current
  double gain_sigma =
      0.0;  // of the sensors, relative: scales every impedance alike, so it belongs to every interval
  GradientConfig published;  // as run
  RegressionVector published_c{};
  std::optional<TCircuit> published_circuit;  // nothing where the vector, not converged, is no motor's
};

// R_s of a dc test along its own axis. Its sigma is that of its noise; between two axes the channels' gains,
// one sigma g each, differ by sqrt(2/3) |sin(angle between)| g.
struct DcResistance {
  double value_ohm = 0.0;
  double relative_sigma = 0.0;
  double axis_rad = 0.0;
};

// Fills the row: parameters R_s, R_r, L_l, L_m, what it was used for or why not, and `standstill`.
// R_s: from the data set's dc test, if there is one.
void fit_standstill_record(const DataSet& data, const Record& record, const IdentifyOptions& options,
                           const std::optional<DcResistance>& R_s, RecordResult& row);

}  // namespace imrig::est
