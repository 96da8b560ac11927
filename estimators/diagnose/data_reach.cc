#include "estimators/diagnose/data_reach.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace imrig::est {

namespace {

constexpr double kSkinEffect_Hz =
    5.0;                            // slip frequency below which a rotor bar is thin beside its skin depth
constexpr double kSaturates = 2.0;  // ratio of currents within which a leakage path hardly changes

struct Range {
  double low = kMissing, high = kMissing;
  void add(double x) {
    low = std::fmin(low, x);
    high = std::fmax(high, x);
  }
  bool known() const { return !std::isnan(low); }
  bool varies(double share) const {
    return known() && high - low > share * std::max(std::abs(low), std::abs(high));
  }
};

struct Ranges {
  Range f, psi, i, slip_Hz, stator_C;
  bool forward = false, backward = false;
};

Ranges ranges_of(const CompareResult& result) {
  Ranges out;
  for (const ComparedRecord& record : result.records) {
    for (const Stretch& s : record.stretches) {
      const Conditions& c = s.conditions;
      out.f.add(std::abs(c.f_Hz));
      out.psi.add(c.psi_Wb);
      out.i.add(c.i_A);
      out.slip_Hz.add(std::abs(c.slip * c.f_Hz));
      out.stator_C.add(c.stator_C);
      const double turns = std::isnan(c.f_Hz) ? c.speed_rad_s : c.f_Hz;
      out.forward = out.forward || turns > 0.0;
      out.backward = out.backward || turns < 0.0;
    }
  }
  return out;
}

void reach_of_conditions(const Ranges& r, std::vector<std::string>& out) {
  if (r.psi.known() && !r.psi.varies(0.1))
    out.push_back(
        fmt::format("the flux stays near {:.3g} Wb: saturation of the main flux cannot show, it hides in L_m",
                    r.psi.high));
  if (r.i.known() && r.i.high < kSaturates * r.i.low)
    out.push_back(
        fmt::format("the current stays between {:.3g} and {:.3g} A: saturation of the leakage cannot show",
                    r.i.low, r.i.high));
  if (r.slip_Hz.known() && r.slip_Hz.high < kSkinEffect_Hz)
    out.push_back(
        fmt::format("the slip stays below {:.2g} Hz: the rotor's skin effect cannot show", r.slip_Hz.high));
  if (r.f.known() && !r.f.varies(0.1))
    out.push_back(
        fmt::format("one frequency ({:.3g} Hz): eddy-current and hysteresis loss, and a lag of the sensors, "
                    "cannot be told apart",
                    r.f.high));
  if (!r.stator_C.known())
    out.push_back(
        "no winding temperature: what looks like heating may be something else that changed from record to "
        "record");
  if (!(r.forward && r.backward) && (r.forward || r.backward))
    out.push_back("one direction of rotation: an offset of the torque sensor looks like friction");
}

bool has_torque(const Record& record) {
  const auto& torque = record.series.torque_Nm;
  if (std::any_of(torque.begin(), torque.end(), [](double T) { return std::isfinite(T); })) return true;
  const auto present = [](const SteadyPoint& p) {
    return !std::isnan(p.torque_Nm) || !std::isnan(p.p_out_W);
  };
  return std::any_of(record.points.begin(), record.points.end(), present);
}

}  // namespace

std::vector<std::string> data_reach(const DataSet& data, const CompareResult& result) {
  std::vector<std::string> out;
  reach_of_conditions(ranges_of(result), out);
  const auto& all = data.records;
  const auto count = [&](const auto& condition) { return std::count_if(all.begin(), all.end(), condition); };
  if (count(has_torque) == 0)
    out.push_back("no shaft torque or shaft power: friction, windage and stray load loss cannot show");
  if (count([](const Record& r) { return !r.series.i.empty(); }) == 0)
    out.push_back(
        "points only: no offset, unbalance, dead time or broken bar can show, and no line of the error");
  if (!std::isnan(data.noise.current_A) && std::isnan(data.noise.voltage_V) &&
      count([](const Record& r) { return !r.series.i.empty(); }) > 0)
    out.push_back(
        "noise.voltage_V is not declared: what voltage noise does to the current is missing in the floor");
  if (count([](const Record& r) { return r.holdout; }) == 0)
    out.push_back("no record is held out (holdout = true): every error here may be smaller than on new data");
  if (all.size() == 1)
    out.push_back("one record: nothing repeats, so nobody knows what would differ in the next one");
  return out;
}

}  // namespace imrig::est
