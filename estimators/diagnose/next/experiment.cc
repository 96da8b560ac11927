#include "estimators/diagnose/next/experiment.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "estimators/model/steady_state.h"
#include "rig/base/space_vector.h"

namespace imrig::est {

namespace {

// As rig/campaign keeps them (docs/campaigns.md).
constexpr double kCurrentMargin = 0.85, kSpeedMargin = 0.95, kPullOutMargin = 0.7, kMostSlip = 0.14;
constexpr double kHeldShare = 0.18;  // of the friction: a torque that surely turns no shaft
constexpr double kLowCurrent = 0.075;
constexpr double kAxis_Hz =
    30.0;  // above it the samples of an alternating voltage are too coarse for the fit
constexpr std::size_t kFewest = 3;

class Builder {
 public:
  Builder(const RigRange& range, const MachineParameters<double>& motor, int pole_pairs)
      : range_(range), motor_(motor), pole_pairs_(pole_pairs) {}

  // Frequency over rated, flux (volts per hertz) over rated, share of the largest load.
  void running(Experiment& out, RecordKind kind, double f, double flux, double load, double step) const {
    PlannedRecord r;
    r.kind = kind;
    r.f_Hz = f * range_.rated_Hz;
    r.v_peak_V = flux * f * range_.rated_V;
    r.load_share = load;
    r.step = step;
    if (kind == RecordKind::kStep) r.before_s = 0.05, r.record_s = r.simulated_s;
    const double w = 2.0 * kPi * r.f_Hz;
    if (r.v_peak_V * (1.0 + step) > range_.voltage_V * (1.0 + 1e-9)) return;
    if (w / pole_pairs_ > range_.speed_rad_s * (1.0 + 1e-9)) return;
    const PullOut most = pull_out(motor_, pole_pairs_, r.v_peak_V, w);
    const double friction = friction_Nm(f, flux);
    if (friction > kPullOutMargin * most.torque_Nm) return;
    const double transient = transient_A(r);
    const double least = slip_at(r, friction), highest = largest_slip(r, most, transient);
    if (highest < least) return;
    const double top = torque_at(r, highest);
    r.slip = slip_at(r, friction + load * std::max(0.0, top - friction));
    out.records.push_back(r);
  }

  void locked(Experiment& out, double f_Hz, double current_A, bool axis, double simulated_s) const {
    PlannedRecord r;
    r.kind = RecordKind::kLockedSweep;
    r.f_Hz = f_Hz;
    r.slip = 1.0;
    r.axis = axis;
    r.current_A = current_A;
    r.simulated_s = simulated_s;
    r.record_s = std::max(0.5, 2.0 / f_Hz);
    const auto at_1V = steady_state(motor_, pole_pairs_, 1.0, 2.0 * kPi * f_Hz, 0.0);
    r.v_peak_V = current_A / at_1V.current_A;
    if (r.v_peak_V > range_.voltage_V || current_A > range_.current_A) return;
    const double torque = at_1V.torque_Nm * r.v_peak_V * r.v_peak_V;
    if (!axis && std::isfinite(range_.friction_Nm) && torque > kHeldShare * range_.friction_Nm) return;
    out.records.push_back(r);
  }

 private:
  // Without a rig: what a motor of its kind takes.
  double friction_Nm(double f, double flux) const {
    if (std::isfinite(range_.friction_Nm)) return f * range_.friction_Nm;
    const double rated = pull_out(motor_, pole_pairs_, range_.rated_V, 2.0 * kPi * range_.rated_Hz).torque_Nm;
    return 0.01 * f * std::min(1.0, flux * flux) * rated;
  }
  // A voltage step meets R_s + R_r + j w L_l; its direct component may add to it.
  double transient_A(const PlannedRecord& r) const {
    const double R = motor_.R_s + motor_.R_r, X = 2.0 * kPi * r.f_Hz * motor_.L_l;
    return std::abs(r.step) * r.v_peak_V / std::hypot(R, X) * (1.0 + std::exp(-kPi * R / X));
  }
  SteadyState<double> at(const PlannedRecord& r, double slip) const {
    const double w = 2.0 * kPi * r.f_Hz;
    return steady_state(motor_, pole_pairs_, r.v_peak_V, w, w * (1.0 - slip));
  }
  double torque_at(const PlannedRecord& r, double slip) const { return at(r, slip).torque_Nm; }
  double slip_at(const PlannedRecord& r, double torque_Nm) const {
    return slip_for_torque(motor_, pole_pairs_, r.v_peak_V, 2.0 * kPi * r.f_Hz, torque_Nm).value_or(1.0);
  }
  double largest_slip(const PlannedRecord& r, const PullOut& most, double transient) const {
    double slip = std::min(kMostSlip, slip_at(r, kPullOutMargin * most.torque_Nm));
    while (slip > 1e-4 && at(r, slip).current_A + transient > range_.current_A) slip *= 0.95;
    return slip > 1e-4 ? slip : -1.0;
  }

