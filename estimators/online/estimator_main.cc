// imrig-estimator: follows the samples on the bus, or in a log, and publishes what they say about the motor. What it
// publishes as estimates depends on the samples alone.

#include <sched.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <imrig_msg/ack_t.hpp>
#include <imrig_msg/heartbeat_t.hpp>
#include <limits>
#include <memory>
#include <string_view>

#include "estimators/online/estimator_node.h"
#include "estimators/online/estimator_options.h"
#include "rig/base/clock.h"
#include "rig/base/command_line.h"
#include "rig/base/error.h"
#include "rig/base/rig_config.h"
#include "rig/base/stop_signal.h"
#include "rig/base/url.h"
#include "rig/bus/bus.h"
#include "rig/bus/channels.h"
#include "rig/bus/event_log.h"
#include "rig/bus/guarded_decode.h"
#include "rig/bus/replay.h"

namespace imrig::est {
namespace {

using imrig_msg::heartbeat_t;

constexpr int kWait_ms = 20;
constexpr std::int64_t kHeartbeat_us = 200'000;
constexpr std::string_view kFile = "file://";

// Both are refused to ordinary users on most systems: said once, and the estimator runs all the same.
void take_privileges(const EstimatorOptions& options) {
  const auto tell = [](const char* what) {
    std::fprintf(stderr, "imrig-estimator: no %s: %s\n", what, std::strerror(errno));
  };
  if (options.lock_memory && ::mlockall(MCL_CURRENT | MCL_FUTURE) != 0) tell("locked memory");
  if (!options.realtime) return;
  sched_param priority = {};
  priority.sched_priority = *options.realtime;
  if (::sched_setscheduler(0, SCHED_FIFO, &priority) != 0) tell("real-time priority");
}

const std::string& channel_of(EstimatorNode::Kind kind) {
  static const std::string point = channel::kEstimate, motor = channel::kMotorEstimate;
  return kind == EstimatorNode::Kind::kPoint ? point : motor;
}

// What is published, kept in an event log at the rig's time.
class EstimateLog {
 public:
  EstimateLog(const std::string& path, const std::string& prefix) : prefix_(prefix + "_") {
    if (!path.empty()) log_ = std::make_unique<EventLogWriter>(path);
  }
  void keep(const std::string& name, Bytes data, std::int64_t utime) {
    if (log_) log_->write(utime, prefix_ + name, data);
  }

 private:
  std::string prefix_;
  std::unique_ptr<EventLogWriter> log_;
};

class EstimatorProcess {
 public:
  EstimatorProcess(const EstimatorConfig& config, Bus& bus, EstimateLog& log)
      : bus_(bus), instance_(random_id()), node_(config, [this, &log](EstimatorNode::Kind kind, Bytes data) {
          bus_.publish_raw(channel_of(kind), data);
          log.keep(channel_of(kind), data, node_.utime());
        }) {
    bus.subscribe_raw(channel::kSamples, [this](std::string_view, Bytes data) {
      if (guarded_decode_into(data, samples_)) node_.take(samples_);
    });
  }

  void turn() {
    bus_.wait(kWait_ms);
    const std::int64_t now_us = monotonic_us();
    if (node_.following() && (node_.read_index() != told_index_ || now_us >= ack_due_us_)) publish_ack(now_us);
    if (now_us < heartbeat_due_us_) return;
    const std::int32_t state = node_.following() ? std::int32_t{heartbeat_t::OK} : std::int32_t{heartbeat_t::STARTING};
    publish_heartbeat(now_us, state);
  }

  void stop() { publish_heartbeat(monotonic_us(), heartbeat_t::STOPPING); }

 private:
  void publish_ack(std::int64_t now_us) {
    ack_due_us_ = now_us + kHeartbeat_us;
    told_index_ = node_.read_index();
    imrig_msg::ack_t ack = {};
    ack.utime = node_.utime();
    ack.seq = ++ack_seq_;
    ack.ack_v1 = 1;
    ack.boot_id = node_.boot_id();
    ack.read_index = told_index_;
    ack.lost_blocks = node_.lost_blocks();
    ack.process = heartbeat_t::ESTIMATOR;
    ack.pid = static_cast<std::int32_t>(::getpid());
    publish(bus_, channel::kAck, ack);
  }

