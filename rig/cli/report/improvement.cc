#include "rig/cli/report/improvement.h"

#include <fmt/format.h>

#include "rig/cli/improve_view.h"
#include "rig/cli/json_number.h"
#include "rig/cli/report/html.h"
#include "rig/cli/text_table.h"

namespace imrig {

namespace {

std::string chart_json(const est::Search& search) {
  Json out = {{"waterfall", Json::array()}};
  for (const Fall& fall : waterfall(search)) {
    out["waterfall"].push_back({{"text", fall.text},
                                {"fitted", json_number(fall.fitted_over_noise)},
                                {"holdout", json_number(fall.holdout_over_noise)}});
  }
  return json_text(out);
}

std::string paragraph(const std::string& text) { return "<p>" + escaped(text) + "</p>\n"; }

std::string falls_table(const est::Search& search) {
  std::vector<std::vector<std::string>> rows;
  const auto percent = [](double share) { return shown(100.0 * share, 3); };
  for (const Fall& f : waterfall(search)) {
    rows.push_back({f.text, percent(f.fitted), percent(f.floor), shown(f.fitted_over_noise, 3),
                    percent(f.holdout), percent(f.holdout_floor), shown(f.holdout_over_noise, 3)});
  }
  return html_table(
      {"<model", "fitted error %", "floor %", "over noise", "hold-out error %", "floor %", "over noise"},
      rows);
}

std::string overview_table(const est::SearchStep& step) {
  std::vector<std::vector<std::string>> rows;
  for (const OverviewRow& row : overview(step)) {
    rows.push_back({row.effect, row.form, shown(row.expected_gain, 3), shown(100.0 * row.expected_share, 3),
                    row.parameters, shown(row.gain, 3), row.warning});
  }
  return html_table({"<modification", "<form", "expected gain", "of the misfit %", "<parameters, forecast",
                     "gain refitted", "<warning"},
                    rows);
}

std::string models_table(const est::Model& current, const est::Model& proposed) {
  std::vector<std::vector<std::string>> rows;
  for (const ModelRow& row : side_by_side(current, proposed)) {
    rows.push_back({row.mark, row.name, shown(row.current, 5), shown(row.proposed, 5),
                    shown(row.change_percent, 3), row.unit == "1" ? "" : row.unit});
  }
  return html_table({"<", "<parameter", "current", "proposed", "change %", "<unit"}, rows);
}

}  // namespace

std::string write_improvement_report(const est::Model& current, const est::Improvement& improvement,
                                     const std::string& folder) {
  const est::Search& search = improvement.diagnosis.search;
  const std::string title = improvement.diagnosis.verdict == "unknown" ? "not improved" : "improved";
  std::string out = "<h1>" + escaped(current.name) + " <span>" + title + "</span></h1>\n" +
                    paragraph(ending(improvement.diagnosis) + ".");
  out += "<div id=\"charts\"></div>\n" + falls_table(search);
  for (const auto& note : waterfall_notes(search)) out += paragraph(note);
  out +=
      "<h2>Diagnosis</h2>\n" + paragraph("verdict on the model as it came: " + improvement.diagnosis.verdict);
  for (const auto& sentence : improvement.diagnosis.explanation) out += paragraph(sentence);
  out += "<h2>Model</h2>\n" + paragraph("moved: out of its 95 % interval.") +
         models_table(current, improvement.model);
  for (std::size_t k = 0; k < search.steps.size(); ++k) {
    out += fmt::format("<h2>Candidates, step {}</h2>\n", k + 1);
    out += paragraph("Gain: drop of chi2, as one linear forecast promises it and as the refit gave it.");
    out += overview_table(search.steps[k]);
  }
  return write_page(folder, html_page(current.name + " " + title, out, chart_json(search)));
}

}  // namespace imrig
