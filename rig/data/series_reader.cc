#include "rig/data/series_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "rig/base/error.h"
#include "rig/data/column_picker.h"
#include "rig/data/column_quality.h"
#include "rig/data/short_holes.h"
#include "rig/data/uniform.h"

namespace imrig {

namespace {

using Column = std::vector<double>;

// The three columns a, b, c or the two alpha, beta, as read.
struct VectorColumns {
  std::vector<Column> parts;
  NoiseOf noise = NoiseOf::kThreePhases;
  int derived = -1;  // the one of three that follows from the others
};

// Of three columns that sum to zero by themselves one may be missing: instruments with two sensors are
// common.
VectorColumns three_phases(ColumnPicker& pick, const std::string& symbol, const std::string& unit,
                           bool sums_to_zero) {
  VectorColumns out;
  int missing = -1, count = 0;
  const char* const letters[] = {"a", "b", "c"};
  for (int k = 0; k < 3; ++k) {
    if (pick.has(symbol + "_" + letters[k] + "_" + unit)) continue;
    missing = k;
    ++count;
  }
  const bool derive = sums_to_zero && count == 1;
  for (int k = 0; k < 3; ++k) {
    const std::string name = symbol + "_" + letters[k] + "_" + unit;
    out.parts.push_back(derive && k == missing ? Column{} : pick.need(name));
  }
  if (!derive) return out;
  out.noise = NoiseOf::kTwoPhases;
  out.derived = missing;
  return out;
}

void derive(VectorColumns& columns) {
  if (columns.derived < 0) return;
  const auto lost = static_cast<std::size_t>(columns.derived);
  const Column& x = columns.parts[(lost + 1) % 3];
  const Column& y = columns.parts[(lost + 2) % 3];
  columns.parts[lost].resize(x.size());
  for (std::size_t k = 0; k < x.size(); ++k) columns.parts[lost][k] = -(x[k] + y[k]);
}

VectorColumns vector_columns(ColumnPicker& pick, const std::string& symbol, const std::string& unit,
                             bool sums_to_zero) {
  const std::string alpha = symbol + "_alpha_" + unit, beta = symbol + "_beta_" + unit;
  if (!pick.has(alpha) && !pick.has(beta)) return three_phases(pick, symbol, unit, sums_to_zero);
  return {{pick.need(alpha), pick.need(beta)}, NoiseOf::kAlphaBeta};
}

std::vector<SpaceVector> to_vectors(const VectorColumns& columns, SpaceVector factor) {
  const auto& p = columns.parts;
  std::vector<SpaceVector> out(p[0].size());
  for (std::size_t k = 0; k < out.size(); ++k) {
    out[k] = p.size() == 2 ? SpaceVector(p[0][k], p[1][k]) : space_vector(p[0][k], p[1][k], p[2][k]);
    if (factor != SpaceVector{1.0, 0.0}) out[k] *= factor;
  }
  return out;
}

// Everything of the file that the series needs, row by row.
struct Rows {
  Column t_s;
  VectorColumns v, i;
  Column speed_rad_s, torque_Nm, stator_C, segment, gates_on;
};

bool may_stand_still(RecordKind kind) {
  return kind == RecordKind::kDc || kind == RecordKind::kStandstill || kind == RecordKind::kLockedSweep;
}

Column read_speed(ColumnPicker& pick, RecordKind kind) {
  if (pick.has("speed_rad_s")) return pick.take("speed_rad_s");
  if (!pick.has("speed_rpm") && may_stand_still(kind)) return Column(pick.rows(), 0.0);
  Column speed = pick.need("speed_rpm");
  for (double& value : speed) value = rad_s_of_rpm(value);
  return speed;
}

Column read_time(ColumnPicker& pick, const RecordSpec& spec) {
  if (pick.has("t_s")) return pick.take("t_s");
  if (std::isnan(spec.sample_time_s)) {
    throw Error(spec.where, "has neither sample_time_s nor a column t_s", "one of them is needed");
  }
  Column t_s(pick.rows());
  for (std::size_t k = 0; k < t_s.size(); ++k) t_s[k] = static_cast<double>(k) * spec.sample_time_s;
  return t_s;
}

Rows read_rows(ColumnPicker& pick, const RecordSpec& spec, Wiring wiring) {
  Rows rows;
  const bool line_currents = !(wiring.delta && wiring.quantities == Quantities::kPhase);
  rows.v = vector_columns(pick, "v", "V", wiring.quantities == Quantities::kLine || wiring.delta);
  rows.i = vector_columns(pick, "i", "A", line_currents);
  rows.speed_rad_s = read_speed(pick, spec.kind);
  rows.torque_Nm = pick.has("torque_Nm") ? pick.take("torque_Nm") : pick.take("load_torque_Nm");
  rows.stator_C = pick.take("stator_C");
  rows.segment = pick.take("segment");
  rows.gates_on = pick.take("gates_on");
  rows.t_s = read_time(pick, spec);
  return rows;
}

// A speed that is sampled less often than the currents is joined by straight lines; longer holes stay.
constexpr double kLongestSpeedHole_s = 0.05;

void fill_speed(const Column& t_s, Column& speed, std::vector<std::string>& warnings) {
  std::size_t filled = 0, last = speed.size();
  for (std::size_t k = 0; k < speed.size(); ++k) {
    if (std::isnan(speed[k])) continue;
    if (last < k && k - last > 1 && t_s[k] - t_s[last] <= kLongestSpeedHole_s) {
      for (std::size_t m = last + 1; m < k; ++m) {
        speed[m] = speed[last] + (speed[k] - speed[last]) * (t_s[m] - t_s[last]) / (t_s[k] - t_s[last]);
      }
      filled += k - last - 1;
    }
    last = k;
  }
  if (filled > 0)
    warnings.push_back(fmt::format("speed is missing in {} rows; joined by straight lines", filled));
}

void fill_cells(Rows& rows, std::vector<std::string>& warnings) {
  std::size_t filled = 0;
  for (auto* side : {&rows.v, &rows.i}) {
    for (auto& part : side->parts) {
      if (!part.empty()) filled += fill_short_holes(rows.t_s, part);
    }
    derive(*side);
  }
  if (filled > 0)
    warnings.push_back(
        fmt::format("{} values of voltage or current are missing; filled from their neighbours", filled));
}

// A supply of some Hz asks for it; slower logs are usually ones whose times are in ms.
constexpr double kSlowest_s = 5e-3;

void tell_slow(const RecordSpec& spec, double sample_time_s, std::vector<std::string>& warnings) {
  if (may_stand_still(spec.kind) || spec.kind == RecordKind::kCoastDown || sample_time_s <= kSlowest_s)
    return;
  warnings.push_back(fmt::format(
      "a sample every {:.4g} s cannot follow the supply; are the times in ms or us? (scale in dataset.toml)",
      sample_time_s));
}

std::vector<std::uint8_t> complete_rows(const Rows& rows) {
  std::vector<std::uint8_t> complete(rows.speed_rad_s.size(), 1);
  const auto demand = [&complete](const Column& x) {
    for (std::size_t k = 0; k < x.size(); ++k) complete[k] = std::isnan(x[k]) ? std::uint8_t{0} : complete[k];
  };
  for (const auto& part : rows.v.parts) demand(part);
  for (const auto& part : rows.i.parts) demand(part);
  demand(rows.speed_rad_s);
  return complete;
}

void drop_if_empty(Column& x) {
  if (std::all_of(x.begin(), x.end(), [](double value) { return std::isnan(value); })) x.clear();
}

template <class T>
std::vector<T> whole_numbers(const Column& x, double low, double high, const std::string& where) {
  std::vector<T> out;
  for (const double value : x) {
    if (!(value >= low && value <= high) || value != std::floor(value)) {
      throw Error(where, fmt::format("segment or gates_on holds {}", value),
                  fmt::format("whole numbers from {} to {} belong there", low, high));
    }
    out.push_back(static_cast<T>(value));
  }
  return out;
}

TimeSeries cut(const Rows& rows, const UniformStretch& stretch, const RecordSpec& spec, Wiring wiring) {
  const auto kept = [&](const Column& x) { return take(stretch, rows.t_s, x); };
  const auto kept_vector = [&](const VectorColumns& columns, SpaceVector factor) {
    VectorColumns part;
    for (const auto& column : columns.parts) part.parts.push_back(kept(column));
    return to_vectors(part, factor);
  };
  TimeSeries series;
  series.sample_time_s = stretch.sample_time_s;
  series.first_index = spec.first_index;
  series.voltage_filter_s = spec.voltage_filter_s;
  series.v = kept_vector(rows.v, voltage_to_star(wiring));
  series.i = kept_vector(rows.i, current_to_star(wiring));
  series.speed_rad_s = kept(rows.speed_rad_s);
  series.torque_Nm = kept(rows.torque_Nm);
  series.stator_C = kept(rows.stator_C);
  // Words, not quantities: never interpolated.
  UniformStretch as_it_is = stretch;
  as_it_is.interpolate = false;
  series.segment = whole_numbers<std::int32_t>(take(as_it_is, rows.t_s, rows.segment), -2147483648.0,
                                               2147483647.0, spec.where);
  series.gates_on =
      whole_numbers<std::uint8_t>(take(as_it_is, rows.t_s, rows.gates_on), 0.0, 1.0, spec.where);
  return series;
}

// A file with its own time stamps may be told the sample time as well; then both must agree, and the round
// figure is the exact one.
void settle_sample_time(const RecordSpec& spec, UniformStretch& stretch) {
  if (std::isnan(spec.sample_time_s)) return;
  if (std::abs(stretch.sample_time_s / spec.sample_time_s - 1.0) > 0.01) {
    throw Error(spec.where,
                fmt::format("sample_time_s is {} s, but t_s advances by {:.6g} s", spec.sample_time_s,
                            stretch.sample_time_s),
                "leave out the wrong one");
  }
  if (!stretch.interpolate) stretch.sample_time_s = spec.sample_time_s;
}

void tell_columns(const Rows& rows, const RecordSpec& spec, std::vector<std::string>& warnings) {
  if (spec.kind == RecordKind::kDc || spec.kind == RecordKind::kStandstill) return;
  const char* const phases[] = {"a", "b", "c"};
  for (const auto* side : {&rows.v, &rows.i}) {
    if (side->noise != NoiseOf::kThreePhases) continue;
    const std::string symbol = side == &rows.v ? "v" : "i";
    for (std::size_t k = 0; k < 3; ++k) {
      const auto found = clipped(side->parts[k]);
      if (!found.empty()) warnings.push_back(symbol + "_" + phases[k] + " " + found);
    }
  }
}

}  // namespace

SeriesRead read_series(const RecordSpec& spec, const ColumnTable& table, Wiring wiring) {
  SeriesRead out;
  ColumnPicker pick(spec, table);
  Rows rows = read_rows(pick, spec, wiring);
  out.current = rows.i.noise;
  out.voltage = rows.v.noise;
  const auto unused = pick.unused();
  if (!unused.empty()) out.warnings.push_back(fmt::format("columns not used: {}", fmt::join(unused, ", ")));
  fill_speed(rows.t_s, rows.speed_rad_s, out.warnings);
  fill_cells(rows, out.warnings);
  drop_if_empty(rows.torque_Nm);
  drop_if_empty(rows.stator_C);
  UniformStretch stretch = uniform_stretch(rows.t_s, complete_rows(rows));
  out.refused = stretch.reason;
  if (!out.refused.empty()) return out;
  settle_sample_time(spec, stretch);
  tell_slow(spec, stretch.sample_time_s, out.warnings);
  out.warnings.insert(out.warnings.end(), stretch.warnings.begin(), stretch.warnings.end());
  tell_columns(rows, spec, out.warnings);
  if (rows.i.noise == NoiseOf::kThreePhases && wiring.quantities != Quantities::kStarEquivalent) {
    const auto sum = uneven_sum(rows.i.parts[0], rows.i.parts[1], rows.i.parts[2]);
    if (!sum.empty()) out.warnings.push_back("the three currents " + sum);
  }
  out.series = cut(rows, stretch, spec, wiring);
  return out;
}

}  // namespace imrig
