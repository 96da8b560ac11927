#include "estimators/diagnose/next/plan_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace imrig::est {

namespace {

constexpr double kRegulator_s = 240e-6, kRegulator_rad_s = 800.0;

std::string list(const std::vector<double>& x) {
  std::vector<std::string> out;
  for (const double value : x) out.push_back(fmt::format("{:.5g}", value));
  return fmt::format("[{}]", fmt::join(out, ", "));
}

void once(std::vector<double>& x, double value) {
  if (std::find(x.begin(), x.end(), value) == x.end()) x.push_back(value);
}

std::string locked_table(const std::vector<PlannedRecord>& records, const MachineParameters<double>& motor) {
  std::vector<double> frequencies, currents;
  double record_s = 0.0;
  for (const PlannedRecord& r : records) {
    once(frequencies, r.f_Hz);
    once(currents, r.current_A);
    record_s = std::max(record_s, r.record_s);
  }
  std::string out = fmt::format("[locked_sweep]\nfrequencies_Hz = {}\ncurrents_A = {}\n", list(frequencies),
                                list(currents));
  if (records.front().axis) {
    const double kp = kRegulator_rad_s * motor.L_l;
    out +=
        fmt::format("regulated = true\nkp_V_per_A = {:.4g}\nki_V_per_As = {:.4g}\nregulator_period_s = {}\n",
                    kp, kp * (motor.R_s + motor.R_r) / motor.L_l, kRegulator_s);
  }
  return out + fmt::format("settle_s = 1.0\nrecord_s = {}\n", record_s);
}

std::string point_table(const PlannedRecord& r, double rated_V, std::size_t number) {
  const double percent = 100.0 * r.v_peak_V / rated_V;
  std::string out = fmt::format(
      "\n[[point]]\nid = \"next_{}\"\nkind = \"{}\"\nfrequency_Hz = {:.5g}\n"
      "voltage_percent = {:.5g}\n",
      number, record_kind_word(r.kind), r.f_Hz, percent);
  if (r.kind != RecordKind::kNoLoad) out += fmt::format("load_share = {:.4g}\n", r.load_share);
  if (r.kind == RecordKind::kStep)
    out += fmt::format("step_percent = {:.4g}\nbefore_s = {}\n", 100.0 * r.step, r.before_s);
  return out + fmt::format("record_s = {}\n", r.record_s);
}

}  // namespace

std::string plan_text(const Experiment& experiment, const RigRange& range,
                      const MachineParameters<double>& motor, int repeats, const std::string& why) {
  std::string out = fmt::format("# {}\n", why);
  if (experiment.cold_and_hot)
    out +=
        "# Take it cold, and again right after the motor has run under load; diagnose takes all folders "
        "together.\n";
  if (!range.from_rig)
    out += fmt::format(
        "# Without a rig's configuration: within what the data have seen; 100 % is {:.4g} V (peak, phase).\n",
        range.rated_V);
  out += fmt::format(
      "version = 1\nname = \"next\"\ndescription = \"{}\"\nrepeats = {}\n\n[limits]\ncurrent_A = {:.5g}\n\n",
      experiment.name, repeats, range.current_A);
  const auto end = experiment.records.begin() +
                   static_cast<std::ptrdiff_t>(experiment.records.size() / (experiment.cold_and_hot ? 2 : 1));
  const std::vector<PlannedRecord> records(experiment.records.begin(), end);
  if (records.front().kind == RecordKind::kLockedSweep) return out + locked_table(records, motor);
  for (std::size_t k = 0; k < records.size(); ++k) out += point_table(records[k], range.rated_V, k + 1);
  return out;
}

}  // namespace imrig::est
