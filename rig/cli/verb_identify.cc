// imrig identify DATA... --out MODEL.toml: from measurements to a model with intervals.

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

#include "estimators/diagnose/compare.h"
#include "estimators/diagnose/refit_model.h"
#include "estimators/fit/flaw_moves.h"
#include "estimators/fit/identify.h"
#include "estimators/fit/maps/identify_maps.h"
#include "estimators/fit/maps/maps_json.h"
#include "estimators/fit/standstill/standstill_records.h"
#include "estimators/fit/student_t.h"
#include "estimators/model/model_file.h"
#include "rig/base/error.h"
#include "rig/cli/identify_maps_text.h"
#include "rig/cli/load_data.h"
#include "rig/cli/report/identification.h"
#include "rig/cli/text_table.h"
#include "rig/cli/verbs.h"

namespace imrig {

namespace {

constexpr std::size_t kNoiseDraws = 200;  // over all records

struct Options {
  std::vector<std::string> data;
  std::string out;
  std::string nominal;
  std::string method = "auto";
  std::string report;
  double slip_rule = est::kPaperSlipRule;
  std::string keep;
  bool sensitivity = false;
  bool json = false;
};

std::string interval(const est::Parameter& p) {
  return "[" + shown(p.ci95_low, 5) + ", " + shown(p.ci95_high, 5) + "]";
}

std::size_t used_by(const est::IdentifyResult& result, const std::string& parameter) {
  return static_cast<std::size_t>(
      std::count_if(result.records.begin(), result.records.end(), [&](const auto& record) {
        return std::find(record.used_for.begin(), record.used_for.end(), parameter) != record.used_for.end();
      }));
}

// The rig's estimate of one standstill record in the T circuit, and the published estimator beside it.
void print_standstill(const est::RecordResult& record) {
  const est::StandstillReport& report = *record.standstill;
  const est::StandstillFit& fit = report.fit;
  TextTable table({"<" + printable(record.id) + ", T circuit, L_s = L_r", "value", "<95 % interval", "<unit",
                   "published", "differs_%"});
  const auto row = [&](const char* name, double value, double sigma, const char* unit, auto published) {
    const double half = est::kNormal975 * std::hypot(sigma, report.gain_sigma) * value;
    const auto& other = report.published_circuit;
    table.row({name, shown(value, 5), "[" + shown(value - half, 5) + ", " + shown(value + half, 5) + "]",
               unit, other ? shown(published(*other), 5) : "-",
               other ? fmt::format("{:+.1f}", 100.0 * (published(*other) / value - 1.0)) : "-"});
  };
  const auto L_s = [](const est::TCircuit& t) { return t.L_ls + t.L_m; };
  row("R_s", fit.t.R_s, fit.sigma[0], "ohm", [](const est::TCircuit& t) { return t.R_s; });
  row("R_r", fit.t.R_r, fit.sigma_R_r_t, "ohm", [](const est::TCircuit& t) { return t.R_r; });
  row("L_s", L_s(fit.t), fit.sigma_L_s, "H", L_s);
  row("L_m", fit.t.L_m, fit.sigma_L_m_t, "H", [](const est::TCircuit& t) { return t.L_m; });
  fmt::print(
      "\n{}published: gradient estimator of Fang, Lin and Wang (2005), from zero over the record's {} s; "
      "{}\n",
      table.text(), shown(report.seconds, 3),
      report.published_circuit ? "it takes minutes to settle" : "its vector is no motor's yet");
}

// Which records each parameter was taken from, and why not from the others.
std::string kept_text(const est::IdentifyResult& result) {
  TextTable table({"<parameter", "fitted", "kept", "by_rule", "by_own_sigma_or_bound", "<the first left out"});
  for (const char* name : {"R_r", "L_l", "L_m"}) {
    std::size_t fitted = 0, rule = 0, own = 0;
    std::string first;
    for (const auto& record : result.records) {
      const auto found = record.parameters.find(name);
      if (found == record.parameters.end() || record.standstill || !std::isfinite(record.slip)) continue;
      ++fitted;
      if (found->second.left_out.empty()) continue;
      ++(found->second.by_rule ? rule : own);
      if (first.empty()) first = record.id + ": " + found->second.left_out;
    }
    if (fitted > 0)
      table.row({name, std::to_string(fitted), std::to_string(fitted - rule - own), std::to_string(rule), std::to_string(own),
                 printable(first)});
  }
  return table.empty() ? "" : "\n" + table.text();
}

void print_text(const est::MapsResult& mapped, const std::string& out) {
  const est::IdentifyResult& result = mapped.base;
  TextTable table({"<parameter", "value", "<95 % interval", "<unit", "records", "<found"});
  for (const auto& base : est::base_parameters()) {
    const est::Parameter& p = result.model.*base.place;
    if (!p.known()) continue;
    table.row({base.name, shown(p.value, 5), interval(p), base.unit,
               std::to_string(used_by(result, base.name)), printable(p.found)});
  }
  fmt::print("{}", table.text());
  for (const auto& base : est::base_parameters()) {
    if (est::is_start(result.model.*base.place))
      fmt::print("NOT DETERMINED: {}. The file holds a start for diagnose and improve, no result.\n", base.name);
  }
  for (const auto& record : result.records) {
    if (record.standstill && record.rejected.empty()) print_standstill(record);
  }
  fmt::print("{}{}", kept_text(result), maps_text(mapped));
  TextTable rejected({"<record not used", "<why"});
  for (const auto& record : result.records) {
    if (!record.rejected.empty()) rejected.row({printable(record.id), printable(record.rejected)});
  }
  if (!rejected.empty()) fmt::print("\n{}", rejected.text());
  for (const auto& note : result.notes) fmt::print("note: {}\n", printable(note));
  fmt::print("\nmodel written to {}\n", out);
}

void print_moves(const std::vector<est::FlawMoves>& moves) {
  std::vector<std::string> header{"<moves by, %"};
  for (const auto& base : est::base_parameters()) header.emplace_back(base.name);
  TextTable table(std::move(header));
  for (const auto& row : moves) {
    std::vector<std::string> cells{row.flaw};
    for (const auto& base : est::base_parameters()) {
      const auto found = row.moved.find(base.name);
      cells.push_back(found == row.moved.end() ? "-" : fmt::format("{:+.3f}", 100.0 * found->second));
    }
    table.row(std::move(cells));
  }
  fmt::print("\n{}", table.text());
}

// Long work shows where it is on a terminal and stays quiet in a pipe.
void show_progress(const est::Progress& progress) {
  std::fprintf(stderr, "\r\033[K%zu of %zu %s", progress.done, progress.total,
               printable(progress.record).c_str());
  if (progress.done == progress.total) std::fprintf(stderr, "\r\033[K");
  std::fflush(stderr);
}

// What the global fit could not tell is no success: named beside the results.
void add_caveats(const est::Model& model, std::vector<std::string>& notes) {
  const auto tell = [&](const std::string& name, const est::Parameter& p) {
    const std::size_t at = p.found.find(": ");
    if (p.found.starts_with("global fit: ")) notes.push_back(name + ": " + p.found.substr(at + 2));
  };
  for (const auto& base : est::base_parameters()) tell(base.name, model.*base.place);
  for (const auto* list : {&model.effects, &model.corrections}) {
    for (const auto& effect : *list) {
      for (const auto& [name, parameter] : effect.parameters) tell(effect.name + "." + name, parameter);
    }
  }
}

// The model's history says how far it was from the data it came from.
void judge(est::Model& model, const DataSet& data) {
  if (model.history.empty()) return;
  for (const auto& base : est::base_parameters()) {
    if (!(model.*base.place).known()) return;  // a dc test alone makes no model that can be simulated
  }
  try {
    est::CompareOptions options;  // the floor of many records needs few draws of noise in each
    options.noise_draws = static_cast<int>(std::clamp<std::size_t>(kNoiseDraws / std::max<std::size_t>(1, data.records.size()), 1, 8));
    const est::CompareResult result = est::compare(model, data, options);
    model.history.back().fitted_nrmse = result.fitted.nrmse;
    model.history.back().holdout_nrmse = result.holdout.nrmse;
    model.history.back().floor_nrmse = result.fitted.floor_nrmse;
  } catch (const Error&) {
    // Nothing to judge by: the figures stay unknown.
  }
}

void run(const Options& options) {
  est::IdentifyOptions wanted;
  wanted.method = options.method;
  if (!options.nominal.empty()) wanted.nominal = est::load_model(options.nominal);
  const bool by_slip = options.keep == "slip", by_covariance = options.keep == "covariance";
  if (options.keep == "sensitivity") wanted.least_sensitivity = est::kLeastSensitivity;
  if (by_slip) wanted.slip_rule = options.slip_rule;
  const double slip_rule = by_covariance ? 0.0 : options.slip_rule;
  if (::isatty(STDERR_FILENO) != 0) wanted.progress = show_progress;
  const DataSet data = load_data(options.data);
  const bool global = options.method == "global";
  if (global) wanted.method = "auto";
  est::MapsResult result = est::identify_with_maps(data, wanted, slip_rule);
  // Of the base parameters, as the per-record methods find them.
  est::IdentifyOptions again = wanted;
  if (est::is_maps_method(wanted.method)) again.method = "auto", again.slip_rule = wanted.least_sensitivity > 0.0 ? 0.0 : slip_rule;
  const auto moves =
      options.sensitivity ? est::flaw_moves(data, again, est::identify(data, again).model) : std::vector<est::FlawMoves>();
  judge(result.base.model, data);
  if (global) {
    if (wanted.nominal) result.base.model.effects = wanted.nominal->effects;
    result.base.model = est::refit_model(result.base.model, data, "identified, method global", wanted.threads);
    add_caveats(result.base.model, result.base.notes);
  }
  est::save_model(result.base.model, options.out);
  if (!options.report.empty()) write_identification_report(result, options.report);
  if (options.json) {
    const std::string json = est::to_json(result);
    fmt::print("{}\n", options.sensitivity ? est::add_moves(json, moves) : json);
  } else {
    print_text(result, options.out);
    if (options.sensitivity) print_moves(moves);
  }
}

}  // namespace

void add_identify(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();
  CLI::App* verb =
      app.add_subcommand("identify", "Find the motor's parameters, with intervals, from measured data");
  verb->add_option("data", options->data, "data-set folders or event logs")->required();
  verb->add_option("--model", options->nominal, "model to start from, for starting values and bounds");
  verb->add_option("--out", options->out, "model file to write")->required();
  verb->add_option("--method", options->method, "auto, dc, transient, standstill, points, locked, losses, maps or global")
      ->capture_default_str();
  verb->add_option("--slip-rule", options->slip_rule,
                   "of method maps: R_r and L_l from slips above it, L_m from those below; 0: what each record's "
                   "own covariance says decides alone")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  verb->add_option("--keep", options->keep,
                   "which transient records speak for a parameter, beside their own sigma: slip (--slip-rule; the default of "
                   "method maps), sensitivity ((8)-(9) of the paper, computed), covariance (nothing else; the other methods' default)")
      ->check(CLI::IsMember({"slip", "sensitivity", "covariance"}));
  verb->add_option("--report", options->report,
                   "folder for report.html: the maps, the losses and the validation as figures");
  verb->add_flag("--sensitivity", options->sensitivity,
                 "also tell how far each base parameter moves with speed 0.1 % high, current or voltage 1 % high, voltage 10 us "
                 "late; takes five times as long");
  verb->add_flag("--json", options->json, "print JSON");
  verb->callback([options, &exit_code] {
    run(*options);
    exit_code = 0;
  });
}

}  // namespace imrig
