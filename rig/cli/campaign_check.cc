#include "rig/cli/campaign_check.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "estimators/model/steady_state.h"
#include "rig/base/space_vector.h"

namespace imrig {

namespace {

// Before the first samples the device's own sample time is not known; the predicted durations depend on it by
// less than a sample.
constexpr double kNominalSample_s = 60e-6;

std::string cell(double x, int digits) { return std::isnan(x) ? "-" : fmt::format("{:.{}f}", x, digits); }

std::string row(const CheckedPoint& c) {
  const bool at_rest = c.point.kind == PointKind::kDc || c.point.kind == PointKind::kStandstill;
  const auto when_running = [at_rest](double x, int digits) { return at_rest ? "-" : cell(x, digits); };
  const std::string remark = c.feasible ? (c.point.holdout ? "holdout" : "") : c.why;
  return fmt::format("{:<24}{:>6}{:>8}{:>9}{:>8}{:>9}{:>10}{:>9}{:>9}{:>8}  {}\n", c.point.id,
                     when_running(c.point.frequency_Hz, 1), when_running(c.voltage_V, 1),
                     when_running(c.load_Nm, 2), cell(100 * c.slip, 2), cell(c.torque_Nm, 2),
                     cell(c.pull_out_Nm, 1), cell(c.current_A, 1), cell(c.current_peak_A, 1),
                     c.feasible ? cell(c.time_s, 1) : "-", remark);
}

nlohmann::json object(const CheckedPoint& c) {
  return {{"id", c.point.id},
          {"kind", point_kind_word(c.point.kind)},
          {"f_Hz", c.point.frequency_Hz},
          {"v_V", c.voltage_V},
          {"step", c.point.step},
          {"load_Nm", c.load_Nm},
          {"most_Nm", c.most_Nm},
          {"most_by", c.most_by},
          {"excitation_A", c.excitation_A},
          {"slip", c.slip},
          {"speed_rpm", c.speed_rpm},
          {"torque_Nm", c.torque_Nm},
          {"pull_out_Nm", c.pull_out_Nm},
          {"current_A", c.current_A},
          {"current_peak_A", c.current_peak_A},
          {"time_s", c.feasible ? c.time_s : std::nan("")},
          {"holdout", c.point.holdout},
          {"repeat_of", c.point.repeat_of},
          {"feasible", c.feasible},
          {"why", c.why}};
}

}  // namespace

SteadyPredictor predictor_of(const MotorConfig& motor) {
  est::MachineParameters<double> parameters;
  parameters.R_s = motor.R_s_ohm;
  parameters.R_r = motor.R_r_ohm;
  parameters.L_l = motor.L_l_H;
  parameters.L_m = motor.L_m_H;
  return [parameters, pole_pairs = motor.pole_pairs](double v_peak_V, double frequency_Hz, double slip) {
    const double w = 2 * kPi * frequency_Hz;
    const auto state = est::steady_state(parameters, pole_pairs, v_peak_V, w, w * (1 - slip));
    return SteadyPrediction{state.current_A, state.torque_Nm};
  };
}

double CheckedPlan::time_s() const {
  double sum = 0.0;
  for (const CheckedPoint& c : in_order) sum += c.time_s;
  return sum;
}

CheckedPlan check_plan(const Plan& plan, const RigConfig& rig) {
  CheckedPlan checked;
  checked.plan = plan;
  std::vector<CheckedPoint> feasible;
  for (CheckedPoint& c : check_points(plan, rig, predictor_of(rig.motor)))
    (c.feasible ? feasible : checked.infeasible).push_back(std::move(c));
  checked.in_order = order_points(travel_of(plan, rig, kNominalSample_s), std::move(feasible));
  return checked;
}

std::string check_table(const CheckedPlan& checked) {
  std::string text =
      fmt::format("{:<24}{:>6}{:>8}{:>9}{:>8}{:>9}{:>10}{:>9}{:>9}{:>8}\n", "point", "f Hz", "V peak",
                  "load Nm", "slip %", "torque", "pull-out", "I peak A", "max A", "time s");
  for (const CheckedPoint& c : checked.in_order) text += row(c);
  if (!checked.infeasible.empty()) text += "\nleft out:\n";
  for (const CheckedPoint& c : checked.infeasible) text += row(c);
  text += fmt::format("\n{}: {} points, {} feasible, {} left out; about {:.0f} s of rig time\n",
                      checked.plan.name, checked.in_order.size() + checked.infeasible.size(),
                      checked.in_order.size(), checked.infeasible.size(), checked.time_s());
  return text;
}

std::string check_json(const CheckedPlan& checked) {
  nlohmann::json points = nlohmann::json::array();
  for (const CheckedPoint& c : checked.in_order) points.push_back(object(c));
  for (const CheckedPoint& c : checked.infeasible) points.push_back(object(c));
  return nlohmann::json{{"plan", checked.plan.name},
                        {"feasible", checked.in_order.size()},
                        {"infeasible", checked.infeasible.size()},
                        {"time_s", checked.time_s()},
                        {"points", points}}
      .dump(2);
}

}  // namespace imrig
