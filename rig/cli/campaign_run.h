#pragma once
// Runs a plan into a folder: DIR/plan.toml and DIR/rig.toml (copies), DIR/journal.jsonl, DIR/log-NNN.lcm (one
// more at each resume), DIR/processes/*.log.

#include <optional>
#include <string>

namespace imrig {

struct CampaignRequest {
  std::string plan_path;
  std::string folder;
  std::string rig_path;    // empty: the default rig
  std::string plant_path;  // empty: hardware, or a rig that runs already
  std::string pace = "realtime";
  std::optional<long long> seed;
  bool resume = false;
};

struct CampaignResult {
  std::string end;  // "done", "stopped", "tripped", "failed"
  std::string reason;
  int points_done = 0;  // earlier runs included
  int points_total = 0;
  int points_failed = 0;   // of which ...
  int points_stalled = 0;  // ... the motor could not carry
  int points_tripped = 0;  // ... tripped the device
  int points_infeasible = 0;
  long long lost_blocks = 0;
  double wall_s = 0.0;
  std::string folder;
};

// Throws Error on bad input; a fresh folder is then left as it was.
CampaignResult run_campaign(const CampaignRequest& request);

}  // namespace imrig
