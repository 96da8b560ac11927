#include "rig/cli/report/report.h"

#include <fmt/format.h>

#include <cmath>

#include "rig/cli/channel_scale.h"
#include "rig/cli/report/chart_data.h"
#include "rig/cli/report/html.h"
#include "rig/cli/text_table.h"

namespace imrig {

namespace {

std::string percent(double share) { return std::isnan(share) ? "-" : shown(100.0 * share, 3); }

std::string interval(const est::Parameter& p) {
  return std::isnan(p.ci95_low) ? "not known" : shown(p.ci95_low, 5) + " to " + shown(p.ci95_high, 5);
}

std::string tile(const std::string& label, const std::string& value, const std::string& below) {
  return "<div class=\"tile\"><div class=\"label\">" + escaped(label) + "</div><div class=\"value\">" +
         escaped(value) + "</div><div class=\"label\">" + escaped(below) + "</div></div>\n";
}

std::string tiles(const est::CompareResult& result) {
  std::string out;
  const auto add = [&out](const char* name, const est::PooledResult& pooled) {
    if (pooled.records == 0) return;
    const bool known = !std::isnan(pooled.floor_nrmse);
    out += "<div class=\"tiles\">\n" +
           tile(std::string(name) + " current error", percent(pooled.nrmse) + " %",
                std::to_string(pooled.records) + (pooled.records == 1 ? " record" : " records")) +
           tile(std::string(name) + " noise floor", percent(pooled.floor_nrmse) + (known ? " %" : ""),
                known ? "what noise alone would leave" : "noise not known") +
           tile(std::string(name) + " chi2/dof", shown(pooled.chi2_per_dof, 3), "1 is noise alone") +
           "</div>\n";
  };
  add("fitted:", result.fitted);
  add("hold-out:", result.holdout);
  return out;
}

std::string model_table(const est::Model& model) {
  std::vector<std::vector<std::string>> rows;
  for (const auto& base : est::base_parameters()) {
    const est::Parameter& p = model.*base.place;
    rows.push_back({base.name, shown(p.value, 5), interval(p), base.unit, p.found});
  }
  for (const auto& effect : model.effects) {
    for (const auto& [name, p] : effect.parameters)
      rows.push_back({effect.name + "." + name, shown(p.value, 5), interval(p), p.unit, p.found});
  }
  return html_table({"<parameter", "value", "<95 % interval", "<unit", "<found by"}, rows);
}

std::string records_table(const est::CompareResult& result) {
  std::vector<std::vector<std::string>> rows;
  for (const auto& record : result.records) {
    if (!record.left_out.empty()) continue;
    for (const auto& [name, c] : record.channels) {
      rows.push_back({record.id, record_kind_word(record.kind), record.holdout ? "hold-out" : "",
                      shown(record.conditions.f_Hz), percent(record.conditions.slip),
                      shown(record.conditions.i_A), name, shown(c.rmse, 3) + " " + c.unit, percent(c.nrmse),
                      percent(c.floor), shown(c.chi2_per_dof, 3),
                      std::isnan(c.floor) ? "" : record.floor_from});
    }
  }
  return html_table({"<record", "<kind", "<", "f Hz", "slip %", "I A", "<channel", "rms error", "error %",
                     "floor %", "chi2/dof", "<floor from"},
                    rows);
}

std::string points_table(const est::ComparedRecord& record) {
  std::vector<std::vector<std::string>> rows;
  for (const auto& point : record.points) {
    std::vector<std::string> row = {shown(point.conditions.f_Hz),
                                    shown(rpm_of_rad_s(point.conditions.speed_rad_s), 5),
                                    percent(point.conditions.slip)};
    for (const char* channel : {"current_A", "input_power_W", "power_factor", "output_power_W"}) {
      const auto found = point.channels.find(channel);
      if (found == point.channels.end()) {
        row.insert(row.end(), 3, "-");
        continue;
      }
      const auto [measured, predicted] = found->second;
      const double largest = channel_scale(record, channel);
      row.push_back(shown_beside(largest, measured, 5));
      row.push_back(shown_beside(largest, predicted, 5));
      row.push_back(std::isnan(measured) || measured == 0.0
                        ? "-"
                        : fmt::format("{:+.1f}", 100.0 * (predicted / measured - 1.0)));
    }
    rows.push_back(std::move(row));
  }
  return "<h3>" + escaped(record.id) + "</h3>\n" +
         html_table({"f Hz", "rpm", "slip %", "I A rms", "model", "%", "P in W", "model", "%", "power factor",
                     "model", "%", "P out W", "model", "%"},
                    rows);
}

std::string lines_table(const est::OrderSpectrum& spectrum) {
  if (spectrum.lines.empty()) return "";
  std::vector<std::vector<std::string>> rows;
  for (const auto& line : spectrum.lines) {
    rows.push_back({line.kind.name, line.kind.order,
                    std::to_string(line.seen) + " of " + std::to_string(line.records),
                    shown(line.amplitude_A, 3), shown(line.over_noise, 3), line.worst_record,
                    shown(line.worst.f_Hz, 4), line.kind.hint});
  }
  return "<h2>Orders</h2>\n<p>Lines of the current error in all records: f is the supply, s the slip, f_r "
         "the shaft's "
         "turns; a record too short to tell a line from its neighbour does not count.</p>\n" +
         html_table({"<line at", "<as seen in power and torque", "seen in", "size A",
                     spectrum.noise_known ? "times noise" : "times what lies beside", "<worst in", "at Hz",
                     "<points to"},
                    rows);
}

std::string remarks(const est::CompareResult& result) {
  std::string out;
  for (const auto& record : result.records) {
    if (!record.left_out.empty())
      out += "<li>" + escaped(record.id + " was not compared: " + record.left_out) + "</li>\n";
  }
  for (const auto& note : result.notes) out += "<li>" + escaped(note) + "</li>\n";
  for (const auto& sentence : result.reach)
    out += "<li>These data cannot reveal: " + escaped(sentence) + "</li>\n";
  return out.empty() ? "" : "<h2>Remarks</h2>\n<ul>\n" + out + "</ul>\n";
}

}  // namespace

std::string report_html(const est::Model& model, const est::CompareResult& result) {
  std::string out =
      "<h1>" + escaped(result.model_name) + " <span>against</span> " + escaped(result.data_name) + "</h1>\n";
  out += tiles(result);
  out += "<h2>Model</h2>\n<p>Inverse-&Gamma; circuit, per phase of the equivalent star; " +
         std::to_string(model.pole_pairs) + " pole pairs, motor in " + (model.delta ? "delta" : "star") +
         ".</p>\n" + model_table(model);
  out += "<div id=\"charts\"></div>\n";
  for (const auto& record : result.records) {
    if (!record.points.empty()) out += points_table(record);
  }
  out +=
      "<h2>Records</h2>\n<p>Error and floor are rms over the signal's rms. The floor is what measurement "
      "noise alone would leave.</p>\n";
  out += records_table(result) + lines_table(result.spectrum) + remarks(result);
  return html_page(result.model_name + " against " + result.data_name, out, chart_data(result));
}

std::string write_report(const est::Model& model, const est::CompareResult& result,
                         const std::string& folder) {
  return write_page(folder, report_html(model, result));
}

}  // namespace imrig
