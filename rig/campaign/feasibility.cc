#include "rig/campaign/feasibility.h"

#include <fmt/format.h>

#include <cmath>
#include <numeric>

#include "rig/base/generator.h"
#include "rig/base/space_vector.h"

namespace imrig {

namespace {

constexpr double kLeastSlip = 1e-4;
constexpr double kCurrentMargin = 0.85;  // of the rig's limit, where the plan says nothing
constexpr double kSpeedMargin = 0.95;
constexpr double kSticking = 0.2;  // share of the no-load torque that the bearings hold at rest for certain
constexpr int kBisections = 48;
constexpr double kSwing = 3.0;  // rotor and field swing at low frequency; peaks on the emulated 5 hp bench
                                // stay below this many times

double limit_or(double plan, double rig, double margin) {
  return std::isnan(plan) ? margin * rig : std::min(plan, rig);
}

// Slip between none and pull-out at which the motor gives the torque asked for; the pull-out slip when it
// cannot.
double slip_on_branch(const SteadyPredictor& predict, double v_peak_V, double frequency_Hz,
                      const PullOut& pull_out, const std::function<double(double slip)>& torque_Nm) {
  double low = 0.0;
  double high = pull_out.slip;
  for (int k = 0; k < kBisections; ++k) {
    const double slip = 0.5 * (low + high);
    (predict(v_peak_V, frequency_Hz, slip).torque_Nm < torque_Nm(slip) ? low : high) = slip;
  }
  return high;
}

// Everything that holds at one (v, f) with one step.
class Place {
 public:
  Place(const Plan& plan, const RigConfig& rig, const SteadyPredictor& predict, const PlanPoint& point,
        double v_peak_V)
      : rig_(rig), predict_(predict), f_(point.frequency_Hz), v_(v_peak_V), limits_(plan.limits) {
    current_limit_ = limit_or(plan.limits.current_A, rig.limits.current_A, kCurrentMargin);
    pull_out_ = imrig::pull_out(predict, v_, f_);
    transient_ = transient_A(point.step);
  }

  double speed_rad_s(double slip) const { return 2 * kPi * f_ / rig_.motor.pole_pairs * (1 - slip); }
  double friction_Nm(double slip) const {
    return rig_.motor.friction_Nm * speed_rad_s(slip) / rad_s_of_rpm(rig_.motor.rated_speed_rpm);
  }
  const PullOut& pull_out() const { return pull_out_; }
  SteadyPrediction at(double slip) const { return predict_(v_, f_, slip); }
  double current_limit_A() const { return current_limit_; }
  double peak_A(double slip) const { return at(slip).current_A + transient_; }

  // Slip at which the motor carries the load; the pull-out slip when it cannot.
  double slip_for(double load_Nm) const {
    return slip_on_branch(predict_, v_, f_, pull_out_,
                          [&](double slip) { return load_Nm + friction_Nm(slip); });
  }

  // What forbids the load, or nullptr.
  const char* bound_by(double load_Nm) const {
    const double slip = slip_for(load_Nm);
    if (load_Nm + friction_Nm(slip) > limits_.pull_out_margin * pull_out_.torque_Nm) return "pull-out";
    if (slip > limits_.slip) return "slip";
    if (peak_A(slip) > current_limit_) return "current";
    if (load_Nm > shaft_torque_Nm(rig_.generator, speed_rad_s(slip), most_field_A(rig_.generator, rig_.dyno)))
      return "generator";
    return nullptr;
  }

  // Largest load that nothing forbids (0 when even no load is forbidden), and what bounds it.
  std::pair<double, std::string> most() const {
    double low = 0.0;
    double high = pull_out_.torque_Nm;
    std::string by = bound_by(low) != nullptr ? bound_by(low) : "";
    if (!by.empty()) return {0.0, by};
    for (int k = 0; k < kBisections; ++k) {
      const double load = 0.5 * (low + high);
      const char* bound = bound_by(load);
      if (bound != nullptr) by = bound;
      (bound == nullptr ? low : high) = load;
    }
    return {low, by};
  }

 private:
  // A voltage step meets R_s + R_r + j w L_l; its direct component can add to it within half a period.
  double transient_A(double step) const {
    const MotorConfig& m = rig_.motor;
    const double R = m.R_s_ohm + m.R_r_ohm;
    const double X = 2 * kPi * f_ * m.L_l_H;
    return std::abs(step) * v_ / std::hypot(R, X) * (1 + std::exp(-kPi * R / X));
  }

