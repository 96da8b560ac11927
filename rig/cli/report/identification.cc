#include "rig/cli/report/identification.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "rig/cli/identify_maps_text.h"
#include "rig/cli/json_number.h"
#include "rig/cli/report/assets.h"
#include "rig/cli/report/html.h"

namespace imrig {

namespace {

constexpr std::size_t kShownSteps = 3;
constexpr int kCurve = 120;
constexpr double kLargestSlip = 0.1;  // of figure 4

Json rounded(double x) { return std::isfinite(x) ? Json(std::stod(fmt::format("{:.6g}", x))) : Json(nullptr); }

// Points or a line of one chart.
struct Curve {
  Json points = Json::array();
  void add(double x, double y) {
    if (std::isfinite(x) && std::isfinite(y)) points.push_back({{"x", rounded(x)}, {"y", rounded(y)}});
  }
};

class Charts {
 public:
  void begin(const std::string& title, const std::string& x, const std::string& y) {
    chart_ = {{"title", title}, {"x", x}, {"y", y}, {"series", Json::array()}};
  }
  void series(const std::string& name, const Curve& curve, bool line) {
    if (!curve.points.empty()) chart_["series"].push_back({{"name", name}, {"line", line}, {"points", curve.points}});
  }
  void end() {
    if (!chart_["series"].empty()) all_.push_back(chart_);
  }
  std::string text() const { return all_.dump(-1, ' ', false, Json::error_handler_t::replace); }

