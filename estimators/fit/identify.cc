#include "estimators/fit/identify.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "estimators/fit/assemble.h"
#include "estimators/fit/combine.h"
#include "estimators/fit/data_nominal.h"
#include "estimators/fit/dc_test.h"
#include "estimators/fit/global/start_from_data.h"
#include "estimators/fit/goodness.h"
#include "estimators/fit/maps/resistance_line.h"
#include "estimators/fit/series_records.h"
#include "estimators/fit/standstill/standstill_records.h"
#include "estimators/fit/student_t.h"
#include "estimators/fit/table_records.h"
#include "rig/base/error.h"

namespace imrig::est {

namespace {

constexpr double kSaturationPerFlux =
    0.5 / 0.4765;  // the paper's 0.5 Wb over the flux of its motor at 220 V, 60 Hz
constexpr double kSpeaksForResistance =
    0.05;  // relative sigma of a record that tells R_s where no DC test did
constexpr std::array<const char*, 5> kMethods{"auto", "dc", "transient", "standstill", "points"};

using Rows = std::vector<std::size_t>;

bool is_standstill(RecordKind kind) { return kind == RecordKind::kStandstill; }

class Identification {
 public:
  Identification(const DataSet& data, const IdentifyOptions& options) : data_(data), options_(options) {
    for (const auto& record : data.records) {
      RecordResult row;
      row.id = record.id;
      row.kind = record.kind;
      row.holdout = record.holdout;
      if (row.holdout) row.rejected = "hold-out: judged, never fitted";
      result_.records.push_back(row);
    }
    start_model();
  }

  IdentifyResult run() {
    const bool all = options_.method == "auto";
    const bool no_dc = options_.method == "points" || options_.method == "standstill";
    const Rows dc = no_dc ? Rows{} : rows([](RecordKind kind) { return kind == RecordKind::kDc; });
    const Rows standing = all || options_.method == "standstill" ? rows(is_standstill) : Rows{};
    Rows series = all || options_.method == "transient" ? rows(is_series_kind) : Rows{};
    if (all) std::erase_if(series, [&](std::size_t k) { return is_standstill(data_.records[k].kind); });
    const Rows tables = all || options_.method == "points"
                            ? rows([](RecordKind kind) { return kind == RecordKind::kPoints; })
                            : Rows{};
    const bool something = !series.empty() || !tables.empty() || !standing.empty() ||
                           (options_.method != "transient" && !dc.empty());
    if (!something) {
      throw Error("method \"" + options_.method + "\"",
                  "finds no record it can use in \"" + data_.name + "\"",
                  "imrig info lists the records' kinds");
    }
    measure_resistance(dc);
    fit_standing(dc, standing);
    if (!R_s_known()) given_resistance();
    if (!series.empty()) fit_series(series);
    for (const std::size_t k : tables)
      fit_table_record(data_, data_.records[k], R_s_, given_circuit(), options_, result_.records[k]);
    assemble_model(series, tables, standing);
    if (together() && !(series.empty() && tables.empty() && standing.empty())) fit_together();
    finish();
    return std::move(result_);
  }

 private:
  template <class Wanted>
  Rows rows(Wanted wanted) const {
    Rows out;
    for (std::size_t k = 0; k < data_.records.size(); ++k) {
      if (!data_.records[k].holdout && wanted(data_.records[k].kind)) out.push_back(k);
    }
    return out;
  }

  std::vector<RecordResult*> results(const Rows& which) {
    std::vector<RecordResult*> out;
    for (const std::size_t k : which) out.push_back(&result_.records[k]);
    return out;
  }

  void start_model() {
    if (options_.nominal) {
      result_.model = *options_.nominal;
      result_.model.effects.clear();
    } else {
      result_.model.name = data_.name.empty() ? "motor" : data_.name;
    }
    result_.model.pole_pairs = data_.pole_pairs;
    result_.model.delta = data_.delta;
    if (data_.delta)
      note("motor in delta: all values are those of the equivalent star, a third of the delta phase's");
    if (options_.nominal && options_.nominal->pole_pairs != data_.pole_pairs) {
      throw Error("model \"" + options_.nominal->name + "\"",
                  fmt::format("has {} pole pairs", options_.nominal->pole_pairs),
                  fmt::format("the data has {}", data_.pole_pairs));
    }
  }

  void note(const std::string& text) { result_.notes.push_back(text); }
  bool together() const { return options_.method == "auto" && options_.together; }
  bool R_s_known() const { return std::isfinite(R_s_); }

  // ---- R_s from direct current, else from standstill records, else from the given model

