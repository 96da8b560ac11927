#pragma once
// The processes of one rig, started in order of health and stopped in reverse: emulator (optional), recorder,
// estimator, bridge, dyno. Who reads the samples is there before who publishes them, so that neither misses the
// first block. Each one must say ready before the next is started.

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rig/base/rig_config.h"
#include "rig/cli/supervisor/child_process.h"
#include "rig/cli/supervisor/keeper.h"

namespace imrig {

struct RigRequest {
  std::string folder;  // exists: the processes' own logs go here
  RigConfig rig;
  std::string rig_path;  // its file; empty: it is written to rig_copy
  std::string rig_copy;
  std::string plant_path;  // emulate this plant; empty: hardware
  std::string pace = "realtime";
  std::optional<long long> seed;
  bool private_ports = false;  // own free ports for link, Modbus and LCM; needs plant_path and no rig_path
  bool rig_runs = false;       // bridge, dyno and estimator run already: start the recorder alone
  std::string recorder_out;    // event log
};

class RigProcesses {
 public:
  // Starts everything. Throws Error with the last words of the process that failed, after stopping the
  // others.
  explicit RigProcesses(RigRequest request, const std::function<bool()>& give_up = {});
  ~RigProcesses();  // stops what still runs

  const std::string& rig_path() const { return request_.rig_path; }
  const RigConfig& rig() const { return request_.rig; }
  const std::vector<std::unique_ptr<ChildProcess>>& children() const { return children_; }

  pid_t pid_of(const std::string& program) const;  // 0: not among them

  // One sentence about a process that has ended by itself, empty while all run.
  std::string fallen();
  // In reverse order. Names of those that had to be killed.
  std::vector<std::string> stop(int grace_ms = 6000);

 private:
  void start_all(const std::function<bool()>& give_up);
  void start_emulator(const std::function<bool()>& give_up);
  std::string start(const std::string& program, std::vector<std::string> options,
                    const std::function<bool()>& give_up);

  RigRequest request_;
  Keeper keeper_;
  std::vector<std::unique_ptr<ChildProcess>> children_;
};

// A UDP port that nothing on this machine is bound to at the moment.
int free_udp_port();

}  // namespace imrig
