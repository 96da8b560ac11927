#include "estimators/diagnose/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "estimators/diagnose/compare_points.h"
#include "estimators/diagnose/compare_series.h"
#include "estimators/diagnose/data_reach.h"
#include "estimators/diagnose/repeat_floor.h"
#include "estimators/model/model.h"
#include "rig/base/error.h"
#include "rig/data/speed_rounding.h"

namespace imrig::est {

namespace {

void check(const Model& model, const DataSet& data) {
  if (model.pole_pairs == data.pole_pairs) return;
  throw Error("compare",
              fmt::format("the model \"{}\" has {} pole pairs, the data \"{}\" {}", model.name,
                          model.pole_pairs, data.name, data.pole_pairs),
              "they must be of one motor");
}

ComparedRecord named(const Record& record, int pole_pairs, double R_s) {
  ComparedRecord out;
  out.id = record.id;
  out.kind = record.kind;
  out.holdout = record.holdout;
  out.conditions = conditions_of(record, pole_pairs, R_s);
  return out;
}

// Records that share a repeat_of, and the one it names.
std::map<std::string, std::vector<std::size_t>> repeats_of(const DataSet& data) {
  std::map<std::string, std::vector<std::size_t>> groups;
  for (std::size_t k = 0; k < data.records.size(); ++k) {
    const Record& record = data.records[k];
    groups[record.repeat_of.empty() ? record.id : record.repeat_of].push_back(k);
  }
  std::erase_if(groups, [](const auto& group) { return group.second.size() < 2; });
  return groups;
}

// Residuals are kept only where a repeat asks for them: they are as large as the data.
std::map<std::size_t, Residual> compare_records(const ModelPrediction& model, const DataSet& data,
                                                const CompareOptions& options,
                                                const std::map<std::string, std::vector<std::size_t>>& groups,
                                                CompareResult& result) {
  std::map<std::size_t, Residual> kept;
  const SpeedRounding rounding = speed_rounding(data);
  for (const auto& [key, members] : groups) {
    for (const std::size_t k : members) kept[k];
  }
  for (std::size_t k = 0; k < data.records.size(); ++k) {
    const Record& record = data.records[k];
    ComparedRecord out = named(record, data.pole_pairs, model.machine().R_s);
    try {
      if (record.kind == RecordKind::kPoints) {
        compare_points(model, data, record, out);
        kept.erase(k);
      } else {
        const double speed_sigma = rounding.of_record[k] ? rounding.sigma_rad_s : 0.0;
        Residual residual = compare_series(model, data, record, options, speed_sigma, out);
        if (kept.contains(k)) kept[k] = std::move(residual);
      }
    } catch (const Error& e) {
      out.left_out = e.what();
      kept.erase(k);
    }
    result.records.push_back(std::move(out));
  }
  return kept;
}

void apply_repeats(const std::map<std::string, std::vector<std::size_t>>& groups,
                   const std::map<std::size_t, Residual>& kept, CompareResult& result) {
  for (const auto& [key, members] : groups) {
    std::vector<const Residual*> residuals;
    std::vector<ComparedRecord*> records;
    for (const std::size_t k : members) {
      const auto found = kept.find(k);
      if (found == kept.end()) continue;
      residuals.push_back(&found->second);
      records.push_back(&result.records[k]);
    }
    set_floor_from_repeats(residuals, records);
  }
}

// Enough stretches in all to see where a single log fails, few enough of each of many records.
std::size_t stretches_each(const DataSet& data) {
  const std::size_t records = std::max<std::size_t>(1, data.records.size());
  return std::clamp<std::size_t>(400 / records, 8, 200);
}

void say_where(std::uint64_t seed, CompareResult& result) {
  std::vector<std::pair<std::string, const RecordLines*>> lines;
  for (const bool points : {false, true}) {
    std::vector<const std::vector<Stretch>*> stretches;
    for (const ComparedRecord& record : result.records) {
      if ((record.kind == RecordKind::kPoints) == points && !record.stretches.empty())
        stretches.push_back(&record.stretches);
    }
    if (!stretches.empty())
      result.maps.push_back(failure_map(stretches, points ? "points" : "time series", seed));
  }
  for (const ComparedRecord& record : result.records) lines.push_back({record.id, &record.lines});
  result.spectrum = order_spectrum(lines);
}

PooledResult pooled(const std::vector<ComparedRecord>& records, bool holdout) {
  PooledResult out;
  double error2 = 0.0, signal2 = 0.0, known_signal2 = 0.0, noise2 = 0.0, chi2 = 0.0, dof = 0.0;
  for (const auto& record : records) {
    const auto found = record.channels.find("current_A");
    if (record.holdout != holdout || !record.left_out.empty() || found == record.channels.end()) continue;
    const ChannelResult& channel = found->second;
    const double to_peak = record.kind == RecordKind::kPoints ? 2.0 : 1.0;  // tables hold rms values
    ++out.records;
    error2 += to_peak * channel.error2;
    signal2 += to_peak * channel.signal2;
    if (std::isnan(channel.noise2)) continue;
    known_signal2 += to_peak * channel.signal2;
    noise2 += to_peak * channel.noise2;
    chi2 += channel.chi2;
    dof += channel.dof;
  }
  if (signal2 > 0.0) out.nrmse = std::sqrt(error2 / signal2);
  if (known_signal2 > 0.0) out.floor_nrmse = std::sqrt(noise2 / known_signal2);
  if (dof > 0.0) out.chi2_per_dof = chi2 / dof;
  return out;
}

void tell(const Model& model, const DataSet& data, CompareResult& result) {
  for (const auto& base : base_parameters()) {
    if (is_start(model.*base.place)) result.notes.push_back(fmt::format("{} of the model is a rough start and no result", base.name));
  }
  std::size_t left_out = 0, unknown = 0;
  for (const auto& record : result.records) {
    left_out += record.left_out.empty() ? 0u : 1u;
    unknown += record.left_out.empty() && record.floor_from.empty() ? 1u : 0u;
  }
  if (left_out == result.records.size()) {
    throw Error("compare", "no record of \"" + data.name + "\" can be compared",
                "the first says: " + result.records.front().left_out);
  }
  if (left_out > 0)
    result.notes.push_back(
        fmt::format("{} of {} records could not be compared", left_out, result.records.size()));
  if (unknown > 0) {
    result.notes.push_back(fmt::format(
        "{} record{} no noise floor: neither a repeat nor noise.current_A tells the noise, so errors "
        "are relative statements only",
        unknown, unknown == 1 ? " has" : "s have"));
  }
  for (const Record& record : data.records) {
    for (const auto& warning : record.warnings) result.notes.push_back(record.id + ": " + warning);
  }
}

}  // namespace

CompareResult compare(const Model& model, const DataSet& data, const CompareOptions& options) {
  check(model, data);
  const ModelPrediction prediction(model);
  CompareResult result;
  result.model_name = model.name;
  result.data_name = data.name;
  if (model.delta != data.delta) {
    result.notes.push_back(
        fmt::format("the model says {}, the data {}; both are compared as the equivalent star",
                    model.delta ? "delta" : "star", data.delta ? "delta" : "star"));
  }
  const auto groups = repeats_of(data);
  CompareOptions wanted = options;
  if (wanted.stretches == 0) wanted.stretches = stretches_each(data);
  const auto kept = compare_records(prediction, data, wanted, groups, result);
  apply_repeats(groups, kept, result);
  say_where(options.shuffle_seed, result);
  result.reach = data_reach(data, result);
  result.fitted = pooled(result.records, false);
  result.holdout = pooled(result.records, true);
  tell(model, data, result);
  return result;
}

}  // namespace imrig::est