  void measure_resistance(const Rows& dc) {
    double stator_C = 0.0;
    int with_temperature = 0;
    std::vector<ResistancePoint> points;
    for (const std::size_t k : dc) {
      RecordResult& row = result_.records[k];
      const DcResult fit = fit_dc(data_.records[k].series);
      row.notes = fit.notes;
      row.rejected = fit.failure;
      if (!fit.failure.empty()) continue;
      const double sigma = fit.sigma_ohm * student_t_975(fit.degrees_of_freedom) / kNormal975;
      row.parameters["R_s"] = {fit.R_s_ohm, sigma, 0.0, "ohm", "", false};
      row.used_for = {"R_s"};
      points.push_back({row.id, fit.stator_C, fit.R_s_ohm, sigma});
      if (std::isfinite(fit.stator_C)) {
        stator_C += fit.stator_C;
        ++with_temperature;
      }
    }
    if (resistance_by_temperature(points)) return;
    const Parameter found = assemble("R_s", results(dc), 0.0, data_.accuracy, result_.notes);
    if (found.known() && useless("R_s from the dc test", found)) {
      if (points.size() > 1) note("the dc records disagree: where voltages are commands, the inverter's dead time does that");
      for (RecordResult* row : results(dc)) {
        if (std::erase(row->used_for, "R_s") > 0) row->rejected = "R_s: the dc records do not tell it";
      }
    } else if (found.known()) {
      take_resistance(found, "dc test, ");
      result_.model.R_s_stator_C = with_temperature > 0 ? stator_C / with_temperature : kMissing;
    }
  }

  // Not a number that a motor can have, or nothing but its interval where all records together may know better.
  bool useless(const std::string& name, const Parameter& found) {
    if (is_result(found) || (!together() && found.value > 0.0)) return false;
    note(fmt::format("{} = {:.4g} {} [{:.4g}, {:.4g}] is no result: its interval is wider than itself", name, found.value, found.unit,
                     found.ci95_low, found.ci95_high));
    return true;
  }

  // DC records cold and hot: a line over temperature, and R_s where the other records are.
  bool resistance_by_temperature(const std::vector<ResistancePoint>& points) {
    const double gains = gain_sigma(data_.accuracy);
    R_s_line_ = resistance_line(points, gains);
    if (!R_s_line_.failure.empty()) return false;
    double sum = 0.0, n = 0.0;
    for (const auto& record : data_.records) {
      if (record.kind == RecordKind::kDc || record.series.stator_C.empty()) continue;
      if (!std::isfinite(record.series.stator_C.front())) continue;
      sum += record.series.stator_C.front();
      n += 1.0;
    }
    const double here_C = n > 0.0 ? sum / n : points.front().stator_C;
    const double R = R_s_line_.at(here_C);
    const double half = kNormal975 * std::hypot(R_s_line_.sigma_at(here_C), gains * R);
    take_resistance({R, R - half, R + half, "ohm", fmt::format("{} records over temperature", points.size())},
                    "dc test, ");
    result_.model.R_s_stator_C = here_C;
    return true;
  }

  // As one measurement among others R_s has the mean's own sigma: a quantile for few records belongs to
  // intervals.
  std::optional<DcResistance> resistance_of(const Rows& dc) const {
    std::vector<Contribution> all;
    SpaceVector current = 0.0;
    for (const std::size_t k : dc) {
      const auto found = result_.records[k].parameters.find("R_s");
      if (result_.records[k].used_for.empty()) continue;
      all.push_back({found->second.value, found->second.sigma});
      for (const SpaceVector& i : data_.records[k].series.i) current += i;
    }
    if (all.empty() || !R_s_known()) return std::nullopt;
    return DcResistance{R_s_, combine(all).sigma / R_s_, std::arg(current)};
  }

  // The dc test's R_s, where there is one, helps the standstill records; they find it where there is none.
  void fit_standing(const Rows& dc, const Rows& standing) {
    const auto known = resistance_of(dc);
    for (const std::size_t k : standing)
      fit_standstill_record(data_, data_.records[k], options_, known, result_.records[k]);
    if (R_s_known()) return leave_resistance_to_dc(standing);
    const Parameter found = assemble("R_s", results(standing), 0.0, data_.accuracy, result_.notes);
    if (found.known()) take_resistance(found, "standstill, ");
  }

  void given_resistance() {
    if (options_.nominal && options_.nominal->R_s.known()) nominal_resistance(options_.nominal->R_s);
  }

  void leave_resistance_to_dc(const Rows& standing) {
    for (RecordResult* row : results(standing)) {
      if (std::erase(row->used_for, "R_s") > 0)
        row->parameters["R_s"].left_out = "the dc test tells R_s, and has helped here";
      if (row->used_for.empty() && row->rejected.empty()) row->rejected = "R_s: the dc test tells it";
    }
  }

