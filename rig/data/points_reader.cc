#include "rig/data/points_reader.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "rig/base/error.h"
#include "rig/data/column_picker.h"

namespace imrig {

namespace {

constexpr std::size_t kMaxPoints = 1000000;
using Column = std::vector<double>;

// rms column times sqrt2, or the peak column as it is; then to the star.
Column peak_values(ColumnPicker& pick, const std::string& rms_name, const std::string& peak_name,
                   double to_star, bool needed) {
  if (pick.has(peak_name)) {
    Column x = pick.take(peak_name);
    if (to_star != 1.0) {
      for (double& value : x) value *= to_star;
    }
    return x;
  }
  Column x = needed ? pick.need(rms_name) : pick.take(rms_name);
  for (double& value : x) value *= std::numbers::sqrt2 * to_star;
  return x;
}

Column speed_values(ColumnPicker& pick) {
  if (pick.has("speed_rad_s")) return pick.take("speed_rad_s");
  Column speed = pick.need("speed_rpm");
  for (double& value : speed) value = rad_s_of_rpm(value);
  return speed;
}

void fill(std::vector<SteadyPoint>& points, const Column& x, double SteadyPoint::*place) {
  for (std::size_t k = 0; k < x.size(); ++k) points[k].*place = x[k];
}

double factor_of(SpaceVector to_star) { return to_star == SpaceVector{1.0, 0.0} ? 1.0 : std::abs(to_star); }

void drop_incomplete(PointsRead& out) {
  const std::size_t before = out.points.size();
  std::erase_if(out.points, [](const SteadyPoint& p) {
    const bool driven = p.v_peak_V > 0.0 && p.f_Hz > 0.0 && !std::isnan(p.speed_rad_s);
    return !driven || (std::isnan(p.i_peak_A) && std::isnan(p.p_in_W));
  });
  const std::size_t lost = before - out.points.size();
  if (lost > 0) {
    out.warnings.push_back(fmt::format(
        "{} of {} points left out: voltage, frequency, speed or both of current and power are missing or not "
        "positive",
        lost, before));
  }
  if (out.points.empty()) out.refused = "holds no point with voltage, frequency, speed and current or power";
}

}  // namespace

PointsRead read_points(const RecordSpec& spec, const ColumnTable& table, Wiring wiring) {
  PointsRead out;
  ColumnPicker pick(spec, table);
  const Column v = peak_values(pick, "v_rms_V", "v_peak_V", factor_of(voltage_to_star(wiring)), true);
  if (v.size() > kMaxPoints)
    throw Error(table.file, fmt::format("holds {} points", v.size()),
                fmt::format("at most {} are read", kMaxPoints));
  if (pick.has("v_peak_V")) out.noise = NoiseOf::kPeak;
  out.points.resize(v.size());
  fill(out.points, v, &SteadyPoint::v_peak_V);
  fill(out.points, pick.need("f_Hz"), &SteadyPoint::f_Hz);
  const bool current_needed = !pick.has("p_in_W");
  fill(out.points,
       peak_values(pick, "i_rms_A", "i_peak_A", factor_of(current_to_star(wiring)), current_needed),
       &SteadyPoint::i_peak_A);
  fill(out.points, speed_values(pick), &SteadyPoint::speed_rad_s);
  fill(out.points, pick.take("p_in_W"), &SteadyPoint::p_in_W);
  fill(out.points, pick.take("q_var"), &SteadyPoint::q_var);
  fill(out.points, pick.take("power_factor"), &SteadyPoint::power_factor);
  fill(out.points, pick.take("torque_Nm"), &SteadyPoint::torque_Nm);
  fill(out.points, pick.take("p_out_W"), &SteadyPoint::p_out_W);
  fill(out.points, pick.take("stator_C"), &SteadyPoint::stator_C);
  const auto unused = pick.unused();
  if (!unused.empty()) out.warnings.push_back(fmt::format("columns not used: {}", fmt::join(unused, ", ")));
  drop_incomplete(out);
  return out;
}

}  // namespace imrig
