// imrig campaign check PLAN.toml | imrig campaign run PLAN.toml --out DIR

#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "rig/cli/campaign_check.h"
#include "rig/cli/campaign_run.h"
#include "rig/cli/verbs.h"

namespace imrig {

namespace {

struct Options {
  CampaignRequest request;
  bool json = false;
};

void add_check(CLI::App& parent, const std::shared_ptr<Options>& o, int& exit_code) {
  CLI::App* verb = parent.add_subcommand(
      "check", "every point with predicted current, slip, torque and time; infeasible ones and why");
  verb->add_option("plan", o->request.plan_path, "campaign plan (TOML)")->required();
  verb->add_option("--config", o->request.rig_path, "rig configuration (default: the built-in one)");
  verb->add_flag("--json", o->json, "print JSON");
  verb->callback([o, &exit_code] {
    const RigConfig rig = o->request.rig_path.empty() ? RigConfig{} : load_rig_config(o->request.rig_path);
    const CheckedPlan checked = check_plan(load_plan(o->request.plan_path), rig);
    fmt::print("{}\n", o->json ? check_json(checked) : check_table(checked));
    exit_code = checked.in_order.empty() ? 1 : 0;
  });
}

void print_result(const CampaignResult& r, bool json) {
  if (json) {
    fmt::print("{}\n",
               nlohmann::json{{"end", r.end},
                              {"reason", r.reason.empty() ? nlohmann::json() : nlohmann::json(r.reason)},
                              {"points_done", r.points_done},
                              {"points_total", r.points_total},
                              {"points_failed", r.points_failed},
                              {"points_stalled", r.points_stalled},
                              {"points_tripped", r.points_tripped},
                              {"points_infeasible", r.points_infeasible},
                              {"lost_blocks", r.lost_blocks},
                              {"wall_s", r.wall_s},
                              {"folder", r.folder}}
                   .dump(2));
    return;
  }
  fmt::print("{}: {} of {} points in {}, {} left out as infeasible, {} sample blocks lost, {:.1f} s{}\n",
             r.end, r.points_done, r.points_total, r.folder, r.points_infeasible, r.lost_blocks, r.wall_s,
             r.reason.empty() ? "" : "; " + r.reason);
}

void add_run(CLI::App& parent, const std::shared_ptr<Options>& o, int& exit_code) {
  CLI::App* verb = parent.add_subcommand("run", "run a plan on the rig, or on the emulator, into a folder");
  verb->add_option("plan", o->request.plan_path, "campaign plan (TOML)")->required();
  verb->add_option("--out", o->request.folder, "folder for log, journal and copies of plan and rig")
      ->required();
  verb->add_flag("--resume", o->request.resume,
                 "go on with the campaign in that folder; finished points are kept");
  verb->add_option("--config", o->request.rig_path, "rig configuration (default: the built-in one)");
  CLI::Option* emulate = verb->add_option("--emulate", o->request.plant_path,
                                          "start a rig of its own on this emulated plant (TOML)");
  verb->add_option("--pace", o->request.pace, "of the emulator: realtime, a factor, or max")
      ->capture_default_str()
      ->needs(emulate);
  verb->add_option("--seed", o->request.seed, "of the emulator's noise and tolerances")->needs(emulate);
  verb->add_flag("--json", o->json, "print JSON");
  verb->callback([o, &exit_code] {
    const CampaignResult result = run_campaign(o->request);
    print_result(result, o->json);
    exit_code = result.end == "done" ? 0 : 1;
  });
}

}  // namespace

void add_campaign(CLI::App& app, int& exit_code) {
  CLI::App* verb = app.add_subcommand("campaign", "check or run a measurement plan");
  verb->require_subcommand(1);
  const auto options = std::make_shared<Options>();
  add_check(*verb, options, exit_code);
  add_run(*verb, options, exit_code);
}

}  // namespace imrig
