#include "rig/cli/report/chart_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "estimators/diagnose/worst_records.h"
#include "rig/cli/compare_text.h"
#include "rig/cli/json_number.h"

namespace imrig {

namespace {

constexpr std::size_t kMaxBars = 600;

// Rounded for the page: what a screen can show.
Json rounded(double x) {
  return std::isfinite(x) ? Json(std::stod(fmt::format("{:.6g}", x))) : Json(nullptr);
}

const est::ChannelResult* current_of(const est::ComparedRecord& record) {
  const auto found = record.channels.find("current_A");
  return record.left_out.empty() && found != record.channels.end() ? &found->second : nullptr;
}

// Error of each bin over every condition that varies, channel by channel: what the heat map and the steps
// over the dots show.
Json map_data(const est::FailureMap& map) {
  Json out = {{"from", map.from}, {"shuffled", map.shuffled}, {"conditions", Json::array()}};
  for (const auto& condition : map.conditions) {
    if (condition.bins.size() < 2) continue;
    const ShownCondition words = shown_condition(condition.name);
    Json bins = Json::array();
    for (const auto& bin : condition.bins) {
      Json channels = Json::object();
      for (const auto& [name, c] : bin.channels)
        channels[name] = {{"error", rounded(100.0 * c.nrmse)}, {"chi2", rounded(c.chi2_per_dof)}};
      bins.push_back({{"low", rounded(words.scale * bin.low)},
                      {"high", rounded(words.scale * bin.high)},
                      {"text", shown_bin(condition.name, bin)},
                      {"stretches", bin.stretches},
                      {"records", bin.records},
                      {"channels", channels}});
    }
    out["conditions"].push_back({{"name", condition.name},
                                 {"text", words.text},
                                 {"p", rounded(condition.p_value)},
                                 {"share", rounded(100.0 * condition.share)},
                                 {"channel", condition.channel},
                                 {"bins", bins}});
  }
  return out;
}

// Spectrum of one record: largest amplitude in each step of frequency, and the lines looked at.
Json spectrum_data(const est::ComparedRecord& record) {
  Json curve = Json::array(), lines = Json::array();
  const est::RecordLines& own = record.lines;
  for (std::size_t k = 0; k < own.f_Hz.size(); ++k)
    curve.push_back({{"x", rounded(own.f_Hz[k])}, {"y", rounded(own.amplitude_A[k])}});
  for (std::size_t k = 0; k < own.lines.size(); ++k) {
    const est::RecordLine& line = own.lines[k];
    if (std::isnan(line.amplitude_A)) continue;
    lines.push_back({{"x", rounded(line.f_Hz)},
                     {"y", rounded(line.amplitude_A)},
                     {"noise", rounded(line.noise_A)},
                     {"over", rounded(line.over_noise())},
                     {"name", est::line_kinds()[k].name},
                     {"hint", est::line_kinds()[k].hint}});
  }
  return {{"id", record.id}, {"curve", curve}, {"lines", lines}};
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
              {"maps", Json::array()},
              {"spectra", Json::array()},
              {"overlays", Json::array()},
              {"tables", tables(result)}};
  for (const auto& map : result.maps) out["maps"].push_back(map_data(map));
  for (const auto* record : est::worst_records(result, est::kOverlays)) {
    out["overlays"].push_back(overlay(*record));
    if (!record->lines.f_Hz.empty()) out["spectra"].push_back(spectrum_data(*record));
  }
  for (const auto& record : result.records) {
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