  RigRange range_;
  MachineParameters<double> motor_;
  int pole_pairs_;
};

Experiment twice(Experiment once) {
  Experiment out = once;
  out.name += ", cold and hot";
  out.cold_and_hot = true;
  for (PlannedRecord& r : out.records) r.heat = 0.0;
  for (PlannedRecord& r : once.records) {
    r.heat = 1.0;
    out.records.push_back(r);
  }
  return out;
}

}  // namespace

RigRange range_of(const RigConfig& rig) {
  RigRange out;
  out.current_A = kCurrentMargin * rig.limits.current_A;
  out.voltage_V = rig.limits.voltage_V;
  out.speed_rad_s = kSpeedMargin * rad_s_of_rpm(rig.limits.speed_rpm);
  out.rated_V = rig.motor.rated_voltage_V * std::sqrt(2.0 / 3.0);
  out.rated_Hz = rig.motor.rated_frequency_Hz;
  out.friction_Nm = rig.motor.friction_Nm;
  out.from_rig = true;
  return out;
}

RigRange range_of(const GlobalProblem& problem, const Model& model) {
  RigRange out;
  out.current_A = problem.largest_current_A();
  const int pole_pairs = problem.data().pole_pairs;
  for (const GlobalProblem::Entry& e : problem.entries()) {
    if (e.series) {
      const FrameRecord& frame = e.series->frame;
      for (std::size_t k = frame.judged_from; k < frame.size(); ++k)
        out.voltage_V = std::max(out.voltage_V, std::abs(frame.v[k]));
      out.speed_rad_s = std::max(out.speed_rad_s, std::abs(frame.w_k) / pole_pairs);
    }
    for (const SteadyPoint& p : e.point) {
      out.voltage_V = std::max(out.voltage_V, p.v_peak_V);
      out.speed_rad_s = std::max(out.speed_rad_s, 2.0 * kPi * p.f_Hz / pole_pairs);
    }
  }
  out.rated_V = out.voltage_V;
  out.rated_Hz = out.voltage_V / (2.0 * kPi * problem.largest_flux_Wb());
  if (model.ratings.voltage_V > 0.0 && model.ratings.frequency_Hz > 0.0) {
    out.rated_V = model.ratings.voltage_V * std::sqrt(2.0 / 3.0);
    out.rated_Hz = model.ratings.frequency_Hz;
  }
  return out;
}

std::vector<Experiment> menu(const RigRange& range, const MachineParameters<double>& motor, int pole_pairs) {
  const Builder build(range, motor, pole_pairs);
  const double per_unit_Hz = range.rated_Hz / 60.0;
  Experiment low{"a locked-like frequency sweep at low current and constant temperature", {}, false};
  for (const double f : {5.0, 8.0, 12.0, 20.0, 32.0, 50.0, 80.0, 120.0})
    build.locked(low, f * per_unit_Hz, kLowCurrent * range.current_A, false, 0.2);
  Experiment axis{"a locked-like frequency sweep along one axis at half the largest current", {}, false};
  for (const double f : {2.0, 4.0, 8.0, 15.0, 30.0})
    build.locked(axis, std::min(kAxis_Hz, f * per_unit_Hz), 0.5 * range.current_A, true,
                 std::max(0.15, 1.0 / f));
  Experiment slow{"a current sweep along one axis at 2 Hz, nearly DC", {}, false};
  for (const double share : {0.08, 0.2, 0.4, 0.65, 0.95})
    build.locked(slow, 2.0, share * range.current_A, true, 0.3);
  Experiment current{"a locked-like current sweep along one axis at a fixed frequency", {}, false};
  for (const double share : {0.1, 0.25, 0.4, 0.6, 0.8, 0.98})
    build.locked(current, 0.8 * kAxis_Hz, share * range.current_A, true, 0.15);
  Experiment voltage{"a no-load voltage sweep at rated frequency", {}, false};
  Experiment slower{"a no-load voltage sweep at half the rated frequency", {}, false};
  for (const double flux : {0.2, 0.35, 0.55, 0.75, 0.95, 1.15}) {
    build.running(voltage, RecordKind::kNoLoad, 1.0, flux, 0.0, 0.0);
    build.running(slower, RecordKind::kNoLoad, 0.5, flux, 0.0, 0.0);
  }
  Experiment frequency{"a no-load frequency sweep at constant flux", {}, false};
  for (const double f : {0.25, 0.45, 0.65, 0.85, 1.1, 1.35})
    build.running(frequency, RecordKind::kNoLoad, f, 0.85, 0.0, 0.0);
  Experiment some_low{low.name, {}, false};
  for (std::size_t k = 0; k < low.records.size(); k += 2) some_low.records.push_back(low.records[k]);
  Experiment grid{"a grid of flux and load at one frequency", {}, false};
  Experiment steps{"voltage steps at several frequencies and loads", {}, false};
  Experiment some{"voltage steps at two frequencies and loads", {}, false};
  for (const double load : {0.0, 0.5, 1.0}) {
    for (const double flux : {0.35, 0.6, 0.9}) build.running(grid, RecordKind::kStep, 0.8, flux, load, 0.1);
    for (const double f : {0.3, 0.6, 0.95}) build.running(steps, RecordKind::kStep, f, 0.8, load, 0.15);
    if (load == 0.5) continue;
    for (const double f : {0.4, 0.8}) build.running(some, RecordKind::kStep, f, 0.8, load, 0.15);
  }
  std::vector<Experiment> out{low,       axis, slow,  current,     voltage,        slower,
                              frequency, grid, steps, twice(some), twice(some_low)};
  std::erase_if(out, [](const Experiment& e) { return e.records.size() < kFewest; });
  return out;
}

}  // namespace imrig::est
