// imrig info DATA...: what is in the measurements, under which conditions, and what looks wrong about them.

#include <fmt/format.h>

#include <cstdio>
#include <memory>

#include "rig/cli/json_number.h"
#include "rig/cli/load_data.h"
#include "rig/cli/text_table.h"
#include "rig/cli/verbs.h"
#include "rig/data/conditions.h"

namespace imrig {

namespace {

struct Options {
  std::vector<std::string> data;
  bool json = false;
};

double duration_s(const Record& record) {
  return record.kind == RecordKind::kPoints
             ? kMissing
             : static_cast<double>(record.series.size()) * record.series.sample_time_s;
}

std::size_t count_of(const Record& record) {
  return record.kind == RecordKind::kPoints ? record.points.size() : record.series.size();
}

Json noise_json(const Noise& n) {
  return {{"current_A", json_number(n.current_A)},
          {"voltage_V", json_number(n.voltage_V)},
          {"speed_rpm", json_number(rpm_of_rad_s(n.speed_rad_s))},
          {"torque_Nm", json_number(n.torque_Nm)},
          {"power_W", json_number(n.power_W)}};
}

Json record_json(const Record& record, const Conditions& c) {
  return {{"id", record.id},
          {"kind", record_kind_word(record.kind)},
          {"holdout", record.holdout},
          {"repeat_of", record.repeat_of.empty() ? Json(nullptr) : Json(record.repeat_of)},
          {"samples", record.series.size()},
          {"points", record.points.size()},
          {"sample_time_s", json_number(record.series.sample_time_s)},
          {"duration_s", json_number(duration_s(record))},
          {"conditions",
           {{"f_Hz", json_number(c.f_Hz)},
            {"v_V", json_number(c.v_V)},
            {"slip", json_number(c.slip)},
            {"i_A", json_number(c.i_A)},
            {"psi_Wb", json_number(c.psi_Wb)},
            {"torque_Nm", json_number(c.torque_Nm)},
            {"stator_C", json_number(c.stator_C)},
            {"speed_rpm", json_number(rpm_of_rad_s(c.speed_rad_s))}}},
          {"warnings", record.warnings}};
}

void print_json(const DataSet& data, double R_s) {
  Json out = {{"version", 1},
              {"name", data.name},
              {"pole_pairs", data.pole_pairs},
              {"connection", data.delta ? "delta" : "star"},
              {"noise", noise_json(data.noise)},
              {"hash", fmt::format("{:016x}", data.hash)},
              {"dc_resistance_ohm", json_number(R_s)},
              {"records", Json::array()},
              {"notes", data.notes}};
  for (const auto& record : data.records)
    out["records"].push_back(record_json(record, conditions_of(record, data.pole_pairs, R_s)));
  fmt::print("{}\n", json_text(out));
}

std::string role(const Record& record) {
  if (record.holdout) return "hold-out";
  return record.repeat_of.empty() ? "" : "repeats " + printable(record.repeat_of);
}

void print_points(const Record& record, int pole_pairs) {
  TextTable table({"V_V", "f_Hz", "I_A", "P_in_W", "speed_rpm", "slip_%", "T_Nm", "stator_C"});
  for (const auto& p : record.points) {
    const Conditions c = conditions_of(p, pole_pairs);
    table.row({shown(p.v_peak_V, 5), shown(p.f_Hz), shown(p.i_peak_A), shown(p.p_in_W, 5),
               shown(rpm_of_rad_s(p.speed_rad_s), 5), shown(100.0 * c.slip, 3), shown(c.torque_Nm),
               shown(c.stator_C, 3)});
  }
  fmt::print("\n{} (star-equivalent phase values, peak)\n{}", printable(record.id), table.text());
}

void print_text(const DataSet& data, double R_s) {
  fmt::print("{}: {} record{}, {} pole pairs, motor in {}\n", printable(data.name), data.records.size(),
             data.records.size() == 1 ? "" : "s", data.pole_pairs,
             data.delta ? "delta (values below are of the equivalent star)" : "star");
  fmt::print("noise, one sigma: current {} A, voltage {} V, speed {} rpm, power {} W\n\n",
             shown(data.noise.current_A, 3), shown(data.noise.voltage_V, 3),
             shown(rpm_of_rad_s(data.noise.speed_rad_s), 3), shown(data.noise.power_W, 3));
  TextTable table({"<record", "<kind", "count", "time_s", "f_Hz", "V_V", "slip_%", "I_A", "psi_Wb", "T_Nm",
                   "stator_C", "<"});
  for (const auto& record : data.records) {
    const Conditions c = conditions_of(record, data.pole_pairs, R_s);
    table.row({printable(record.id), record_kind_word(record.kind), std::to_string(count_of(record)),
               shown(duration_s(record), 3), shown(c.f_Hz), shown(c.v_V), shown(100.0 * c.slip, 3),
               shown(c.i_A), shown(c.psi_Wb, 3), shown(c.torque_Nm, 3), shown(c.stator_C, 3), role(record)});
  }
  fmt::print("{}", table.text());
  for (const auto& record : data.records) {
    if (record.kind == RecordKind::kPoints && record.points.size() <= 200)
      print_points(record, data.pole_pairs);
  }
  std::size_t warned = 0;
  for (const auto& record : data.records) {
    for (const auto& warning : record.warnings)
      fmt::print("{}warning: {}: {}\n", warned++ == 0 ? "\n" : "", printable(record.id), printable(warning));
  }
  for (const auto& note : data.notes) fmt::print("note: {}\n", printable(note));
}

void run(const Options& options) {
  const DataSet data = load_data(options.data);
  const double R_s = dc_resistance_ohm(data);  // without a dc record there is no flux to tell
  options.json ? print_json(data, R_s) : print_text(data, R_s);
}

}  // namespace

void add_info(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();
  CLI::App* verb =
      app.add_subcommand("info", "Records, operating conditions, gaps and quality of measured data");
  verb->add_option("data", options->data, "data-set folders or event logs")->required();
  verb->add_flag("--json", options->json, "print JSON");
  verb->callback([options, &exit_code] {
    run(*options);
    exit_code = 0;
  });
}

}  // namespace imrig
