#include "rig/cli/report/chart_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "rig/cli/json_number.h"

namespace imrig {

namespace {

constexpr std::size_t kOverlays = 4;
constexpr std::size_t kMaxBars = 600;

// Rounded for the page: what a screen can show.
Json rounded(double x) {
  return std::isfinite(x) ? Json(std::stod(fmt::format("{:.6g}", x))) : Json(nullptr);
}

const est::ChannelResult* current_of(const est::ComparedRecord& record) {
  const auto found = record.channels.find("current_A");
  return record.left_out.empty() && found != record.channels.end() ? &found->second : nullptr;
}

Json conditions(const Conditions& c) {
  return {
      {"f_Hz", rounded(c.f_Hz)},     {"slip", rounded(100.0 * c.slip)},   {"i_A", rounded(c.i_A)},
      {"psi_Wb", rounded(c.psi_Wb)}, {"torque_Nm", rounded(c.torque_Nm)}, {"stator_C", rounded(c.stator_C)}};
}

// One dot per record, or per point of a table: error in per cent, signed for points (positive: the model
// draws more).
void add_dots(const est::ComparedRecord& record, Json& dots) {
  const auto add = [&](double error_percent, double over_floor, const Conditions& at) {
    dots.push_back({{"id", record.id},
                    {"holdout", record.holdout},
                    {"error", rounded(error_percent)},
                    {"over_floor", rounded(over_floor)},
                    {"at", conditions(at)}});
  };
  for (const auto& point : record.points) {
    const auto found = point.channels.find("current_A");
    if (found == point.channels.end() || std::isnan(found->second.measured)) continue;
    add(100.0 * (found->second.predicted / found->second.measured - 1.0), kMissing, point.conditions);
  }
  const auto* current = current_of(record);
  if (current == nullptr || !record.points.empty()) return;
  add(100.0 * current->nrmse, current->nrmse / current->floor, record.conditions);
}

Json overlay(const est::ComparedRecord& record) {
  Json t = Json::array(), measured = Json::array(), model = Json::array(), error = Json::array();
  for (std::size_t k = 0; k < record.overlay.t_s.size(); ++k) {
    const double m = record.overlay.measured[k].real(), p = record.overlay.predicted[k].real();
    t.push_back(rounded(record.overlay.t_s[k]));
    measured.push_back(rounded(m));
    model.push_back(rounded(p));
    error.push_back(rounded(m - p));
  }
  return {{"id", record.id}, {"t", t}, {"measured", measured}, {"model", model}, {"error", error}};
}

// Farthest above its floor first; where a floor is not known, the larger relative error.
Json overlays(const est::CompareResult& result) {
  std::vector<std::pair<double, const est::ComparedRecord*>> worst;
  bool floors = true;
  for (const auto& record : result.records) {
    const auto* current = current_of(record);
    if (current == nullptr || record.overlay.t_s.empty()) continue;
    floors = floors && !std::isnan(current->floor);
    worst.push_back({current->nrmse, &record});
  }
  if (floors) {
    for (auto& [badness, record] : worst) badness /= current_of(*record)->floor;
  }
  std::stable_sort(worst.begin(), worst.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  Json out = Json::array();
  for (std::size_t k = 0; k < std::min(kOverlays, worst.size()); ++k)
    out.push_back(overlay(*worst[k].second));
  return out;
}

Json tables(const est::CompareResult& result) {
  Json out = Json::array();
  for (const auto& record : result.records) {
    if (record.points.empty()) continue;
    Json points = Json::array();
    for (const auto& point : record.points) {
      Json entry = {{"slip", rounded(100.0 * point.conditions.slip)}};
      for (const auto& [name, pair] : point.channels)
        entry[name] = {rounded(pair.measured), rounded(pair.predicted)};
      points.push_back(entry);
    }
    out.push_back({{"id", record.id}, {"points", points}});
  }
  return out;
}

}  // namespace

std::string chart_data(const est::CompareResult& result) {
  Json out = {{"bars", Json::array()},
              {"dots", Json::array()},
              {"overlays", overlays(result)},
              {"tables", tables(result)}};
  for (const auto& record : result.records) {
    add_dots(record, out["dots"]);
    const auto* current = current_of(record);
    if (current == nullptr || out["bars"].size() >= kMaxBars) continue;
    out["bars"].push_back({{"id", record.id},
                           {"holdout", record.holdout},
                           {"error", rounded(100.0 * current->nrmse)},
                           {"floor", rounded(100.0 * current->floor)}});
  }
  return out.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace imrig
