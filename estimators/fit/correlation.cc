#include "estimators/fit/correlation.h"

#include <algorithm>
#include <cmath>

namespace imrig::est {

namespace {

constexpr std::size_t kFewest = 3;

std::array<double, 6> conditions_of(const MapPoint& point) {
  const SteadyPhasor& p = point.phasor;
  return {point.state.I_d_A, point.state.I_q_A, std::abs(p.i), p.slip_rad_s(), p.stator_C, p.time_s};
}

const MapPoint* end_of(const std::vector<MapPoint>& points, std::size_t record) {
  const auto found = std::find_if(points.begin(), points.end(), [record](const MapPoint& p) {
    return p.phasor.last && p.phasor.record == record;
  });
  return found == points.end() ? nullptr : &*found;
}

bool counts(const RecordResult& record, const std::string& name, Kept kept) {
  if (std::find(record.used_for.begin(), record.used_for.end(), name) != record.used_for.end()) return true;
  const auto found = record.parameters.find(name);
  return kept == Kept::kByCovariance && found != record.parameters.end() && found->second.by_rule;
}

int strongest(const std::array<double, 6>& value, std::size_t among) {
  int best = -1;
  for (std::size_t k = 0; k < among; ++k) {
    if (!std::isfinite(value[k])) continue;
    if (best < 0 || std::abs(value[k]) > std::abs(value[static_cast<std::size_t>(best)])) best = static_cast<int>(k);
  }
  return best;
}

// Condition known in all of the records, or nothing: a table over other records each time would mislead.
std::vector<double> column(const std::vector<std::array<double, 6>>& rows, std::size_t k) {
  std::vector<double> x;
  for (const auto& row : rows) {
    if (!std::isfinite(row[k])) return {};
    x.push_back(row[k]);
  }
  return x;
}

}  // namespace

double correlation(const std::vector<double>& x, const std::vector<double>& y) {
  if (x.size() != y.size() || x.size() < kFewest) return kMissing;
  const double n = static_cast<double>(x.size());
  double mx = 0.0, my = 0.0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    mx += x[k] / n;
    my += y[k] / n;
  }
  double xx = 0.0, yy = 0.0, xy = 0.0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    xx += (x[k] - mx) * (x[k] - mx);
    yy += (y[k] - my) * (y[k] - my);
    xy += (x[k] - mx) * (y[k] - my);
  }
  const bool varies = xx > 1e-24 * n * mx * mx && yy > 1e-24 * n * my * my;
  return varies ? xy / std::sqrt(xx * yy) : kMissing;
}

std::vector<CorrelationRow> correlation_table(const std::vector<RecordResult>& records,
                                              const std::vector<MapPoint>& points, Kept kept) {
  std::vector<CorrelationRow> table;
  for (const char* name : {"L_m", "R_r", "L_l"}) {
    CorrelationRow row;
    row.parameter = name;
    std::vector<double> y;
    std::vector<std::array<double, 6>> x;
    for (std::size_t k = 0; k < records.size(); ++k) {
      const MapPoint* point = end_of(points, k);
      if (point == nullptr || !counts(records[k], name, kept)) continue;
      y.push_back(records[k].parameters.at(name).value);
      x.push_back(conditions_of(*point));
    }
    row.records = y.size();
    for (std::size_t k = 0; k < row.value.size(); ++k) row.value[k] = correlation(column(x, k), y);
    row.strongest = strongest(row.value, kPaperConditions);
    row.strongest_of_all = strongest(row.value, row.value.size());
    table.push_back(row);
  }
  return table;
}

}  // namespace imrig::est
