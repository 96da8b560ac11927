// imrig diagnose MODEL.toml DATA...: which physical effect does the model lack?

#include <fmt/format.h>

#include <memory>

#include "estimators/diagnose/diagnose_json.h"
#include "estimators/model/model_file.h"
#include "rig/cli/diagnose_text.h"
#include "rig/cli/load_data.h"
#include "rig/cli/verbs.h"

namespace imrig {

namespace {

struct Options {
  std::string model;
  std::vector<std::string> data;
  bool json = false;
};

int run(const Options& options) {
  const est::Model model = est::load_model(options.model);
  const DataSet data = load_data(options.data);
  est::DiagnoseOptions wanted;
  wanted.report = search_report();
  const est::Diagnosis diagnosis = est::diagnose(model, data, wanted);
  if (options.json) {
    fmt::print("{}\n", est::diagnose_json(diagnosis));
  } else {
    print_diagnosis(diagnosis);
  }
  return diagnosis.verdict == "cannot_tell" ? 1 : 0;
}

}  // namespace

void add_diagnose(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();
  CLI::App* verb =
      app.add_subcommand("diagnose", "Say which physical effect a model lacks, with evidence and doubt");
  verb->add_option("model", options->model, "model file")->required();
  verb->add_option("data", options->data, "data-set folders or event logs")->required();
  verb->add_flag("--json", options->json, "print JSON");
  verb->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace imrig
