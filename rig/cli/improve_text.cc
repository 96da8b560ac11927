#include "rig/cli/improve_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "rig/cli/improve_view.h"
#include "rig/cli/text_table.h"

namespace imrig {

namespace {

constexpr double kBar = 40.0;           // characters of the longest bar of the waterfall
constexpr std::size_t kCandidates = 8;  // of each step

std::string percent(double share) { return shown(100.0 * share, 3); }

void print_overview(const est::SearchStep& step, const std::string& heading) {
  TextTable table(
      {"<modification", "expected gain", "of misfit_%", "<parameters, forecast", "gain refitted", "<"});
  const auto rows = overview(step);
  for (std::size_t k = 0; k < std::min(kCandidates, rows.size()); ++k) {
    const OverviewRow& row = rows[k];
    table.row({row.effect + ", " + row.form, shown(row.expected_gain, 3), percent(row.expected_share),
               row.parameters, shown(row.gain, 3), row.warning.empty() ? "" : "! " + row.warning});
  }
  if (table.empty()) return;
  fmt::print("{} (gain: drop of chi2)\n{}", heading, table.text());
  if (rows.size() > kCandidates) fmt::print("... and {} with less\n", rows.size() - kCandidates);
  fmt::print("\n");
}

std::string bar(double x, double largest, char sign) {
  if (!std::isfinite(x) || !(largest > 0.0)) return "";
  return std::string(static_cast<std::size_t>(std::max(1.0, std::round(kBar * std::min(1.0, x / largest)))),
                     sign);
}

void print_waterfall(const est::Search& search) {
  const auto falls = waterfall(search);
  double largest = 1.0;
  for (const Fall& f : falls)
    largest = std::fmax(largest, std::fmax(f.fitted_over_noise, f.holdout_over_noise));
  const bool holdout = std::isfinite(falls.front().holdout);
  TextTable table({"<model", "<", "error_%", "floor_%", "times noise", "<"});
  for (const Fall& f : falls) {
    table.row({f.text, "fitted", percent(f.fitted), percent(f.floor), shown(f.fitted_over_noise, 3),
               bar(f.fitted_over_noise, largest, '#')});
    if (holdout)
      table.row({"", "hold-out", percent(f.holdout), percent(f.holdout_floor), shown(f.holdout_over_noise, 3),
                 bar(f.holdout_over_noise, largest, '=')});
  }
  table.row({"noise floor", "", percent(falls.back().floor), "", "1", bar(1.0, largest, '.')});
  fmt::print("{}", table.text());
  for (const auto& note : waterfall_notes(search)) fmt::print("{}\n", note);
}

void print_models(const est::Model& current, const est::Model& proposed) {
  TextTable table({"<", "<parameter", "current", "proposed", "change_%", "<unit"});
  for (const ModelRow& row : side_by_side(current, proposed)) {
    table.row({row.mark, row.name, shown(row.current, 5), shown(row.proposed, 5),
               shown(row.change_percent, 3), row.unit == "1" ? "" : row.unit});
  }
  fmt::print("\n{}moved: out of its 95 % interval\n", table.text());
}

}  // namespace

void print_improvement(const est::Model& current, const est::Improvement& improvement) {
  const est::Search& search = improvement.diagnosis.search;
  for (std::size_t k = 0; k < search.steps.size(); ++k)
    print_overview(search.steps[k], k == 0 ? "candidates" : fmt::format("candidates, step {}", k + 1));
  print_waterfall(search);
  print_models(current, improvement.model);
  fmt::print("\n{}\n", ending(improvement.diagnosis));
}

}  // namespace imrig