  void take_resistance(Parameter found, const std::string& how) {
    found.found = how + found.found;
    result_.model.R_s = found;
    identified_ = true;
    R_s_ = found.value;
    const double whole = 0.5 * (found.ci95_high - found.ci95_low) / kNormal975;
    const double gains = gain_sigma(data_.accuracy) * found.value;
    R_s_sigma_ = std::sqrt(
        std::max(0.0, whole * whole - gains * gains));  // the gains are added to every impedance once
  }

  void nominal_resistance(const Parameter& given) {
    R_s_ = given.value;
    const double width = given.ci95_high - given.ci95_low;
    R_s_sigma_ = std::isfinite(width) ? 0.5 * width / kNormal975 : 0.0;
    if (options_.method == "dc") return;
    note(fmt::format(
        "R_s was not measured: {:.4g} ohm is the given model's{}", R_s_,
        std::isfinite(width) ? "" : ", without an interval, so the others' intervals leave it out"));
  }

  // ---- time series

  SeriesSetting series_setting(const Rows& which) {
    SeriesSetting setting;
    const Ratings& r = result_.model.ratings;
    const bool rated = r.voltage_V > 0.0 && r.frequency_Hz > 0.0;
    const auto points = given_circuit() && rated ? std::vector<SteadyPoint>()
                                                 : steady_points(data_, which, options_.threads);
    const auto rough = given_circuit() ? std::nullopt : nominal_from_points(points, data_.pole_pairs, R_s_);
    if (const auto given = given_circuit()) {
      setting.nominal = *given;
    } else if (rough) {
      setting.nominal = rough->theta;
      setting.nominal_from_data = true;
    } else {
      setting.nominal = {0.5, 0.5, 0.01,
                         0.1};  // no steady stretch anywhere: each record's own grid of starts decides
      setting.nominal_from_data = true;
    }
    if (R_s_known()) setting.nominal.R_s = R_s_;
    if (R_s_line_.failure.empty()) {
      setting.R_s_per_K = R_s_line_.R_20.value * R_s_line_.alpha.value / R_s_;
      setting.R_s_reference_C = result_.model.R_s_stator_C;
    }
    const double flux = rated ? r.voltage_V * std::sqrt(2.0) / kSqrt3 / (2.0 * kPi * r.frequency_Hz)
                              : largest_flux_Wb(points);
    setting.saturation_flux_Wb = kSaturationPerFlux * flux;
    return setting;
  }

  std::optional<MachineParameters<double>> given_circuit() const {
    if (!options_.nominal) return std::nullopt;
    const Model& m = *options_.nominal;
    if (!m.R_r.known() || !m.L_l.known() || !m.L_m.known()) return std::nullopt;
    return MachineParameters<double>{m.R_s.known() ? m.R_s.value : m.R_r.value, m.R_r.value, m.L_l.value,
                                     m.L_m.value};
  }

  void fit_series(const Rows& which) {
    SeriesSetting setting = series_setting(which);
    if (!R_s_known()) {
      if (!resistance_from_series(which, setting)) return;
      setting.nominal.R_s = R_s_;
    }
    take(which, fit_series_records(data_, which, setting, options_));
  }

  void take(const Rows& which, std::vector<RecordResult> fitted) {
    for (std::size_t k = 0; k < which.size(); ++k) result_.records[which[k]] = std::move(fitted[k]);
  }

  // A first pass with R_s as a fourth unknown. False where no record tells it and all of them together may.
  bool resistance_from_series(const Rows& which, SeriesSetting setting) {
    setting.fit_R_s = true;
    IdentifyOptions loose = options_;
    loose.max_relative_sigma = kSpeaksForResistance;
    std::vector<RecordResult> fitted = fit_series_records(data_, which, setting, loose);
    std::vector<RecordResult*> speaking;
    for (auto& row : fitted) speaking.push_back(&row);
    const Parameter found = assemble("R_s", speaking, 0.0, data_.accuracy, result_.notes);
    if (!found.known() || useless("R_s from single records", found)) {
      if (together()) return leave_to_all(which, std::move(fitted)), false;
      throw Error(
          "R_s",
          "is in no dc record, in no given model, and no record separates it from the other parameters",
          "add a dc record, or give a model with R_s");
    }
    take_resistance(found, "transient with R_s free, ");
    note(fmt::format("no dc record to use: R_s = {:.4g} ohm was fitted with the other parameters", R_s_));
    return true;
  }

  void leave_to_all(const Rows& which, std::vector<RecordResult> fitted) {
    for (RecordResult& row : fitted) {
      if (row.rejected.empty()) row.rejected = "does not tell R_s, and there is no other R_s to fit the rest with";
      row.used_for.clear();
      for (auto& [name, estimate] : row.parameters) estimate.weak = false;
    }
    take(which, std::move(fitted));
  }

