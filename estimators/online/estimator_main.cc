// imrig-estimator: follows the samples on the bus and publishes the operating point. What it publishes as
// estimates depends on the samples alone.

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <imrig_msg/ack_t.hpp>
#include <imrig_msg/heartbeat_t.hpp>

#include "estimators/online/estimate_message.h"
#include "estimators/online/operating_point.h"
#include "rig/base/clock.h"
#include "rig/base/error.h"
#include "rig/base/rig_config.h"
#include "rig/bus/bus.h"
#include "rig/bus/channels.h"

namespace imrig::est {
namespace {

using imrig_msg::heartbeat_t;

constexpr int kWait_ms = 20;
constexpr std::int64_t kHeartbeat_us = 200'000;
constexpr std::int64_t kMostIndex = std::int64_t{1} << 62;

std::atomic<bool> g_stop = false;
static_assert(std::atomic<bool>::is_always_lock_free);

void stop_on_signals() {
  struct sigaction action = {};
  action.sa_handler = [](int) { g_stop = true; };
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

class EstimatorProcess {
 public:
  EstimatorProcess(const OperatingPointConfig& config, Bus& bus)
      : bus_(bus), instance_(random_id()), estimator_(config, [this](const OperatingPoint& point) {
          publish(bus_, channel::kEstimate, message_of(point, ++estimate_seq_));
        }) {
    subscribe<imrig_msg::samples_t>(bus, channel::kSamples, [this](const auto& m) { on_samples(m); });
  }

  void turn() {
    bus_.wait(kWait_ms);
    const std::int64_t now_us = monotonic_us();
    if (following_ && (read_index_ != told_index_ || now_us >= ack_due_us_)) publish_ack(now_us);
    if (now_us >= heartbeat_due_us_) publish_heartbeat(now_us, state());
  }

  void stop() { publish_heartbeat(monotonic_us(), heartbeat_t::STOPPING); }

 private:
  std::int32_t state() const {
    if (following_) return heartbeat_t::OK;
    return heartbeat_t::STARTING;
  }

  void on_samples(const imrig_msg::samples_t& m) {
    if (m.n < 1 || m.first_index < 0 || m.first_index > kMostIndex || m.seq < 0 || m.seq > kMostIndex) return;
    if (!following_ || m.boot_id != boot_id_) {
      following_ = true;
      boot_id_ = m.boot_id;
      read_index_ = 0;
    } else if (m.seq > next_block_) {
      lost_blocks_ += m.seq - next_block_;
    }
    next_block_ = m.seq + 1;
    estimator_.feed(block_of(m));
    read_index_ = std::max(read_index_, m.first_index + m.n);
    utime_ = m.utime;
  }

  void publish_ack(std::int64_t now_us) {
    ack_due_us_ = now_us + kHeartbeat_us;
    told_index_ = read_index_;
    imrig_msg::ack_t ack = {};
    ack.utime = utime_;
    ack.seq = ++ack_seq_;
    ack.ack_v1 = 1;
    ack.boot_id = boot_id_;
    ack.read_index = read_index_;
    ack.lost_blocks = lost_blocks_;
    ack.process = heartbeat_t::ESTIMATOR;
    ack.pid = static_cast<std::int32_t>(::getpid());
    publish(bus_, channel::kAck, ack);
  }

  void publish_heartbeat(std::int64_t now_us, std::int32_t state) {
    heartbeat_due_us_ = now_us + kHeartbeat_us;
    heartbeat_t beat = {};
    beat.utime = utime_;
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
  bool following_ = false;
  std::int64_t boot_id_ = 0, next_block_ = 0, read_index_ = 0, told_index_ = 0, lost_blocks_ = 0, utime_ = 0;
  std::int64_t estimate_seq_ = 0, ack_seq_ = 0, heartbeat_seq_ = 0;
  std::int64_t ack_due_us_ = 0, heartbeat_due_us_ = 0;
  OperatingPointEstimator estimator_;
};

int body(int argc, char** argv) {
  CLI::App app{"imrig-estimator: the operating point of the motor, from the samples on the bus."};
  std::string path = "rig.toml";
  app.add_option("--config", path, "the rig's configuration")->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {
    return app.exit(asked);
  } catch (const CLI::ParseError& e) {
    throw Error("usage", e.what(), "see imrig-estimator --help");
  }
  const RigConfig config = load_rig_config(path);
  const auto bus = open_lcm_bus(config.bus);
  OperatingPointConfig point;
  point.pole_pairs = config.motor.pole_pairs;
  EstimatorProcess process(point, *bus);
  stop_on_signals();
  std::puts("ready");
  std::fflush(stdout);
  while (!g_stop) process.turn();
  process.stop();
  return 0;
}

}  // namespace
}  // namespace imrig::est

int main(int argc, char** argv) { return imrig::run_main("imrig-estimator", imrig::est::body, argc, argv); }
