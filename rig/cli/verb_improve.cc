// imrig improve MODEL.toml DATA... --out M2.toml: diagnose, add, refit, until nothing more is proven.

#include <fmt/format.h>

#include <memory>

#include "estimators/diagnose/diagnose_json.h"
#include "estimators/model/model_file.h"
#include "rig/cli/diagnose_text.h"
#include "rig/cli/improve_text.h"
#include "rig/cli/load_data.h"
#include "rig/cli/report/improvement.h"
#include "rig/cli/text_table.h"
#include "rig/cli/verbs.h"

namespace imrig {

namespace {

struct Options {
  std::string model;
  std::vector<std::string> data;
  std::string out;
  std::string report;
  std::vector<std::string> without;
  bool json = false;
};

void run(const Options& options) {
  const est::Model model = est::load_model(options.model);
  const DataSet data = load_data(options.data);
  est::DiagnoseOptions wanted;
  wanted.report = search_report();
  wanted.without = options.without;
  const est::Improvement improvement = est::improve(model, data, wanted);
  est::save_model(improvement.model, options.out);
  std::string report;
  if (!options.report.empty()) report = write_improvement_report(model, improvement, options.report);
  if (options.json) {
    fmt::print("{}\n", est::improve_json(improvement, options.out));
    return;
  }
  print_improvement(model, improvement);
  fmt::print("model written to {}\n", printable(options.out));
  if (!report.empty()) fmt::print("report written to {}\n", report);
}

}  // namespace

void add_improve(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();
  CLI::App* verb = app.add_subcommand(
      "improve", "Add the effects that a model lacks, one by one, and watch the error fall");
  verb->add_option("model", options->model, "model file")->required();
  verb->add_option("data", options->data, "data-set folders or event logs")->required();
  verb->add_option("--out", options->out, "model file to write")->required();
  verb->add_option("--report", options->report, "folder for report.html, one file that needs nothing else");
  verb->add_option("--without", options->without, "effects that are ruled out for this motor")->delimiter(',');
  verb->add_flag("--json", options->json, "print JSON");
  verb->callback([options, &exit_code] {
    run(*options);
    exit_code = 0;
  });
}

}  // namespace imrig
