#include "estimators/fit/maps/identify_maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "rig/base/error.h"

namespace imrig::est {

namespace {

constexpr std::size_t kFewestNoLoad = 12;  // for a loss map worth making unasked

std::size_t count(const DataSet& data, RecordKind kind) {
  return static_cast<std::size_t>(std::count_if(data.records.begin(), data.records.end(), [kind](const Record& r) {
    return r.kind == kind && !r.holdout;
  }));
}

// The base fit that goes before the maps.
IdentifyResult base_fit(const DataSet& data, const IdentifyOptions& options, double slip_rule) {
  IdentifyOptions base = options;
  if (options.method == "locked" || options.method == "losses") {
    base.method = "dc";
    if (count(data, RecordKind::kDc) == 0) {
      if (!options.nominal || !options.nominal->R_s.known())
        throw Error("method \"" + options.method + "\"", "needs R_s", "add dc records, or give a model with R_s");
      IdentifyResult given;
      given.model = *options.nominal;
      given.model.pole_pairs = data.pole_pairs;
      for (const auto& record : data.records) {
        RecordResult row;
        row.id = record.id;
        row.kind = record.kind;
        row.holdout = record.holdout;
        given.records.push_back(row);
      }
      return given;
    }
  } else if (options.method == "maps") {
    base.method = "auto";
    base.together = false;  // the maps come from what single records and windows tell
    base.slip_rule = options.least_sensitivity > 0.0 ? 0.0 : slip_rule;
  }
  return identify(data, base);
}

std::vector<ResistancePoint> dc_points(const DataSet& data, const IdentifyResult& base) {
  std::vector<ResistancePoint> points;
  for (std::size_t k = 0; k < base.records.size(); ++k) {
    const RecordResult& row = base.records[k];
    const auto found = row.parameters.find("R_s");
    if (row.kind != RecordKind::kDc || !row.rejected.empty() || found == row.parameters.end()) continue;
    double sum = 0.0, n = 0.0;
    for (const double T : data.records[k].series.stator_C) {
      if (!std::isfinite(T)) continue;
      sum += T;
      n += 1.0;
    }
    points.push_back({row.id, n > 0.0 ? sum / n : kMissing, found->second.value, found->second.sigma});
  }
  return points;
}

// The records that the method may use.
std::vector<std::size_t> usable(const DataSet& data, const std::string& method) {
  std::vector<std::size_t> used;
  for (std::size_t k = 0; k < data.records.size(); ++k) {
    const RecordKind kind = data.records[k].kind;
    if (data.records[k].holdout) continue;
    if (method == "locked" && kind != RecordKind::kLockedSweep) continue;
    if (method == "losses" && kind == RecordKind::kLockedSweep) continue;
    used.push_back(k);
  }
  return used;
}

std::set<std::string> mapped_records(const DataSet& data, const ParameterMaps& maps) {
  std::set<std::string> ids;
  for (const auto& point : maps.points) {
    if (point.left_out.empty()) ids.insert(data.records[point.phasor.record].id);
  }
  for (const auto& point : maps.locked.points) {
    if (point.left_out.empty()) ids.insert(data.records[point.record].id);
  }
  for (const auto& point : maps.core.points) ids.insert(data.records[point.record].id);
  return ids;
}

// Records that the base fit had no use for and a map had: they say so instead.
void mark_used(MapsResult& result, const DataSet& data) {
  const auto ids = mapped_records(data, result.maps);
  for (auto& row : result.base.records) {
    if (!ids.contains(row.id) || row.holdout) continue;
    row.notes.push_back("used by the maps");
    if (row.used_for.empty()) {
      if (!row.rejected.empty()) row.notes.push_back("not for a transient fit: " + row.rejected);
      row.rejected.clear();
    }
  }
}

Parameter plain(double value, const char* unit) { return {value, kMissing, kMissing, unit, ""}; }

void add_map(Model& model, const std::string& name, std::map<std::string, Parameter> parameters) {
  std::erase_if(parameters, [](const auto& entry) { return !entry.second.known(); });
  std::erase_if(model.maps, [&](const ParameterMap& map) { return map.name == name; });
  if (!parameters.empty()) model.maps.push_back({name, std::move(parameters)});
}

void store(Model& model, const ParameterMaps& maps) {
  if (maps.R_s.failure.empty()) add_map(model, "R_s", {{"R_20", maps.R_s.R_20}, {"alpha", maps.R_s.alpha}});
  if (const auto& m = maps.L_m; m.known()) {
    add_map(model, "L_m",
            {{"L_0", m.L_0}, {"k_1", m.k_1}, {"k_2", m.k_2}, {"k_3", m.k_3}, {"knee", plain(m.knee_A, "A")},
             {"lowest", plain(m.lowest_A, "A")}, {"highest", plain(m.highest_A, "A")}});
  }
  if (const auto& m = maps.L_l; m.known()) {
    add_map(model, "L_l", {{"k_4", m.k_4}, {"k_5", m.k_5}, {"lowest", plain(m.lowest_A, "A")},
                           {"highest", plain(m.highest_A, "A")}});
  }
  if (const auto& m = maps.R_r; m.known()) {
    add_map(model, "R_r", {{"R_1", m.R_1}, {"per_K", m.per_K}, {"k_6", m.k_6}, {"reference", plain(m.reference_C, "C")}});
  }
  if (const DeepBar& bar = maps.R_r.bar; bar.known()) {
    add_map(model, "rotor_bars", {{"R_2", bar.R_2}, {"L_2", bar.L_2}, {"R_1", plain(bar.R_1_ohm, "ohm")}});
  }
  if (!maps.core.failure.empty()) return;
  const CoreLossLaw& law = maps.core.physics;
  add_map(model, "core_loss",
          {{"hysteresis", law.hysteresis_W}, {"eddy", law.eddy_W}, {"exponent", plain(law.exponent, "1")},
           {"w_0", plain(law.w_0, "rad/s")}, {"psi_0", plain(law.psi_0, "Wb")}, {"rise", plain(law.rise, "1")},
           {"rise_exponent", plain(law.rise_exponent, "1")}});
  add_map(model, "friction_windage",
          {{"coulomb", law.coulomb_Nm}, {"viscous", law.viscous_Nms}, {"windage", law.windage_Nms2}});
  add_map(model, "stray_drag", {{"drag", law.drag}, {"exponent", plain(law.drag_exponent, "1")}});
}

// Base parameters that no transient fit told, from the maps.
void fill(Model& model, const ParameterMaps& maps) {
  const auto take = [](Parameter& place, const Parameter& found) {
    if (!place.known() && found.known()) place = found;
  };
  take(model.L_m, maps.L_m.L_0);
  take(model.L_l, maps.L_l.k_5);
  take(model.R_r, maps.R_r.R_1);
}

bool complete(const Model& model) {
  return std::all_of(base_parameters().begin(), base_parameters().end(),
                     [&](const auto& base) { return (model.*base.place).known(); });
}

void sensitivities(MapsResult& out) {
  if (!complete(out.base.model)) return;
  const MachineParameters<double> machine = out.base.model.machine();
  for (std::size_t k = 0; k < out.base.records.size(); ++k) {
    const RecordResult& row = out.base.records[k];
    if (!(std::abs(row.f_Hz) > 0.0) || !std::isfinite(row.slip) || row.parameters.empty()) continue;
    out.sensitivities.push_back({k, row.slip, sensitivity_at(machine, 2.0 * kPi * std::abs(row.f_Hz), row.slip)});
  }
  const double rated = out.base.model.ratings.frequency_Hz;
  out.figure_4 = sensitivity_curve(machine, rated > 0.0 ? rated : 60.0);
}

// Beside constant parameters: the given model's, else those at the largest load measured, else the means over the records.
void judge(MapsResult& out, const DataSet& data, const IdentifyOptions& options) {
  if (!complete(out.base.model) || options.method == "locked") return;
  if (options.nominal && complete(*options.nominal)) {
    out.validation = validate(data, out.maps, options.nominal->machine(), "the given model");
  } else if (const auto rated = circuit_at_largest_power(out.maps, out.base.model.R_s.value)) {
    out.validation = validate(data, out.maps, *rated, "the steady window with the largest input power");
  } else {
    out.validation = validate(data, out.maps, out.base.model.machine(), "means over the records");
  }
  out.base.notes.insert(out.base.notes.end(), out.validation.notes.begin(), out.validation.notes.end());
}

void tell_failures(MapsResult& out, const std::string& method) {
  auto& notes = out.base.notes;
  const ParameterMaps& maps = out.maps;
  notes.insert(notes.end(), maps.notes.begin(), maps.notes.end());
  notes.insert(notes.end(), maps.core.notes.begin(), maps.core.notes.end());
  if (method == "locked" && !maps.locked.failure.empty())
    throw Error("method \"locked\"", maps.locked.failure, "campaigns/locked.toml takes what it needs");
  if (method == "losses" && !maps.core.failure.empty())
    throw Error("method \"losses\"", maps.core.failure, "campaigns/no_load.toml takes what it needs");
  if (method == "maps" && !maps.failure.empty()) throw Error("method \"maps\"", maps.failure, "");
  if (method != "locked" && !maps.core.failure.empty()) notes.push_back("losses: " + maps.core.failure);
  if (method != "locked" && !maps.L_m.known())
    notes.emplace_back("L_m(I_d): too few steady records at light load and different voltages");
}

}  // namespace

bool is_maps_method(const std::string& method) {
  return method == "maps" || method == "locked" || method == "losses";
}

MapsResult identify_with_maps(const DataSet& data, const IdentifyOptions& options, double slip_rule) {
  MapsResult out;
  out.slip_rule = slip_rule;
  out.least_sensitivity = options.least_sensitivity;
  if (data.pole_pairs < 1) throw Error("data set \"" + data.name + "\"", "has no number of pole pairs");
  out.base = base_fit(data, options, slip_rule);
  const bool allowed = options.method == "auto" && (count(data, RecordKind::kLockedSweep) > 0 ||
                                                    count(data, RecordKind::kNoLoad) >= kFewestNoLoad);
  if (!is_maps_method(options.method) && !allowed) return out;
  MapOptions wanted;
  wanted.slip_rule = slip_rule;
  if (out.base.model.R_s.known()) wanted.R_s_fallback = out.base.model.R_s.value;
  if (out.base.model.L_l.known()) wanted.L_l_start = out.base.model.L_l.value;
  if (options.method == "locked" && options.nominal && options.nominal->L_m.known())
    wanted.L_m_given = options.nominal->L_m.value;
  out.maps = map_parameters(data, usable(data, options.method), dc_points(data, out.base), wanted);
  tell_failures(out, options.method);
  out.mapped = true;
  store(out.base.model, out.maps);
  fill(out.base.model, out.maps);
  out.correlation = correlation_table(out.base.records, out.maps.points);
  out.correlation_covariance = correlation_table(out.base.records, out.maps.points, Kept::kByCovariance);
  sensitivities(out);
  mark_used(out, data);
  judge(out, data, options);
  if (!out.base.model.history.empty()) out.base.model.history.back().change = "identified, method " + options.method;
  return out;
}

}  // namespace imrig::est
