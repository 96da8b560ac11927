#include "rig/cli/identify_maps_text.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "estimators/model/map_forms.h"
#include "rig/cli/text_table.h"

namespace imrig {

namespace {

std::string interval(const est::Parameter& p) {
  return std::isfinite(p.ci95_low) ? fmt::format("[{}, {}]", shown(p.ci95_low, 5), shown(p.ci95_high, 5)) : "";
}

std::string percent(double share) { return std::isfinite(share) ? fmt::format("{} %", shown(100.0 * share, 3)) : "-"; }

std::string forms(const est::Model& model) {
  std::string out;
  for (const auto& form : est::map_forms()) {
    for (const auto& map : model.maps) {
      if (map.name != form.name) continue;
      TextTable table({fmt::format("<{} = {}", form.name, form.equation), "value", "<95 % interval", "<unit", "<found"});
      for (const auto& known : form.parameters) {
        const auto found = map.parameters.find(known.name);
        if (found == map.parameters.end()) continue;
        const est::Parameter& p = found->second;
        table.row({fmt::format("  {}", known.name), shown(p.value, 5), interval(p), p.unit, printable(p.found)});
      }
      out += fmt::format("\n{}", table.text());
    }
  }
  return out;
}

std::string correlations(const std::vector<est::CorrelationRow>& rows, const std::string& title) {
  bool any = false;
  std::vector<std::string> header{fmt::format("<{}", title), "records"};
  for (const char* name : est::kConditionNames) header.emplace_back(name);
  header.insert(header.end(), {"<strongest of I_d I_q I w_s", "<of all"});
  TextTable table(std::move(header));
  const auto name = [](int k) { return k < 0 ? std::string("-") : est::kConditionNames[static_cast<std::size_t>(k)]; };
  for (const auto& row : rows) {
    std::vector<std::string> cells{row.parameter, std::to_string(row.records)};
    for (const double c : row.value) cells.push_back(std::isfinite(c) ? fmt::format("{:+.4f}", c) : "-");
    cells.push_back(name(row.strongest));
    cells.push_back(name(row.strongest_of_all));
    table.row(std::move(cells));
    any = any || row.strongest >= 0;
  }
  return any ? fmt::format("\n{}", table.text()) : std::string();
}

std::string sweeps(const est::LockedResult& locked) {
  if (!locked.failure.empty()) return "";
  TextTable table({"locked-like sweep", "stator_C", "R_1 ohm", "<95 % interval", "records"});
  int number = 1;
  for (const auto& sweep : locked.sweeps) {
    table.row({std::to_string(number++), shown(sweep.stator_C, 4), shown(sweep.R_1.value, 5), interval(sweep.R_1),
               std::to_string(sweep.records)});
  }
  return fmt::format("\n{}what the straight line over w_s leaves: {} ohm rms\n", table.text(),
                     shown(locked.line_misfit_ohm, 3));
}

std::string losses(const est::CoreLossResult& core) {
  if (!core.failure.empty()) return "";
  TextTable table({"f_Hz", "psi_r Wb", "core W", "network", "friction, windage W", "network", "R_c ohm"});
  const est::CoreLossLaw& law = core.physics;
  for (const auto& p : core.points) {  // the largest flux at each frequency
    const double f = p.w_e / (2.0 * std::numbers::pi);
    bool largest = true;
    for (const auto& q : core.points) largest = largest && !(std::abs(q.w_e - p.w_e) < 1.0 && q.psi_r_Wb > p.psi_r_Wb);
    if (!largest) continue;
    const double friction_net = core.network.at(0.0, p.w_e);
    const double w_M = (p.w_e - p.w_s) * (law.synchronous_per_w_e);
    table.row({shown(f, 4), shown(p.psi_r_Wb, 3), shown(law.core_W(p.w_e, p.psi_r_Wb), 4),
               shown(core.network.at(p.psi_r_Wb, p.w_e) - friction_net, 4), shown(law.friction_Nm(w_M) * w_M, 4),
               shown(friction_net, 4), shown(law.R_c(p.w_e, p.psi_r_Wb), 4)});
  }
  return fmt::format("\n{}rotor losses of points not seen by the fit, rms: physical law {} W ({}), network {} W ({}); {} predicts better\n"
                     "the network counts stray losses at no load as core loss\n",
                     table.text(), shown(core.held_out.physics_W, 3), percent(core.held_out.physics_relative),
                     shown(core.held_out.network_W, 3), percent(core.held_out.network_relative),
                     core.held_out.physics_wins() ? "the law" : "the network");
}

std::string transients(const std::vector<est::TransientCheck>& checks, const char* what) {
  if (checks.empty()) return "";
  double full = 0.0, rated = 0.0;
  for (const auto& c : checks) {
    full += c.full_nrmse * c.full_nrmse / static_cast<double>(checks.size());
    rated += c.rated_nrmse * c.rated_nrmse / static_cast<double>(checks.size());
  }
  return fmt::format("{} {}: current error {} with maps, {} with constant parameters\n", checks.size(), what,
                     percent(std::sqrt(full)), percent(std::sqrt(rated)));
}

std::string validation(const est::Validation& v) {
  if (v.powers.empty() && v.starts.empty()) return "";
  std::string out = "\n";
  if (!v.powers.empty()) {
    out += fmt::format(
        "input power of {} steady windows, of {} W: rms {}, worst {} with maps; rms {}, worst {} with constant parameters\n",
        v.powers.size(), shown(v.rated_W, 4), percent(v.rms_full), percent(v.worst_full), percent(v.rms_rated),
        percent(v.worst_rated));
    if (v.held_out > 0)
      out += fmt::format("{} of them in records that no fit saw: rms {}, worst {}\n", v.held_out, percent(v.rms_held_out),
                         percent(v.worst_held_out));
  }
  out += fmt::format("constant parameters: those of {}\n", v.constants_from);
  return out + transients(v.steps, "voltage steps") + transients(v.starts, "starts from zero");
}

}  // namespace

std::string maps_text(const est::MapsResult& result) {
  if (!result.mapped) return "";
  std::string out = forms(result.base.model);
  if (std::isfinite(result.maps.L_m.misfit)) {
    out += fmt::format("left over, rms: L_m(I_d) {}, under load and saturated {} on the mean; L_l(I) {}; R_r {}\n",
                       percent(result.maps.L_m.misfit), percent(result.maps.L_m.load_misfit),
                       percent(result.maps.L_l.misfit), percent(result.maps.R_r.misfit));
  }
  out += sweeps(result.maps.locked) + losses(result.maps.core);
  const bool computed = result.least_sensitivity > 0.0, ruled = computed || result.slip_rule > 0.0;
  out += correlations(result.correlation, computed ? "correlation, by the computed sensitivity"
                                          : ruled  ? fmt::format("correlation, {} slip rule", percent(result.slip_rule))
                                                   : "correlation");
  if (ruled) out += correlations(result.correlation_covariance, "without the rule");
  return out + validation(result.validation);
}

}  // namespace imrig
