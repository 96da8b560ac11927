#include "rig/cli/diagnose_text.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>

#include "rig/cli/text_table.h"

namespace imrig {

namespace {

std::string headline(const est::Diagnosis& d) {
  if (d.verdict == "missing") return "missing: " + d.effect;
  if (d.verdict == "ambiguous") {
    std::string names;
    for (const auto& name : d.confusable) names += (names.empty() ? "" : " or ") + name;
    return "ambiguous: " + names;
  }
  if (d.verdict == "cannot_tell") return "cannot tell";
  return d.verdict;
}

std::string estimates(const est::CandidateResult& c) {
  std::string out;
  for (const auto& [name, p] : c.estimate)
    out += fmt::format("{}{} {} +- {}{}", out.empty() ? "" : ", ", name, shown(p.value, 3),
                       shown(0.5 * (p.ci95_high - p.ci95_low), 2), p.unit == "1" ? "" : " " + p.unit);
  return out;
}

}  // namespace

void print_diagnosis(const est::Diagnosis& d) {
  fmt::print("{}\n\n", headline(d));
  for (const auto& sentence : d.explanation) fmt::print("{}\n", printable(sentence));
  if (d.next_experiment) {
    fmt::print("Next: {}: {}.\n", d.next_experiment->what, d.next_experiment->why);
    if (!d.next_experiment->plan.empty())
      fmt::print("Plan written to {}.\n", printable(d.next_experiment->plan));
  }
  TextTable table({"<effect", "<verdict", "score", "p", "hold-out_%", "<estimate (95 %)"});
  for (const auto& c : d.candidates) {
    const double after = std::isnan(c.holdout_nrmse_after) ? c.holdout_nrmse_before : c.holdout_nrmse_after;
    table.row(
        {c.effect, c.verdict, shown(c.score, 3), shown(c.p_value, 2), shown(100.0 * after, 3), estimates(c)});
  }
  fmt::print("\n{}", table.text());
}

est::SearchReport search_report() {
  if (::isatty(STDERR_FILENO) == 0) return {};
  return [](const est::SearchProgress& p) {
    if (p.what == "done") {
      std::fprintf(stderr, "\r\033[K");
    } else {
      std::fprintf(stderr, "\r\033[K%s %zu of %zu", p.what.c_str(), p.done + 1, p.total);
    }
    std::fflush(stderr);
  };
}

}  // namespace imrig
