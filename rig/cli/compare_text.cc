#include "rig/cli/compare_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "estimators/diagnose/worst_records.h"
#include "rig/cli/text_table.h"

namespace imrig {

namespace {

constexpr double kTold = 0.05;  // a dependence is told below this chance

std::string percent(double share) { return shown(100.0 * share, 3); }

const est::ChannelResult* channel_of(const est::MapCondition& condition, const est::MapBin& bin) {
  const auto found = bin.channels.find(condition.channel);
  return found == bin.channels.end() ? nullptr : &found->second;
}

// Figure that bins are compared by: chi2 where noise is known, else the relative error.
double badness(const est::MapCondition& condition, const est::MapBin& bin) {
  const auto* c = channel_of(condition, bin);
  if (c == nullptr) return 0.0;
  return std::isnan(c->chi2_per_dof) ? c->nrmse : c->chi2_per_dof;
}

std::vector<std::string> cells(const est::MapCondition& condition, const est::MapBin& bin) {
  const auto* c = channel_of(condition, bin);
  if (c == nullptr) return {"-", "-", "-", "-"};
  return {shown_bin(condition.name, bin), std::to_string(bin.stretches), percent(c->nrmse),
          shown(c->chi2_per_dof, 3)};
}

std::string shows_in(const est::MapCondition& condition) {
  static const std::map<std::string, std::string> words{{"size", "size of the error"},
                                                        {"sign", "sign of the error"},
                                                        {"active", "part in phase with the voltage"},
                                                        {"reactive", "part in quadrature to the voltage"}};
  return condition.part.empty() ? "" : fmt::format("{}, {}", condition.channel, words.at(condition.part));
}

std::string chance(double p) { return std::isnan(p) ? "-" : p < 0.001 ? "<0.001" : shown(p, 2); }

}  // namespace

ShownCondition shown_condition(const std::string& name) {
  static const std::map<std::string, ShownCondition> all{
      {"f_Hz", {"frequency, Hz"}},   {"psi_Wb", {"stator flux, Wb"}},
      {"slip", {"slip, %", 100.0}},  {"i_A", {"current, A peak"}},
      {"torque_Nm", {"torque, Nm"}}, {"stator_C", {"stator temperature, °C"}},
      {"time_s", {"time, s"}},       {"order", {"order in the data"}},
      {"direction", {"direction"}}};
  const auto found = all.find(name);
  return found == all.end() ? ShownCondition{name} : found->second;
}

std::string shown_bin(const std::string& condition, const est::MapBin& bin) {
  if (condition == "direction") return bin.low > 0.0 ? "forward" : "backward";
  const double scale = shown_condition(condition).scale;
  const std::string low = shown(scale * bin.low, 3), high = shown(scale * bin.high, 3);
  return low == high ? low : low + " to " + high;
}

void print_map(const est::FailureMap& map) {
  std::vector<const est::MapCondition*> told;
  for (const auto& condition : map.conditions) {
    if (condition.bins.size() > 1) told.push_back(&condition);
  }
  if (told.empty()) return;
  std::stable_sort(told.begin(), told.end(),
                   [](const auto* a, const auto* b) { return b->share < a->share; });
  fmt::print("\nwhere it fails: error by condition, {} {}{}\n", map.stretches,
             map.from == "points" ? "points" : "stretches",
             map.shuffled.empty() ? ", too few to test"
                                  : " (p: chance that shuffled conditions do as well, over all conditions)");
  TextTable table({"<condition", "p", "share_%", "<worst at", "n", "error_%", "chi2/dof", "<best at", "n",
                   "error_%", "chi2/dof", "<depends on it"});
  for (const auto* condition : told) {
    const auto less = [&](const auto& a, const auto& b) {
      return badness(*condition, a) < badness(*condition, b);
    };
    const auto [best, worst] = std::minmax_element(condition->bins.begin(), condition->bins.end(), less);
    std::vector<std::string> row{shown_condition(condition->name).text, chance(condition->p_value),
                                 shown(100.0 * condition->share, 2)};
    for (const auto& cell : cells(*condition, *worst)) row.push_back(cell);
    for (const auto& cell : cells(*condition, *best)) row.push_back(cell);
    row.push_back(condition->p_value < kTold ? shows_in(*condition) : "");
    table.row(std::move(row));
  }
  fmt::print("{}", table.text());
}

void print_lines(const est::OrderSpectrum& spectrum) {
  if (spectrum.lines.empty()) return;
  std::vector<const est::OrderLine*> seen;
  std::string shared;
  for (const auto& line : spectrum.lines) {
    if (line.seen > 0) seen.push_back(&line);
    if (line.records == 0) shared += (shared.empty() ? "" : ", ") + std::string(line.kind.name);
  }
  fmt::print("\nlines of the current error{}\n", seen.empty() ? ": none stands above the noise" : "");
  TextTable table({"<at", "seen in", "size_A", spectrum.noise_known ? "times noise" : "times beside",
                   "<worst in", "at_Hz", "size_A", "<points to"});
  for (const auto* line : seen) {
    table.row({line->kind.name, fmt::format("{} of {}", line->seen, line->records),
               shown(line->amplitude_A, 3), shown(line->over_noise, 3), printable(line->worst_record),
               shown(line->worst.f_Hz, 4), shown(line->worst.amplitude_A, 3), line->kind.hint});
  }
  if (!seen.empty()) fmt::print("{}", table.text());
  if (!shared.empty())
    fmt::print("not to be told from a line beside them, these records being too short: {}\n", shared);
}

void print_worst(const est::CompareResult& result) {
  const auto worst = est::worst_records(result, 3);
  if (worst.size() < 2) return;
  std::string text;
  for (const auto* record : worst) {
    const est::ChannelResult& c = record->channels.at("current_A");
    text += fmt::format("{}{} ({}, around {} s)", text.empty() ? "" : "; ", printable(record->id),
                        std::isnan(c.floor) ? fmt::format("{} %", percent(c.nrmse))
                                            : fmt::format("{} times its floor", shown(c.nrmse / c.floor, 3)),
                        shown(0.5 * (record->overlay.t_s.front() + record->overlay.t_s.back()), 3));
  }
  fmt::print("worst records: {}\n", text);
}

}  // namespace imrig
