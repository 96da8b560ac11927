#pragma once
// A child process with its own log file. It says `ready` on a line of its own once it works; it is asked to
// stop with SIGTERM, and made to with SIGKILL. It gets SIGTERM too when its parent dies, however the parent
// dies (keeper.h makes sure of the rest).

#include <sys/types.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace imrig {

struct ChildSpec {
  std::string name;               // "imrig-bridge": for sentences
  std::vector<std::string> argv;  // argv[0] is the path of the program
  std::string log_path;           // stdout and stderr go here
};

class ChildProcess {
 public:
  // Starts it. Throws Error when the program is not there or cannot be run.
  explicit ChildProcess(ChildSpec spec);
  // Stops it, with a second of grace.
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  // Waits for its ready line and returns it. Throws Error with its last words when it died, or when it said
  // nothing for so long; returns an empty string when give_up() became true.
  std::string wait_ready(int timeout_ms, const std::function<bool()>& give_up = {});

  bool running();                        // reaps it when it has ended
  std::optional<int> exit_code() const;  // once ended; 128 + signal when killed
  std::string last_words() const;        // last non-empty line of its log
  // SIGTERM, up to grace_ms, then SIGKILL. True when it went by itself.
  bool stop(int grace_ms);

  pid_t pid() const { return pid_; }
  const std::string& name() const { return spec_.name; }
  const std::string& log_path() const { return spec_.log_path; }

 private:
  ChildSpec spec_;
  pid_t pid_ = -1;
  std::optional<int> exit_code_;
};

}  // namespace imrig