  // ---- the model

  static std::string sources(const std::vector<std::pair<std::string, const Rows*>>& all) {
    std::string out;
    for (const auto& [name, which] : all) {
      if (!which->empty()) out += (out.empty() ? "" : " and ") + name;
    }
    return out;
  }

  void assemble_model(const Rows& series, const Rows& tables, const Rows& standing) {
    Rows both = series;
    both.insert(both.end(), tables.begin(), tables.end());
    both.insert(both.end(), standing.begin(), standing.end());
    const std::string from =
        sources({{"transient", &series}, {"points", &tables}, {"standstill", &standing}});
    for (const auto& base : base_parameters()) {
      if (base.place == &Model::R_s && R_s_known()) continue;
      Parameter found = assemble(base.name, results(both), R_s_sigma_, data_.accuracy, result_.notes);
      if (found.known() && !useless(base.name, found)) {
        found.found = from + ", " + found.found;
        result_.model.*base.place = found;
        identified_ = true;
      } else if (!both.empty()) {
        const bool kept = (result_.model.*base.place).known();
        note(fmt::format("{} is not determined by these records{}", base.name,
                         kept ? "; the given model's value is kept" : ""));
      }
    }
  }

  // ---- what the records one by one leave open

  void fit_together() {
    DataStart start;
    try {
      start = start_from_data(result_.model, data_, options_.threads);
    } catch (const Error& e) {
      note(std::string("all records together: ") + e.what());
      return;
    }
    if (start.sentence.empty() || (start.together.empty() && !identified_)) return;
    const auto refound = [&](const std::string& text) {
      return std::any_of(start.together.begin(), start.together.end(), [&](const std::string& name) {
        return text.starts_with(name + " is not determined") || text.starts_with(name + ": no record") ||
               (name == "R_s" && text.starts_with("no dc record to use"));
      });
    };
    std::erase_if(result_.notes, refound);
    note(start.sentence);
    for (const std::size_t k : start.records) add_use(start, result_.records[k]);
    result_.model = std::move(start.model);
    identified_ = true;
  }

  // A record that alone told nothing had its part.
  static void add_use(const DataStart& start, RecordResult& row) {
    for (const std::string& name : start.together) {
      if (std::find(row.used_for.begin(), row.used_for.end(), name) == row.used_for.end()) row.used_for.push_back(name);
    }
    if (start.together.empty() || row.rejected.empty()) return;
    row.notes.push_back("used with all records together; alone: " + row.rejected);
    row.rejected.clear();
  }

  void finish() {
    if (!identified_)
      throw Error("identification", "no record determines any parameter: " + first_reason(), "");
    for (auto& row : result_.records) {
      if (row.used_for.empty() && row.rejected.empty())
        row.rejected = "not of a kind that method \"" + options_.method + "\" uses";
    }
    Revision revision;
    revision.number = result_.model.history.empty() ? 1 : result_.model.history.back().number + 1;
    revision.change = "identified, method " + options_.method;
    revision.data = data_.name;
    revision.data_hash = data_.hash;
    add_goodness(revision);
    result_.model.history.push_back(revision);
  }

  void add_goodness(Revision& revision) const {
    for (const auto& base : base_parameters()) {
      if (!(result_.model.*base.place).known()) return;
    }
    const Goodness found = goodness(result_.model.machine(), data_, options_.threads);
    revision.fitted_nrmse = found.fitted_nrmse;
    revision.holdout_nrmse = found.holdout_nrmse;
  }

  std::string first_reason() const {
    for (const auto& row : result_.records) {
      if (!row.rejected.empty() && !row.holdout) return row.id + " " + row.rejected;
    }
    return "all records are hold-out";
  }

  const DataSet& data_;
  const IdentifyOptions& options_;
  IdentifyResult result_;
  ResistanceLine R_s_line_{"no dc record", {}, {}, {}, {}};
  double R_s_ = kMissing;
  double R_s_sigma_ = 0.0;  // without the gains
  bool identified_ = false;
};

}  // namespace

IdentifyResult identify(const DataSet& data, const IdentifyOptions& options) {
  if (std::find(kMethods.begin(), kMethods.end(), options.method) == kMethods.end()) {
    throw Error("method \"" + options.method + "\"", "is not available",
                "available are auto, dc, transient, standstill, points, locked, losses and maps");
  }
  if (data.pole_pairs < 1) throw Error("data set \"" + data.name + "\"", "has no number of pole pairs");
  return Identification(data, options).run();
}

}  // namespace imrig::est
