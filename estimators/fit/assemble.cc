#include "estimators/fit/assemble.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimators/fit/combine.h"

namespace imrig::est {

namespace {

// Relative sigma beyond which an estimate is no information. A table of points is one record and the only
// one: it may say "20 +- 30 %".
double hopeless(RecordKind kind) { return kind == RecordKind::kPoints ? 1.0 : 0.1; }

RecordEstimate* estimate_of(RecordResult& result, const std::string& name) {
  const auto found = result.parameters.find(name);
  return found == result.parameters.end() ? nullptr : &found->second;
}

std::vector<RecordResult*> speakers(const std::string& name, const std::vector<RecordResult*>& results) {
  std::vector<RecordResult*> all;
  for (RecordResult* result : results) {
    if (std::find(result->used_for.begin(), result->used_for.end(), name) != result->used_for.end())
      all.push_back(result);
  }
  return all;
}

// No record is good enough: every sound one that says anything.
std::vector<RecordResult*> weak_speakers(const std::string& name, const std::vector<RecordResult*>& results,
                                         std::vector<std::string>& notes) {
  std::vector<RecordResult*> all;
  double best = std::numeric_limits<double>::infinity();
  for (RecordResult* result : results) {
    RecordEstimate* estimate = estimate_of(*result, name);
    if (estimate == nullptr || !estimate->weak ||
        !(estimate->sigma < hopeless(result->kind) * estimate->value))
      continue;
    best = std::min(best, estimate->sigma / estimate->value);
    all.push_back(result);
  }
  if (!all.empty()) {
    notes.push_back(fmt::format("{}: no record determines it well; the best one to {:.2g} % (one sigma)",
                                name, 100.0 * best));
  }
  for (RecordResult* result : all) {
    result->used_for.push_back(name);
    result->rejected.clear();
    estimate_of(*result, name)->left_out.clear();
  }
  return all;
}

void set_aside(RecordResult& result, const std::string& name, const std::string& reason) {
  estimate_of(result, name)->left_out = reason;
  std::erase(result.used_for, name);
  if (result.used_for.empty()) result.rejected = name + ": " + reason;
}

}  // namespace

double gain_sigma(const Accuracy& accuracy) {
  return std::hypot(accuracy.current_gain, accuracy.voltage_gain);
}

Parameter assemble(const char* name, const std::vector<RecordResult*>& results, double R_s_sigma,
                   const Accuracy& accuracy, std::vector<std::string>& notes) {
  Parameter parameter;
  auto from = speakers(name, results);
  if (from.empty()) from = weak_speakers(name, results, notes);
  if (from.empty()) return parameter;
  std::vector<Contribution> contributions;
  for (RecordResult* result : from) {
    const RecordEstimate* estimate = estimate_of(*result, name);
    contributions.push_back({estimate->value, std::max(estimate->sigma, 1e-9 * std::abs(estimate->value))});
  }
  const Combined combined = combine(contributions);
  double per_R_s = 0.0;
  for (std::size_t k = 0; k < from.size(); ++k) {
    if (!combined.outlier[k].empty()) {
      set_aside(*from[k], name, combined.outlier[k]);
    } else {
      per_R_s += estimate_of(*from[k], name)->per_R_s / static_cast<double>(combined.used);
      parameter.unit = estimate_of(*from[k], name)->unit;
    }
  }
  const double half =
      half_width_95(combined, std::hypot(per_R_s * R_s_sigma, gain_sigma(accuracy) * combined.value));
  parameter.value = combined.value;
  parameter.ci95_low = combined.value - half;
  parameter.ci95_high = combined.value + half;
  parameter.found = fmt::format("{} record{}", combined.used, combined.used == 1 ? "" : "s");
  return parameter;
}

}  // namespace imrig::est
