#include "rig/cli/model_circuits.h"

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <optional>

#include "estimators/model/convert_model.h"
#include "estimators/model/export.h"
#include "estimators/model/model_file.h"
#include "rig/base/error.h"
#include "rig/base/file.h"
#include "rig/cli/json_number.h"
#include "rig/cli/text_table.h"

namespace imrig {

namespace {

struct ConvertOptions {
  std::string model;
  std::string to;
  std::optional<double> ratio;
  bool json = false;
};

void print_json(const est::Model& model, const ConvertOptions& options, double ratio,
                const std::vector<est::CircuitParameter>& all) {
  Json out{{"version", 1},
           {"name", model.name},
           {"pole_pairs", model.pole_pairs},
           {"connection", model.delta ? "delta" : "star"},
           {"circuit", options.to}};
  if (options.to == "t") out["L_s_over_L_r"] = ratio;
  out["parameters"] = Json::object();
  for (const auto& one : all) {
    const est::Parameter& p = one.parameter;
    out["parameters"][one.name] = {{"value", json_number(p.value)},
                                   {"ci95", {json_number(p.ci95_low), json_number(p.ci95_high)}},
                                   {"unit", p.unit},
                                   {"meaning", one.meaning}};
  }
  fmt::print("{}\n", json_text(out));
}

void print_text(const est::Model& model, const ConvertOptions& options, double ratio,
                const std::vector<est::CircuitParameter>& all) {
  fmt::print("{}: {} circuit{} per phase of the {}star\n\n", printable(model.name), options.to,
             options.to == "t" ? fmt::format(", L_s/L_r = {:.4g},", ratio) : "",
             model.delta ? "equivalent " : "");
  TextTable table({"<parameter", "value", "<95 % interval", "<unit", "<meaning"});
  for (const auto& one : all) {
    const est::Parameter& p = one.parameter;
    const std::string interval =
        std::isnan(p.ci95_low) ? "-" : "[" + shown(p.ci95_low, 5) + ", " + shown(p.ci95_high, 5) + "]";
    table.row({one.name, shown(p.value, 5), interval, p.unit, one.meaning});
  }
  fmt::print("{}", table.text());
  if (options.to == "t" && !options.ratio && est::seen_ratio(model))
    fmt::print("note: L_s/L_r is that of the leakage that saturates on both sides; intervals leave it out\n");
  if (!model.effects.empty()) fmt::print("note: these are the parameters at neutral effects\n");
}

void convert(const ConvertOptions& options) {
  const auto circuit = est::circuit_from(options.to);
  if (!circuit) throw Error("--to " + options.to, "is no circuit", "t, gamma or inverse-gamma");
  if (options.ratio && (!(*options.ratio > 0.0) || !std::isfinite(*options.ratio)))
    throw Error("--ratio", "must be above 0", "L_s/L_r of the T circuit, usually 1");
  const est::Model model = est::load_model(options.model);
  const double ratio = options.ratio ? *options.ratio : est::seen_ratio(model).value_or(1.0);
  const auto all = est::parameters_in(model, *circuit, ratio);
  options.json ? print_json(model, options, ratio, all) : print_text(model, options, ratio, all);
}

struct ExportOptions {
  std::string model;
  std::string format;
  std::string out;
};

void export_model(const ExportOptions& options) {
  const bool csv = options.format == "csv", json = options.format == "json", c = options.format == "c";
  if (!csv && !json && !c) throw Error("--format " + options.format, "is not known", "csv, json or c");
  const est::ExportedModel model = est::exported(est::load_model(options.model));
  const std::string text = csv    ? est::exported_csv(model)
                           : json ? est::exported_json(model)
                                  : est::exported_c(model);
  if (options.out.empty()) {
    fmt::print("{}", text);
  } else {
    write_text_atomically(options.out, text);
  }
}

}  // namespace

void add_model_convert(CLI::App& model, int& exit_code) {
  const auto options = std::make_shared<ConvertOptions>();
  CLI::App* verb = model.add_subcommand("convert", "The parameters in another equivalent circuit");
  verb->add_option("model", options->model, "model file")->required();
  verb->add_option("--to", options->to, "t, gamma or inverse-gamma")->required();
  verb->add_option("--ratio", options->ratio,
                   "L_s/L_r of the T circuit (default: as saturating leakage shows it, else 1; the "
                   "terminals of a linear motor do not)");
  verb->add_flag("--json", options->json, "print JSON");
  verb->callback([options, &exit_code] {
    convert(*options);
    exit_code = 0;
  });
}

void add_model_export(CLI::App& model, int& exit_code) {
  const auto options = std::make_shared<ExportOptions>();
  CLI::App* verb =
      model.add_subcommand("export", "The model for drives and other programs: CSV, JSON, a C header");
  verb->add_option("model", options->model, "model file")->required();
  verb->add_option("--format", options->format, "csv, json or c")->required();
  verb->add_option("--out", options->out, "file to write (default: print)");
  verb->callback([options, &exit_code] {
    export_model(*options);
    exit_code = 0;
  });
}

}  // namespace imrig