  void publish_heartbeat(std::int64_t now_us, std::int32_t state) {
    heartbeat_due_us_ = now_us + kHeartbeat_us;
    heartbeat_t beat = {};
    beat.utime = node_.utime();
    beat.seq = ++heartbeat_seq_;
    beat.heartbeat_v1 = 1;
    beat.host_utime = wall_us();
    beat.instance = instance_;
    beat.process = heartbeat_t::ESTIMATOR;
    beat.pid = ::getpid();
    beat.state = state;
    publish(bus_, channel::kHeartbeat, beat);
  }

  Bus& bus_;
  std::int64_t instance_;
  imrig_msg::samples_t samples_ = {};  // kept for its arrays' memory
  std::int64_t told_index_ = 0, ack_seq_ = 0, heartbeat_seq_ = 0;
  std::int64_t ack_due_us_ = 0, heartbeat_due_us_ = 0;
  EstimatorNode node_;
};

// file://LOG?speed=N, LOG absolute or not.
Url file_url(const std::string& text) {
  const std::string rest = text.substr(kFile.size());
  const std::size_t path_end = std::min(rest.find('?'), rest.size());
  return parse_url(std::string(kFile) + std::filesystem::absolute(rest.substr(0, path_end)).string() + rest.substr(path_end));
}

// The samples of a log; speed 0: as fast as they can be worked off.
int read_log(const Url& url, const EstimatorConfig& config, const std::string& prefix, EstimateLog& log) {
  EventLogReader reader(url.path);
  const std::string samples = prefix + "_" + channel::kSamples;
  EstimatorNode node(config, [&](EstimatorNode::Kind kind, Bytes data) { log.keep(channel_of(kind), data, node.utime()); });
  imrig_msg::samples_t block = {};
  ReplayOptions pace;
  const long speed = url.option_or("speed", 1, 0, 1'000'000);
  pace.speed = speed == 0 ? std::numeric_limits<double>::infinity() : static_cast<double>(speed);
  pace.max_rate_per_s = 1e12;
  pace.keep_going = [] { return !stop_asked(); };
  replay(reader, [&](const std::string& channel, Bytes data) { if (channel == samples && guarded_decode_into(data, block)) node.take(block); }, pace);
  std::printf("%lld estimates, %lld lost blocks\n", static_cast<long long>(node.estimates()),
              static_cast<long long>(node.lost_blocks()));
  return 0;
}

int follow_bus(const BusConfig& config, const EstimatorConfig& estimator, EstimateLog& log) {
  const auto bus = open_lcm_bus(config);
  EstimatorProcess process(estimator, *bus, log);
  std::puts("ready");
  std::fflush(stdout);
  while (!stop_asked()) process.turn();
  process.stop();
  return 0;
}

int body(int argc, char** argv) {
  CLI::App app{"imrig-estimator: what the samples on the bus say about the motor, while it runs."};
  EstimatorOptions options;
  add_options(app, options);
  if (const auto done = parse_command_line(app, "imrig-estimator", argc, argv)) return *done;
  const RigConfig rig = load_rig_config(options.config);
  const EstimatorConfig estimator = estimator_config(options, rig);
  BusConfig bus = rig.bus;
  if (!options.url.empty()) bus.url = options.url;
  EstimateLog log(options.out, bus.prefix);
  take_privileges(options);
  catch_stop_signals();
  if (bus.url.starts_with(kFile)) return read_log(file_url(bus.url), estimator, bus.prefix, log);
  return follow_bus(bus, estimator, log);
}

}  // namespace
}  // namespace imrig::est

int main(int argc, char** argv) { return imrig::run_main("imrig-estimator", imrig::est::body, argc, argv); }