  const RigConfig& rig_;
  const SteadyPredictor& predict_;
  double f_;
  double v_;
  PlanLimits limits_;
  double current_limit_ = 0.0;
  double transient_ = 0.0;
  PullOut pull_out_;
};

void forbid(CheckedPoint& checked, const std::string& why) {
  checked.feasible = false;
  checked.why = why;
}

std::string told(double x, const char* unit) { return fmt::format("{:.3g} {}", x, unit); }

// The voltage that gives the wanted current at rest; its torque must be well below what the bearings hold.
void check_locked_sweep(const Plan& plan, const RigConfig& rig, const SteadyPredictor& predict,
                        CheckedPoint& checked) {
  const PlanPoint& point = checked.point;
  const double limit = limit_or(plan.limits.current_A, rig.limits.current_A, kCurrentMargin);
  checked.voltage_V = checked.stepped_V = point.level_A / predict(1.0, point.frequency_Hz, 1.0).current_A;
  checked.current_A = checked.current_peak_A = point.level_A;
  checked.slip = 1.0;
  checked.speed_rpm = 0.0;
  checked.torque_Nm = predict(checked.voltage_V, point.frequency_Hz, 1.0).torque_Nm;
  const double held_Nm = kSticking * rig.motor.friction_Nm;
  if (checked.torque_Nm > held_Nm)
    return forbid(checked, fmt::format("its torque of {} may turn the shaft, whose friction surely holds {}",
                                       told(checked.torque_Nm, "N m"), told(held_Nm, "N m")));
  if (checked.current_A > limit)
    forbid(checked, fmt::format("current {} is above the limit of {}", told(checked.current_A, "A"),
                                told(limit, "A")));
}

void check_at_rest(const Plan& plan, const RigConfig& rig, CheckedPoint& checked) {
  const PlanPoint& point = checked.point;
  const double limit = limit_or(plan.limits.current_A, rig.limits.current_A, kCurrentMargin);
  const auto& tones = point.tones.amplitude_A;
  checked.current_A = point.kind == PointKind::kDc
                          ? point.level_A
                          : std::abs(point.tones.offset_A) + std::accumulate(tones.begin(), tones.end(), 0.0);
  checked.current_peak_A = checked.current_A;
  if (checked.current_A > limit)
    forbid(checked, fmt::format("current {} is above the limit of {}", told(checked.current_A, "A"),
                                told(limit, "A")));
}

// Inrush with the shaft at rest, or the current that the acceleration of a ramp asks for half-way.
void check_startup(const RigConfig& rig, const Place& place, const SteadyPredictor& predict,
                   CheckedPoint& checked) {
  const PlanPoint& point = checked.point;
  if (point.ramp_s <= 0.0) {
    const double X = 2 * kPi * point.frequency_Hz * rig.motor.L_l_H;
    const double direct = std::exp(-kPi * (rig.motor.R_s_ohm + rig.motor.R_r_ohm) / X);
    checked.current_peak_A = place.at(1.0).current_A * (1 + direct);
    return;
  }
  const double torque = rig.motor.J_kgm2 * place.speed_rad_s(0.0) / point.ramp_s;
  const double v_half = 0.5 * checked.voltage_V;
  const double f_half = 0.5 * point.frequency_Hz;
  const PullOut half = pull_out(predict, v_half, f_half);
  if (torque > half.torque_Nm) {
    forbid(checked, fmt::format("the ramp asks for {} to accelerate, pull-out half-way is {}",
                                told(torque, "N m"), told(half.torque_Nm, "N m")));
  }
  const double slip = slip_on_branch(predict, v_half, f_half, half, [torque](double) { return torque; });
  checked.current_peak_A = kSwing * predict(v_half, f_half, slip).current_A;
}

void check_load(const RigConfig& rig, const Place& place, CheckedPoint& checked) {
  const PlanPoint& point = checked.point;
  std::tie(checked.most_Nm, checked.most_by) = place.most();
  checked.load_Nm = std::isnan(point.load.share) ? point.load.torque_Nm : point.load.share * checked.most_Nm;
  checked.slip = place.slip_for(checked.load_Nm);
  checked.speed_rpm = rpm_of_rad_s(place.speed_rad_s(checked.slip));
  checked.torque_Nm = checked.load_Nm + place.friction_Nm(checked.slip);
  checked.current_A = place.at(checked.slip).current_A;
  checked.current_peak_A = place.peak_A(checked.slip);
  checked.excitation_A = field_A_for_torque(rig.generator, place.speed_rad_s(checked.slip), checked.load_Nm);
  if (checked.load_Nm > checked.most_Nm * (1 + 1e-9))
    forbid(checked, fmt::format("the load of {} is above the {} that {} allows", told(checked.load_Nm, "N m"),
                                told(checked.most_Nm, "N m"), checked.most_by));
}

void check_running(const Plan& plan, const RigConfig& rig, const SteadyPredictor& predict,
                   CheckedPoint& checked) {
  const PlanPoint& point = checked.point;
  const Place place(plan, rig, predict, point, checked.voltage_V);
  checked.pull_out_Nm = place.pull_out().torque_Nm;
  check_load(rig, place, checked);
  if (point.kind == PointKind::kStartup) check_startup(rig, place, predict, checked);
  const double friction = place.friction_Nm(0.0);
  const double highest_V = std::max(checked.voltage_V, checked.stepped_V);
  const double synchronous_rpm = rpm_of_rad_s(place.speed_rad_s(0.0));
  const double speed_limit = limit_or(plan.limits.speed_rpm, rig.limits.speed_rpm, kSpeedMargin);
  if (highest_V > rig.limits.voltage_V)
    return forbid(checked, fmt::format("{} is above the {} that the inverter gives", told(highest_V, "V"),
                                       told(rig.limits.voltage_V, "V")));
  const MotorConfig& m = rig.motor;
  const double flux_percent =
      100.0 * highest_V / rated_peak_V(m) * m.rated_frequency_Hz / point.frequency_Hz;
  if (flux_percent > plan.limits.flux_percent * (1 + 1e-9))
    return forbid(checked, fmt::format("volts per hertz of {} of rated are above the plan's {}",
                                       told(flux_percent, "%"), told(plan.limits.flux_percent, "%")));
  if (synchronous_rpm > speed_limit)
    return forbid(checked, fmt::format("synchronous speed {} is above the limit of {}",
                                       told(synchronous_rpm, "rpm"), told(speed_limit, "rpm")));
  if (friction > plan.limits.pull_out_margin * checked.pull_out_Nm)
    return forbid(checked, fmt::format("the no-load torque of {} is too much for a pull-out torque of {}",
                                       told(friction, "N m"), told(checked.pull_out_Nm, "N m")));
  if (checked.current_peak_A > place.current_limit_A())
    return forbid(checked,
                  fmt::format("peak current {} is above the limit of {}", told(checked.current_peak_A, "A"),
                              told(place.current_limit_A(), "A")));
}

}  // namespace

double rated_peak_V(const MotorConfig& motor) { return motor.rated_voltage_V * std::sqrt(2.0 / 3.0); }

PullOut pull_out(const SteadyPredictor& predict, double v_peak_V, double frequency_Hz) {
  constexpr int kScan = 80;
  const auto slip_of = [](double k) { return kLeastSlip * std::pow(1.0 / kLeastSlip, k / kScan); };
  int best = 0;
  for (int k = 1; k <= kScan; ++k)
    if (predict(v_peak_V, frequency_Hz, slip_of(k)).torque_Nm >
        predict(v_peak_V, frequency_Hz, slip_of(best)).torque_Nm)
      best = k;
  double low = std::max(0, best - 1);
  double high = std::min(kScan, best + 1);
  for (int k = 0; k < 60; ++k) {
    const double a = low + (high - low) / 3;
    const double b = high - (high - low) / 3;
    const bool rising = predict(v_peak_V, frequency_Hz, slip_of(a)).torque_Nm <
                        predict(v_peak_V, frequency_Hz, slip_of(b)).torque_Nm;
    (rising ? low : high) = rising ? a : b;
  }
  const double slip = slip_of(0.5 * (low + high));
  return {predict(v_peak_V, frequency_Hz, slip).torque_Nm, slip};
}

std::vector<CheckedPoint> check_points(const Plan& plan, const RigConfig& rig,
                                       const SteadyPredictor& predict) {
  std::vector<CheckedPoint> all;
  for (std::size_t k = 0; k < plan.points.size(); ++k) {
    CheckedPoint checked;
    checked.point = plan.points[k];
    checked.plan_index = static_cast<int>(k);
    checked.voltage_V = checked.point.voltage_percent / 100.0 * rated_peak_V(rig.motor);
    checked.stepped_V = checked.voltage_V * (1 + checked.point.step);
    if (checked.point.kind == PointKind::kDc || checked.point.kind == PointKind::kStandstill)
      check_at_rest(plan, rig, checked);
    else if (checked.point.kind == PointKind::kLockedSweep && checked.point.regulated)
      check_at_rest(plan, rig, checked);
    else if (checked.point.kind == PointKind::kLockedSweep)
      check_locked_sweep(plan, rig, predict, checked);
    else
      check_running(plan, rig, predict, checked);
    all.push_back(std::move(checked));
  }
  return all;
}

}  // namespace imrig
