#include "estimators/diagnose/missing/parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace imrig::est {

namespace {

constexpr double kParts = 16.0, kShortest_s = 0.2;
constexpr double kLong = 1.5;  // times the usual length
constexpr std::size_t kFewestSamples = 400;

bool may_be_cut(const Record& r) { return r.kind != RecordKind::kPoints && r.kind != RecordKind::kDc; }

double length_s(const TimeSeries& s) { return static_cast<double>(s.size()) * s.sample_time_s; }

template <class X>
std::vector<X> between(const std::vector<X>& x, std::size_t from, std::size_t to) {
  if (x.empty()) return {};
  return {x.begin() + static_cast<std::ptrdiff_t>(from), x.begin() + static_cast<std::ptrdiff_t>(to)};
}

TimeSeries between(const TimeSeries& s, std::size_t from, std::size_t to) {
  TimeSeries out;
  out.sample_time_s = s.sample_time_s;
  out.first_index = s.first_index + static_cast<std::int64_t>(from);
  out.v = between(s.v, from, to);
  out.i = between(s.i, from, to);
  out.speed_rad_s = between(s.speed_rad_s, from, to);
  out.torque_Nm = between(s.torque_Nm, from, to);
  out.stator_C = between(s.stator_C, from, to);
  out.segment = between(s.segment, from, to);
  out.gates_on = between(s.gates_on, from, to);
  out.voltage_filter_s = s.voltage_filter_s;
  return out;
}

}  // namespace

DataSet in_parts(const DataSet& data, std::vector<std::string>& cut) {
  cut.clear();
  std::vector<double> lengths;
  for (const Record& r : data.records) {
    if (may_be_cut(r)) lengths.push_back(length_s(r.series));
  }
  if (lengths.empty()) return data;
  std::sort(lengths.begin(), lengths.end());
  const double wanted_s = lengths.size() < kFewRecords
                              ? std::accumulate(lengths.begin(), lengths.end(), 0.0) / kParts
                              : kLong * lengths[lengths.size() / 2];
  const double part_s = std::max(kShortest_s, wanted_s);
  DataSet out = data;
  out.records.clear();
  for (const Record& r : data.records) {
    const auto wanted =
        static_cast<std::size_t>(may_be_cut(r) ? std::floor(length_s(r.series) / part_s) : 1.0);
    const std::size_t parts = std::min(wanted, r.series.size() / kFewestSamples);
    if (parts < 2) {
      out.records.push_back(r);
      continue;
    }
    cut.push_back(r.id);
    for (std::size_t n = 0; n < parts; ++n) {
      Record part = r;
      const std::size_t from = n * r.series.size() / parts, to = (n + 1) * r.series.size() / parts;
      part.series = between(r.series, from, to);
      part.id = fmt::format("{} from {:.3g} s", r.id, static_cast<double>(from) * r.series.sample_time_s);
      out.records.push_back(std::move(part));
    }
  }
  return out;
}

}  // namespace imrig::est
