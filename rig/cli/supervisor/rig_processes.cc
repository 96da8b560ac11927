#include "rig/cli/supervisor/rig_processes.h"

#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>

#include "rig/base/error.h"
#include "rig/base/file.h"

namespace imrig {

namespace {

constexpr int kReady_ms = 20'000;

// A rig of its own beyond real time: nothing turns that a watchdog could save, and a host under full load may leave
// one of its processes waiting for longer than hardware should.
void wait_longer(LimitsConfig& limits) {
  limits.device_watchdog_ms = std::max(limits.device_watchdog_ms, 2000);
  limits.link_silence_ms = std::max(limits.link_silence_ms, 5000);
  limits.lease_ms = std::max(limits.lease_ms, 5000);
  limits.peer_silence_ms = std::max(limits.peer_silence_ms, 5000);
}

// Value of "key=value" in a ready line.
std::string word_after(const std::string& line, const std::string& key) {
  const std::size_t at = line.find(" " + key + "=");
  if (at == std::string::npos)
    throw Error("imrig-emulator", fmt::format("said \"{}\"", line),
                fmt::format("{}=... in its ready line", key));
  const std::size_t begin = at + key.size() + 2;
  return line.substr(begin, line.find(' ', begin) - begin);
}

}  // namespace

int free_udp_port() {
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  socklen_t size = sizeof address;
  const bool bound = fd >= 0 && ::bind(fd, reinterpret_cast<sockaddr*>(&address), size) == 0 &&
                     ::getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size) == 0;
  if (fd >= 0) ::close(fd);
  if (!bound) throw Error("network", "no free UDP port was found");
  return ntohs(address.sin_port);
}

RigProcesses::RigProcesses(RigRequest request, const std::function<bool()>& give_up)
    : request_(std::move(request)) {
  try {
    start_all(give_up);
  } catch (...) {
    stop();
    throw;
  }
}

RigProcesses::~RigProcesses() { stop(); }

void RigProcesses::start_all(const std::function<bool()>& give_up) {
  if (request_.private_ports) {
    request_.rig.bus.url =
        fmt::format("udpm://239.255.76.77:{}?ttl=0&recv_buf_size=4194304", free_udp_port());
    if (request_.pace != "realtime") wait_longer(request_.rig.limits);
  }
  if (!request_.plant_path.empty()) start_emulator(give_up);
  if (request_.rig_path.empty()) {
    request_.rig_path = request_.rig_copy;
    write_text_atomically(request_.rig_path, to_toml(request_.rig));
  }
  const std::vector<std::string> config = {"--config", request_.rig_path};
  if (!request_.recorder_out.empty()) {
    auto options = config;
    options.insert(options.end(), {"--out", request_.recorder_out});
    start("imrig-recorder", options, give_up);
  }
  if (request_.rig_runs) return;
  start("imrig-estimator", config, give_up);
  start("imrig-bridge", config, give_up);
  start("imrig-dyno", config, give_up);
}

void RigProcesses::start_emulator(const std::function<bool()>& give_up) {
  const bool own = request_.private_ports;
  std::vector<std::string> options = {"--config", request_.plant_path, "--pace", request_.pace};
  options.insert(options.end(), {"--link", own ? "udp://127.0.0.1:0" : request_.rig.bridge.link});
  options.insert(options.end(), {"--modbus", own ? "tcp://127.0.0.1:0" : request_.rig.dyno.link});
  // Beyond real time the fixed step, which tests/plant/pace_test.cc holds against the error-controlled
  // integrator.
  if (request_.pace != "realtime") options.insert(options.end(), {"--integrator", "rk4"});
  if (request_.seed) options.insert(options.end(), {"--seed", std::to_string(*request_.seed)});
  const std::string ready = start("imrig-emulator", options, give_up);
  if (!own || ready.empty()) return;
  request_.rig.bridge.link = word_after(ready, "link");
  request_.rig.dyno.link = word_after(ready, "modbus");
}

std::string RigProcesses::start(const std::string& program, std::vector<std::string> options,
                                const std::function<bool()>& give_up) {
  if (give_up && give_up()) return "";
  ChildSpec spec;
  spec.name = program;
  spec.argv = std::move(options);
  spec.argv.insert(spec.argv.begin(), executable_folder() + "/" + program);
  spec.log_path = fmt::format("{}/{}.log", request_.folder, program);
  children_.push_back(std::make_unique<ChildProcess>(std::move(spec)));
  keeper_.adopt(children_.back()->pid());
  return children_.back()->wait_ready(kReady_ms, give_up);
}

pid_t RigProcesses::pid_of(const std::string& program) const {
  for (const auto& child : children_)
    if (child->name() == program) return child->pid();
  return 0;
}

std::string RigProcesses::fallen() {
  for (const auto& child : children_) {
    if (child->running()) continue;
    const std::string words = child->last_words();
    return fmt::format("{} ended with code {}{}{}", child->name(), child->exit_code().value_or(0),
                       words.empty() ? "" : ": ", words);
  }
  return "";
}

std::vector<std::string> RigProcesses::stop(int grace_ms) {
  std::vector<std::string> killed;
  for (auto child = children_.rbegin(); child != children_.rend(); ++child)
    if (!(*child)->stop(grace_ms)) killed.push_back((*child)->name());
  return killed;
}

}  // namespace imrig
