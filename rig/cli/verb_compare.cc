// imrig compare MODEL.toml DATA...: how far the model is from the measurements, and where.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "estimators/diagnose/compare.h"
#include "estimators/diagnose/compare_json.h"
#include "estimators/model/model_file.h"
#include "rig/cli/channel_scale.h"
#include "rig/cli/compare_text.h"
#include "rig/cli/load_data.h"
#include "rig/cli/report/report.h"
#include "rig/cli/text_table.h"
#include "rig/cli/verbs.h"

namespace imrig {

namespace {

constexpr std::size_t kNotes = 8;

struct Options {
  std::string model;
  std::vector<std::string> data;
  std::string report;
  bool json = false;
};

std::string percent(double share) { return shown(100.0 * share, 3); }

void print_records(const est::CompareResult& result) {
  TextTable table({"<record", "<kind", "f_Hz", "slip_%", "I_A", "<channel", "rms error", "<unit", "error_%",
                   "floor_%", "chi2/dof", "<"});
  for (const auto& record : result.records) {
    if (!record.left_out.empty()) continue;
    bool first = true;
    for (const auto& [name, c] : record.channels) {
      const auto once = [first](const std::string& text) { return first ? text : ""; };
      table.row({once(printable(record.id)), once(record_kind_word(record.kind)),
                 once(shown(record.conditions.f_Hz)), once(percent(record.conditions.slip)),
                 once(shown(record.conditions.i_A)), name, shown(c.rmse), c.unit, percent(c.nrmse),
                 percent(c.floor), shown(c.chi2_per_dof, 3), once(record.holdout ? "hold-out" : "")});
      first = false;
    }
  }
  fmt::print("{}", table.text());
}

std::string cell(const est::PointResult& point, const char* channel, bool measured, double largest) {
  const auto found = point.channels.find(channel);
  return found == point.channels.end()
             ? "-"
             : shown_beside(largest, measured ? found->second.measured : found->second.predicted, 5);
}

std::string deviation(const est::PointResult& point, const char* channel) {
  const auto found = point.channels.find(channel);
  if (found == point.channels.end()) return "-";
  const auto [measured, predicted] = found->second;
  if (std::isnan(measured) || measured == 0.0) return "-";
  return fmt::format("{:+.1f}", 100.0 * (predicted / measured - 1.0));
}

void print_points(const est::ComparedRecord& record) {
  TextTable table(
      {"f_Hz", "speed_rpm", "slip_%", "I_A", "model", "%", "P_in_W", "model", "%", "P_out_W", "model", "%"});
  for (const auto& point : record.points) {
    std::vector<std::string> cells = {shown(point.conditions.f_Hz),
                                      shown(rpm_of_rad_s(point.conditions.speed_rad_s), 5),
                                      percent(point.conditions.slip)};
    for (const char* channel : {"current_A", "input_power_W", "output_power_W"}) {
      const double largest = channel_scale(record, channel);
      cells.push_back(cell(point, channel, true, largest));
      cells.push_back(cell(point, channel, false, largest));
      cells.push_back(deviation(point, channel));
    }
    table.row(std::move(cells));
  }
  fmt::print("\n{}: measured and model (line current, rms)\n{}", printable(record.id), table.text());
}

void print_pooled(const char* name, const est::PooledResult& pooled) {
  if (pooled.records == 0) return;
  const std::string floor = std::isnan(pooled.floor_nrmse)
                                ? "noise floor not known"
                                : fmt::format("noise floor {} %, chi2/dof {}", percent(pooled.floor_nrmse),
                                              shown(pooled.chi2_per_dof, 3));
  fmt::print("{}: {} record{}, current error {} % of the signal, {}\n", name, pooled.records,
             pooled.records == 1 ? "" : "s", percent(pooled.nrmse), floor);
}

void print_notes(const std::vector<std::string>& notes) {
  for (std::size_t k = 0; k < std::min(kNotes, notes.size()); ++k)
    fmt::print("note: {}\n", printable(notes[k]));
  if (notes.size() > kNotes)
    fmt::print("note: {} more; imrig info tells what looks wrong in the data\n", notes.size() - kNotes);
}

void print_text(const est::CompareResult& result) {
  fmt::print("model \"{}\" against \"{}\"\n\n", printable(result.model_name), printable(result.data_name));
  print_records(result);
  for (const auto& record : result.records) {
    if (!record.points.empty()) print_points(record);
  }
  for (const auto& map : result.maps) print_map(map);
  print_lines(result.spectrum);
  fmt::print("\n");
  print_pooled("fitted", result.fitted);
  print_pooled("hold-out", result.holdout);
  print_worst(result);
  for (const auto& record : result.records) {
    if (!record.left_out.empty())
      fmt::print("left out: {}: {}\n", printable(record.id), printable(record.left_out));
  }
  print_notes(result.notes);
  if (!result.reach.empty()) fmt::print("what these data cannot reveal:\n");
  for (const auto& sentence : result.reach) fmt::print("  {}\n", printable(sentence));
}

void run(const Options& options) {
  const est::Model model = est::load_model(options.model);
  const DataSet data = load_data(options.data);
  const est::CompareResult result = est::compare(model, data);
  std::string report;
  if (!options.report.empty()) report = write_report(model, result, options.report);
  if (options.json) {
    fmt::print("{}\n", est::compare_json(result));
    return;
  }
  print_text(result);
  if (!report.empty()) fmt::print("report written to {}\n", report);
}

}  // namespace

void add_compare(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();
  CLI::App* verb = app.add_subcommand(
      "compare", "Simulate measured data with a model: error per record and channel against the noise floor");
  verb->add_option("model", options->model, "model file")->required();
  verb->add_option("data", options->data, "data-set folders or event logs")->required();
  verb->add_option("--report", options->report, "folder for report.html, one file that needs nothing else");
  verb->add_flag("--json", options->json, "print JSON");
  verb->callback([options, &exit_code] {
    run(*options);
    exit_code = 0;
  });
}

}  // namespace imrig
