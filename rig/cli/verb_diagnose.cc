// imrig diagnose MODEL.toml DATA...: which physical effect does the model lack?

#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "estimators/diagnose/diagnose_json.h"
#include "estimators/model/model_file.h"
#include "rig/base/error.h"
#include "rig/base/file.h"
#include "rig/base/rig_config.h"
#include "rig/campaign/plan.h"
#include "rig/cli/diagnose_text.h"
#include "rig/cli/load_data.h"
#include "rig/cli/verbs.h"

namespace imrig {

namespace {

struct Options {
  std::string model;
  std::vector<std::string> data;
  bool json = false;
  std::vector<std::string> without;
  std::string plan, rig;
  bool force = false;
};

// Before the work, not after it.
void check_plan(const Options& options) {
  if (!options.plan.empty() && !options.force && std::filesystem::exists(options.plan))
    throw Error(options.plan, "is there already", "--force replaces it");
}

void write_plan(const Options& options, est::Diagnosis& diagnosis) {
  if (options.plan.empty() || !diagnosis.next_experiment || diagnosis.next_experiment->toml.empty()) return;
  parse_plan(diagnosis.next_experiment->toml, options.plan);
  write_text_atomically(options.plan, diagnosis.next_experiment->toml);
  diagnosis.next_experiment->plan = options.plan;
}

int run(const Options& options) {
  check_plan(options);
  const est::Model model = est::load_model(options.model);
  const DataSet data = load_data(options.data);
  est::DiagnoseOptions wanted;
  wanted.report = search_report();
  wanted.without = options.without;
  if (!options.rig.empty()) wanted.range = est::range_of(load_rig_config(options.rig));
  est::Diagnosis diagnosis = est::diagnose(model, data, wanted);
  write_plan(options, diagnosis);
  if (options.json) {
    fmt::print("{}\n", est::diagnose_json(diagnosis));
  } else {
    print_diagnosis(diagnosis);
    if (!options.plan.empty() && (!diagnosis.next_experiment || diagnosis.next_experiment->plan.empty()))
      fmt::print("\nNo plan is written: no experiment of the menu is needed, or none would help.\n");
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
  verb->add_option("--without", options->without, "effects that are ruled out for this motor")->delimiter(',');
  verb->add_option("--plan", options->plan, "where to write the campaign plan of the next experiment");
  verb->add_option("--rig", options->rig,
                   "rig.toml, for its limits; else the experiment stays within the data's");
  verb->add_flag("--force", options->force, "replace the plan that is there");
  verb->add_flag("--json", options->json, "print JSON");
  verb->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace imrig
