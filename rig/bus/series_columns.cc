#include "rig/bus/series_columns.h"

#include <bit>
#include <utility>

namespace imrig {

namespace {

template <class Part, class Column>
void append(const std::vector<Part>& part, std::vector<Column>& column) {
  column.insert(column.end(), part.begin(), part.end());
}

void append(const std::vector<double>& alpha, const std::vector<double>& beta,
            std::vector<SpaceVector>& column) {
  for (std::size_t k = 0; k < alpha.size(); ++k) column.emplace_back(alpha[k], beta[k]);
}

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

std::string join_series(const RawRecord& raw, TimeSeries& out) {
  const auto& first = raw.series.front();
  out.sample_time_s = first.sample_time_s;
  out.voltage_filter_s = first.voltage_filter_s;
  out.first_index = first.first_index;
  std::int64_t expected = first.first_index;
  for (const auto& part : raw.series) {
    if (part.first_index < expected) continue;  // received twice
    if (part.first_index != expected) return "its series has a gap at index " + std::to_string(expected);
    if (!same_bits(part.sample_time_s, out.sample_time_s) ||
        !same_bits(part.voltage_filter_s, out.voltage_filter_s)) {
      return "sample time or filter change within it";
    }
    append(part.i_alpha_A, part.i_beta_A, out.i);
    append(part.v_alpha_V, part.v_beta_V, out.v);
    append(part.speed_rad_s, out.speed_rad_s);
    append(part.torque_Nm, out.torque_Nm);
    append(part.stator_C, out.stator_C);
    append(part.segment, out.segment);
    append(part.gates_on, out.gates_on);
    if (__builtin_add_overflow(expected, std::int64_t{part.n_samples}, &expected))
      return "its index is impossible";
  }
  for (const std::size_t n : {out.v.size(), out.speed_rad_s.size(), out.torque_Nm.size(), out.stator_C.size(),
                              out.segment.size(), out.gates_on.size()}) {
    if (n != 0 && n != out.size()) return "its columns have different lengths";
  }
  return "";
}

void join_points(const RawRecord& raw, std::vector<SteadyPoint>& out) {
  for (const auto& m : raw.points) {
    for (std::size_t k = 0; k < static_cast<std::size_t>(m.n); ++k) {
      out.push_back({m.v_peak_V[k], m.f_Hz[k], m.i_peak_A[k], m.p_in_W[k], m.power_factor[k], m.q_var[k],
                     m.speed_rad_s[k], m.torque_Nm[k], m.p_out_W[k], m.stator_C[k]});
    }
  }
}

template <class Column, class Part>
std::int32_t cut(const std::vector<Column>& column, std::size_t first, std::size_t n,
                 std::vector<Part>& part) {
  if (column.empty()) return 0;
  const auto begin = column.begin() + static_cast<std::ptrdiff_t>(first);
  for (auto row = begin; row != begin + static_cast<std::ptrdiff_t>(n); ++row)
    part.push_back(static_cast<Part>(*row));
  return static_cast<std::int32_t>(n);
}

std::int32_t cut(const std::vector<SpaceVector>& column, std::size_t first, std::size_t n,
                 std::vector<double>& alpha, std::vector<double>& beta) {
  if (column.empty()) return 0;
  for (std::size_t k = first; k < first + n; ++k) {
    alpha.push_back(column[k].real());
    beta.push_back(column[k].imag());
  }
  return static_cast<std::int32_t>(n);
}

}  // namespace

std::string join_columns(const RawRecord& raw, Record& record) {
  if (!raw.series.empty() && !raw.points.empty()) return "it has both a time series and points";
  std::string fault;
  if (raw.series.empty()) {
    join_points(raw, record.points);
  } else {
    fault = join_series(raw, record.series);
  }
  const auto rows = static_cast<std::int64_t>(record.points.size() + record.series.size());
  if (fault.empty() && rows != raw.end->samples) {
    fault = std::to_string(raw.end->samples) + " rows were announced, " + std::to_string(rows) + " are there";
  }
  return fault;
}

imrig_msg::series_t series_rows(const TimeSeries& series, std::size_t first, std::size_t n) {
  imrig_msg::series_t m = {};
  m.first_index = series.first_index + static_cast<std::int64_t>(first);
  m.sample_time_s = series.sample_time_s;
  m.voltage_filter_s = series.voltage_filter_s;
  m.n_samples = cut(series.i, first, n, m.i_alpha_A, m.i_beta_A);
  m.n_voltage = cut(series.v, first, n, m.v_alpha_V, m.v_beta_V);
  m.n_speed = cut(series.speed_rad_s, first, n, m.speed_rad_s);
  m.n_torque = cut(series.torque_Nm, first, n, m.torque_Nm);
  m.n_stator = cut(series.stator_C, first, n, m.stator_C);
  m.n_segment = cut(series.segment, first, n, m.segment);
  m.n_gates = cut(series.gates_on, first, n, m.gates_on);
  return m;
}

imrig_msg::points_t point_rows(const std::vector<SteadyPoint>& points, std::size_t first, std::size_t n) {
  imrig_msg::points_t m = {};
  m.n = static_cast<std::int32_t>(n);
  for (std::size_t k = first; k < first + n; ++k) {
    const SteadyPoint& p = points[k];
    m.v_peak_V.push_back(p.v_peak_V);
    m.f_Hz.push_back(p.f_Hz);
    m.i_peak_A.push_back(p.i_peak_A);
    m.p_in_W.push_back(p.p_in_W);
    m.power_factor.push_back(p.power_factor);
    m.q_var.push_back(p.q_var);
    m.speed_rad_s.push_back(p.speed_rad_s);
    m.torque_Nm.push_back(p.torque_Nm);
    m.p_out_W.push_back(p.p_out_W);
    m.stator_C.push_back(p.stator_C);
  }
  return m;
}

}  // namespace imrig
