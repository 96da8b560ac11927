#include "rig/data/quality.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "rig/data/column_quality.h"
#include "rig/data/conditions.h"
#include "rig/data/speed_check.h"

namespace imrig {

namespace {

using Sentences = std::vector<std::string>;

constexpr double kLowestImpedance_ohm = 0.05;  // a running 1 MW low-voltage motor has about 0.15
constexpr double kHighestImpedance_ohm = 2e4;
constexpr double kLowVoltage_V = 600.0,
                 kLargest_VA = 2.5e5;   // peak of a phase; beyond any bench at low voltage
constexpr double kUnbalance = 0.3;      // negative over positive sequence
constexpr double kMotoring = 0.005;     // slip above which power must flow in
constexpr double kTooMuchPower = 1.05;  // p_in over 3/2 V I

bool runs(RecordKind kind) {
  return kind == RecordKind::kNoLoad || kind == RecordKind::kSteady || kind == RecordKind::kStep ||
         kind == RecordKind::kFree;
}

void look_for_missing(const std::vector<double>& x, const char* name, Sentences& out) {
  const auto missing = std::count_if(x.begin(), x.end(), [](double value) { return std::isnan(value); });
  if (missing > 0) out.push_back(fmt::format("{} misses {} of {} values", name, missing, x.size()));
}

void look_for_constant(const std::vector<double>& x, const char* name, Sentences& out) {
  if (x.size() < 2 || std::any_of(x.begin(), x.end(), [&x](double value) { return value != x.front(); }))
    return;
  out.push_back(fmt::format("{} is constant at {:.6g}: not connected?", name, x.front()));
}

void look_at_vector(const std::vector<SpaceVector>& x, const char* name, RecordKind kind, Sentences& out) {
  const bool steady_by_nature = kind == RecordKind::kDc || kind == RecordKind::kStandstill;
  if (x.empty()) return;
  std::array<std::vector<double>, 3> phase;
  bool all_zero = true;
  for (const auto& value : x) {
    const auto abc = phases(value);
    for (std::size_t k = 0; k < 3; ++k) phase[k].push_back(abc[k]);
    all_zero = all_zero && value == SpaceVector{};
  }
  const bool may_be_zero = kind == RecordKind::kCoastDown && name[0] == 'v';
  if (all_zero && !may_be_zero) out.push_back(fmt::format("{} is zero throughout: not connected?", name));
  if (all_zero || steady_by_nature) return;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::string own = fmt::format("{} of phase {}", name, "abc"[k]);
    look_for_constant(phase[k], own.c_str(), out);
    if (const auto found = clipped(phase[k]); !found.empty()) out.push_back(own + " " + found);
  }
}

// Amplitude of x at a signed frequency, after the mean is taken off: an offset is no sequence.
double amplitude_at(const std::vector<SpaceVector>& x, double f_Hz, double sample_time_s) {
  SpaceVector mean{}, sum{};
  for (const auto& value : x) mean += value;
  mean /= static_cast<double>(x.size());
  for (std::size_t k = 0; k < x.size(); ++k) {
    sum += (x[k] - mean) * std::polar(1.0, -2.0 * kPi * f_Hz * sample_time_s * static_cast<double>(k));
  }
  return std::abs(sum) / static_cast<double>(x.size());
}

const char* direction(double f_Hz) { return f_Hz > 0.0 ? "a-b-c" : "a-c-b"; }

// Voltage and current of one machine turn the same way, and the current lags.
void look_at_phases(const TimeSeries& s, const Fundamental& v, double slip, Sentences& out) {
  const double f = v.f_Hz;
  if (static_cast<double>(s.size()) * s.sample_time_s * std::abs(f) < 2.0) return;  // too short to tell
  const double positive = amplitude_at(s.i, f, s.sample_time_s),
               negative = amplitude_at(s.i, -f, s.sample_time_s);
  if (negative > positive / kUnbalance) {
    out.push_back(fmt::format(
        "voltage turns {} at {:.4g} Hz but the current turns {}: two phases of one of them are swapped",
        direction(f), std::abs(f), direction(-f)));
    return;
  }
  if (negative > kUnbalance * positive) {
    out.push_back(
        fmt::format("the current's opposite sequence is {:.0f} % of the main one: a sensor's sign or scale, "
                    "or a phase, is wrong",
                    100.0 * negative / positive));
    return;
  }
  SpaceVector i{};
  for (std::size_t k = 0; k < s.size(); ++k)
    i += s.i[k] * std::polar(1.0, -2.0 * kPi * f * s.sample_time_s * static_cast<double>(k));
  const double lag_deg = std::arg(v.amplitude * std::conj(i)) * 180.0 / kPi * (f > 0.0 ? 1.0 : -1.0);
  if (lag_deg < -5.0 || lag_deg > 175.0) {
    out.push_back(
        fmt::format("the current leads the voltage by {:.0f} degrees, but an induction motor's lags: phases "
                    "are shifted, two are "
                    "swapped in both, or a sign is reversed",
                    lag_deg < 0.0 ? -lag_deg : 360.0 - lag_deg));
  } else if (lag_deg > 90.0 && slip > kMotoring) {
    out.push_back(
        fmt::format("power flows out of the motor (the current lags by {:.0f} degrees) although the slip is "
                    "{:.2g} %: phases are "
                    "shifted or a sign is reversed",
                    lag_deg, 100.0 * slip));
  }
}

void look_at_impedance(double v_V, double i_A, Sentences& out) {
  if (!(i_A > 0.0) || !(v_V > 0.0)) return;
  const double Z = v_V / i_A, S = 1.5 * v_V * i_A;
  if (Z >= kLowestImpedance_ohm && Z <= kHighestImpedance_ohm) {
    if (v_V < kLowVoltage_V && S > kLargest_VA)
      out.push_back(
          fmt::format("{:.4g} V and {:.4g} A are {:.3g} kVA: a very large motor, or currents in mA?", v_V,
                      i_A, 1e-3 * S));
    return;
  }
  out.push_back(fmt::format(
      "{:.4g} V over {:.4g} A is {:.3g} ohm, which no such motor has: {}", v_V, i_A, Z,
      Z < kLowestImpedance_ohm ? "currents in mA or voltages in kV?" : "currents in kA or voltages in mV?"));
}

void look_at_series(const Record& record, int pole_pairs, Sentences& out) {
  const TimeSeries& s = record.series;
  if (s.size() == 0) return;
  look_at_vector(s.v, "voltage", record.kind, out);
  look_at_vector(s.i, "current", record.kind, out);
  look_for_missing(s.torque_Nm, "torque_Nm", out);
  look_for_missing(s.stator_C, "stator_C", out);
  look_for_constant(s.torque_Nm, "torque_Nm", out);
  const Conditions c = conditions_of(record, pole_pairs);
  const bool turning = !std::isnan(c.f_Hz) && std::abs(c.f_Hz) > 1.0;
  if (s.v.size() == s.i.size() && turning && c.v_V > 0.0)
    look_at_phases(s, fundamental_of(s.v, s.sample_time_s), c.slip, out);
  if (!runs(record.kind)) return;
  look_at_impedance(c.v_V, c.i_A, out);
  // A free record may stand still for a part: its fastest stretch is what the frequency must explain.
  const double speed = record.kind == RecordKind::kFree ? fastest(s.speed_rad_s) : c.speed_rad_s;
  if (turning) {
    if (const auto found = coarse_speed(s.speed_rad_s, c.f_Hz, pole_pairs); !found.empty())
      out.push_back(found);
    if (const auto found = implausible_speed(speed, c.f_Hz, pole_pairs, record.kind == RecordKind::kFree);
        !found.empty())
      out.push_back(found);
  }
}

// The sentence that most of the points would earn, with how many do.
void tell_most(const std::vector<std::string>& found, std::size_t total, Sentences& out) {
  if (found.empty()) return;
  out.push_back(found.size() == 1 && total == 1
                    ? found.front()
                    : fmt::format("in {} of {} points: {}", found.size(), total, found.front()));
}

std::string odd_power(const SteadyPoint& p) {
  const double apparent = 1.5 * p.v_peak_V * p.i_peak_A;
  if (!(apparent > 0.0)) return "";
  const double ratio = p.p_in_W / apparent;
  if (ratio > kTooMuchPower) {
    return fmt::format(
        "{:.5g} W is more than the {:.5g} VA of voltage and current: line and phase values mixed up, or "
        "units",
        p.p_in_W, apparent);
  }
  if (std::abs(p.power_factor) > 0.05 && ratio / p.power_factor < 0.9) {
    return fmt::format(
        "{:.5g} W over {:.5g} VA is a power factor of {:.3g}, but {:.3g} is given: line and phase values "
        "mixed up, or units",
        p.p_in_W, apparent, ratio, p.power_factor);
  }
  return "";
}

std::string odd_output(const SteadyPoint& p) {
  const double shaft = std::isnan(p.p_out_W) ? p.torque_Nm * p.speed_rad_s : p.p_out_W;
  if (!(p.p_in_W > 0.0) || !(shaft > p.p_in_W)) return "";
  return fmt::format("{:.5g} W at the shaft is more than the {:.5g} W taken in: units or signs are wrong",
                     shaft, p.p_in_W);
}

void look_at_points(const Record& record, int pole_pairs, Sentences& out) {
  std::array<Sentences, 4> found;
  for (const auto& p : record.points) {
    const auto keep = [](Sentences& list, std::string sentence) {
      if (!sentence.empty()) list.push_back(std::move(sentence));
    };
    keep(found[0], implausible_speed(p.speed_rad_s, p.f_Hz, pole_pairs, false));
    keep(found[1], odd_power(p));
    keep(found[2], odd_output(p));
    look_at_impedance(p.v_peak_V, p.i_peak_A, found[3]);
  }
  for (const auto& list : found) tell_most(list, record.points.size(), out);
  std::vector<double> current, power;
  for (const auto& p : record.points) {
    current.push_back(p.i_peak_A);
    power.push_back(p.p_in_W);
  }
  look_for_missing(current, "the current column", out);
  look_for_missing(power, "p_in_W", out);
}

}  // namespace

std::vector<std::string> quality_of(const Record& record, int pole_pairs) {
  Sentences out;
  if (record.kind == RecordKind::kPoints) {
    look_at_points(record, pole_pairs, out);
  } else {
    look_at_series(record, pole_pairs, out);
  }
  return out;
}

void add_quality_warnings(DataSet& data) {
  for (auto& record : data.records) {
    for (auto& sentence : quality_of(record, data.pole_pairs)) {
      const bool known =
          std::find(record.warnings.begin(), record.warnings.end(), sentence) != record.warnings.end();
      if (!known) record.warnings.push_back(std::move(sentence));
    }
  }
}

}  // namespace imrig