 private:
  Json chart_, all_ = Json::array();
};

template <class Function>
Curve curve_of(double from, double to, Function f) {
  Curve out;
  for (int k = 0; k <= kCurve; ++k) {
    const double x = from + (to - from) * k / kCurve;
    out.add(x, f(x));
  }
  return out;
}

void resistance(const est::ResistanceLine& line, Charts& charts) {
  if (!line.failure.empty()) return;
  Curve points;
  double low = 1e9, high = -1e9;
  for (const auto& p : line.points) {
    points.add(p.stator_C, p.R_s_ohm);
    low = std::min(low, p.stator_C);
    high = std::max(high, p.stator_C);
  }
  charts.begin("R_s against the winding's temperature (figure 2)", "stator C", "R_s ohm");
  charts.series("dc records", points, false);
  charts.series("R_20 (1 + alpha (T - 20))", curve_of(low, high, [&](double T) { return line.at(T); }), true);
  charts.end();
}

// Lines: (8)-(9) of the model. Points: how far a tenth of the parameter moves the current of each record near that frequency.
void sensitivity(const est::MapsResult& result, Charts& charts) {
  const est::SensitivityCurve& curve = result.figure_4;
  charts.begin(fmt::format("Sensitivity of the current's error at {:.0f} Hz (figure 4)", curve.f_Hz), "slip %", "S / I");
  for (const char* name : {"R_r", "L_l", "L_m"}) {
    Curve line;
    for (std::size_t k = 0; k < curve.slip.size(); ++k) line.add(100.0 * curve.slip[k], curve.value[k].of(name));
    charts.series(fmt::format("line, {}", name), line, true);
    Curve points;
    for (const auto& row : result.base.records) {
      const auto found = row.parameters.find(name);
      const bool near = std::abs(std::abs(row.f_Hz) - curve.f_Hz) < 0.05 * curve.f_Hz && row.slip < kLargestSlip;
      if (near && found != row.parameters.end()) points.add(100.0 * row.slip, found->second.sensitivity);
    }
    charts.series(name, points, false);
  }
  charts.end();
}

void maps(const est::ParameterMaps& m, Charts& charts) {
  Curve L_m, loaded, L_l, R_r;
  for (const auto& p : m.points) {
    (p.for_L_m ? L_m : loaded).add(p.state.I_d_A, p.state.L_m_H);
    if (p.for_L_l) L_l.add(std::abs(p.phasor.i), p.L_l_H);
    if (p.for_R_r) R_r.add(p.state.I_q_A, p.state.R_r_ohm);
  }
  charts.begin("L_m against I_d (figure 5)", "I_d A", "L_m H");
  charts.series("light load, fitted", L_m, false);
  charts.series("others", loaded, false);
  if (m.L_m.known())
    charts.series("map", curve_of(m.L_m.lowest_A, m.L_m.highest_A, [&](double I) { return m.L_m.at(I); }), true);
  charts.end();
  charts.begin("L_l against I (figure 6)", "I A", "L_l H");
  charts.series("steady windows", L_l, false);
  if (m.L_l.known())
    charts.series("map", curve_of(m.L_l.lowest_A, m.L_l.highest_A, [&](double I) { return m.L_l.at(I); }), true);
  charts.end();
  charts.begin("R_r against I_q (figure 7)", "I_q A", "R_r ohm");
  charts.series("steady windows", R_r, false);
  charts.end();
}

void locked(const est::LockedResult& result, Charts& charts) {
  if (!result.failure.empty()) return;
  charts.begin("R_r against slip frequency, locked-like sweeps (figure 8)", "w_s rad/s", "R_r ohm");
  for (std::size_t g = 0; g < result.sweeps.size(); ++g) {
    Curve points;
    double high = 0.0;
    for (const auto& p : result.points) {
      if (p.sweep != g || !p.left_out.empty()) continue;
      points.add(p.w_s, p.R_r_ohm);
      high = std::max(high, p.w_s);
    }
    const est::LockedSweep& sweep = result.sweeps[g];
    const std::string name = fmt::format("winding {:.0f} C", sweep.stator_C);
    charts.series(name, points, false);
    charts.series("line, " + name, curve_of(0.0, high, [&](double w) { return sweep.R_1.value + result.k_6.value * w; }),
                  true);
  }
  charts.end();
}

void losses(const est::CoreLossResult& core, Charts& charts) {
  if (!core.failure.empty()) return;
  std::map<long, std::pair<Curve, Curve>> by_frequency;  // rotor losses, core loss
  for (const auto& p : core.points) {
    auto& [rotor, iron] = by_frequency[std::lround(p.w_e / (2.0 * std::numbers::pi))];
    rotor.add(p.psi_r_Wb, p.P_rotor_W);
    iron.add(p.psi_r_Wb, core.physics.core_W(p.w_e, p.psi_r_Wb));
  }
  charts.begin("Rotor losses at no load, measured and by the network (figures 9, 10)", "psi_r Wb", "W");
  for (const auto& [f, curves] : by_frequency) {
    charts.series(fmt::format("{} Hz", f), curves.first, false);
    const double w = 2.0 * std::numbers::pi * static_cast<double>(f);
    charts.series(fmt::format("network, {} Hz", f),
                  curve_of(0.0, 0.5, [&](double psi) { return core.network.at(psi, w); }), true);
  }
  charts.end();
  charts.begin("Core loss by the physical law (figure 11)", "psi_r Wb", "W");
  for (const auto& [f, curves] : by_frequency) charts.series(fmt::format("{} Hz", f), curves.second, true);
  charts.end();
}

void transient(const est::TransientCheck& check, const std::string& title, Charts& charts) {
  Curve measured, full, rated;
  for (std::size_t k = 0; k < check.t_s.size(); ++k) {
    measured.add(check.t_s[k], std::abs(check.measured[k]));
    full.add(check.t_s[k], std::abs(check.full[k]));
    rated.add(check.t_s[k], std::abs(check.rated[k]));
  }
  charts.begin(fmt::format("{}: {}, {:.0f} Hz", title, check.id, check.f_Hz), "s", "|i| A");
  charts.series("measured", measured, true);
  charts.series(fmt::format("maps ({:.2f} % off)", 100.0 * check.full_nrmse), full, true);
  charts.series(fmt::format("constant parameters ({:.2f} % off)", 100.0 * check.rated_nrmse), rated, true);
  charts.end();
}

void validation(const est::Validation& v, Charts& charts) {
  Curve full, rated;
  for (const auto& p : v.powers) {
    full.add(p.measured_W, p.full_W - p.measured_W);
    rated.add(p.measured_W, p.rated_W - p.measured_W);
  }
  charts.begin("Input power, calculated less measured (figure 13)", "measured W", "W");
  charts.series("maps", full, false);
  charts.series("constant parameters", rated, false);
  charts.end();
  std::vector<const est::TransientCheck*> steps;
  for (const auto& check : v.steps) steps.push_back(&check);
  std::stable_sort(steps.begin(), steps.end(),
                   [](const auto* a, const auto* b) { return a->rated_nrmse > b->rated_nrmse; });
  for (std::size_t k = 0; k < std::min(kShownSteps, steps.size()); ++k)
    transient(*steps[k], "Voltage step (figures 14 to 16)", charts);
  for (const auto& check : v.starts) transient(check, "Start from zero (figures 17, 18)", charts);
}

// Escaped line by line: the line ends stay.
std::string escaped_lines(const std::string& text) {
  std::string out;
  for (std::size_t from = 0; from < text.size();) {
    const std::size_t to = std::min(text.find('\n', from), text.size());
    out += escaped(text.substr(from, to - from));
    out += '\n';
    from = to + 1;
  }
  return out;
}

constexpr const char* kScript = R"js(
const colours = ["#1f6feb", "#d1495b", "#2e8b57", "#b8860b", "#6a4c93", "#008b8b", "#8b4513", "#555"];
for (const chart of JSON.parse(document.getElementById("data").textContent)) {
  const box = document.createElement("div");
  box.innerHTML = "<h2></h2><canvas height='110'></canvas>";
  box.firstChild.textContent = chart.title;
  document.getElementById("charts").appendChild(box);
  const of = {};
  const datasets = chart.series.map((s, k) => {
    const key = s.name.replace(/^(line|network), /, "");
    of[key] = of[key] || colours[Object.keys(of).length % colours.length];
    return { label: s.name, data: s.points, showLine: s.line, pointRadius: s.line ? 0 : 2.5, borderWidth: 1.5,
             borderColor: of[key], backgroundColor: of[key] };
  });
  new Chart(box.lastChild, { type: "scatter", data: { datasets }, options: { animation: false,
    scales: { x: { title: { display: true, text: chart.x } }, y: { title: { display: true, text: chart.y } } } } });
}
)js";

}  // namespace

std::string identification_html(const est::MapsResult& result) {
  Charts charts;
  resistance(result.maps.R_s, charts);
  sensitivity(result, charts);
  maps(result.maps, charts);
  locked(result.maps.locked, charts);
  losses(result.maps.core, charts);
  validation(result.validation, charts);
  const std::string name = escaped(result.base.model.name);
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>{0}: identification</title>\n<style>\n{1}"
      "</style>\n</head>\n<body>\n<main>\n<h1>{0} <span>identified</span></h1>\n<div class=\"wide\"><pre>{2}</pre></div>\n"
      "<div id=\"charts\"></div>\n</main>\n<script type=\"application/json\" id=\"data\">{3}</script>\n<script>{4}</script>\n"
      "<script>{5}</script>\n</body>\n</html>\n",
      name, std::string(kReportStyle), escaped_lines(maps_text(result)), escaped_json(charts.text()), std::string(kChartJs),
      kScript);
}

std::string write_identification_report(const est::MapsResult& result, const std::string& folder) {
  return write_page(folder, identification_html(result));
}

}  // namespace imrig
