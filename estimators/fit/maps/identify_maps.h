#pragma once
// Methods maps, locked and losses of `imrig identify`, and what method auto adds where the records allow it: the
// way of Proca and Keyhani 2002, per record and then mapped. docs/identification.md describes them.
//   maps    dc and transient fits (slip rule on), correlation table, all maps, losses, validation
//   locked  R_s(T) and R_r(w_s, T) from dc records and locked-like sweeps
//   losses  core loss, friction and windage from no-load records
// The model gets the maps beside its base parameters (model.h), which are what each method finds of them.

#include <memory>
#include <string>
#include <vector>

#include "estimators/fit/correlation.h"
#include "estimators/fit/identify.h"
#include "estimators/fit/maps/parameter_maps.h"
#include "estimators/fit/maps/sensitivity.h"
#include "estimators/fit/maps/validation.h"

namespace imrig::est {

inline constexpr double kPaperSlipRule = 0.02;

struct RecordSensitivity {
  std::size_t record = 0;
  double slip = kMissing;
  Sensitivity value;
};

struct MapsResult {
  IdentifyResult base;
  bool mapped = false;  // false: method auto found nothing to map, or another method was asked for
  ParameterMaps maps;
  double slip_rule = kPaperSlipRule;
  double least_sensitivity = 0.0;  // > 0: this chose the records in the slip rule's place
  std::vector<CorrelationRow> correlation;             // over the records kept
  std::vector<CorrelationRow> correlation_covariance;  // likewise without the slip rule
  std::vector<RecordSensitivity> sensitivities;
  SensitivityCurve figure_4;
  Validation validation;
};

bool is_maps_method(const std::string& method);

// Any method of identify(), the three above included. slip_rule: of method maps; options.slip_rule is that of
// the others. Throws Error as identify() does.
MapsResult identify_with_maps(const DataSet& data, const IdentifyOptions& options, double slip_rule = kPaperSlipRule);

}  // namespace imrig::est
