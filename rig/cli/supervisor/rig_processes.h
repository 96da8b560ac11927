#pragma once
// The processes of one rig, started in order of health and stopped in reverse: emulator (optional), bridge, dyno, recorder, estimator.

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rig/base/rig_config.h"
#include "rig/cli/supervisor/child_process.h"

namespace imrig {

struct RigRequest {
  std::string folder;                // run folder: logs of the processes, generated rig.toml
  RigConfig rig;                     // as configured; links and port are replaced when private_rig
  std::optional<std::string> rig_path;  // its file, if it came from one
  std::string plant_path;            // emulate this plant; empty: hardware
  std::string pace = "realtime";
  long long seed = 1;
  bool private_rig = false;          // own free ports and LCM port, written to folder/rig.toml
  std::string recorder_out;          // event log; empty: no recorder
};

class RigProcesses {
 public:
  // Starts everything; throws Error naming the process that failed and its last words, after stopping the others.
  explicit RigProcesses(RigRequest request, const std::function<bool()>& give_up = {});
  ~RigProcesses();  // stops what still runs

  const std::string& rig_path() const { return rig_path_; }
  const RigConfig& rig() const { return rig_; }
  const std::vector<std::unique_ptr<ChildProcess>>& children() const { return children_; }
  std::string link_url() const { return rig_.bridge.link; }

  // Name and last words of a process that has ended by itself, if any.
  std::optional<std::string> fallen();
  // In reverse order. Names of those that had to be killed.
  std::vector<std::string> stop(int grace_ms = 5000);

 private:
  void start(ChildSpec spec, int ready_ms, const std::function<bool()>& give_up, std::string* ready_line = nullptr);
  RigRequest request_;
  RigConfig rig_;
  std::string rig_path_;
  std::vector<std::unique_ptr<ChildProcess>> children_;
};

// A UDP port that nothing on this machine is bound to now.
int free_udp_port();

}  // namespace imrig
