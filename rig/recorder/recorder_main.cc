// imrig-recorder: every message of the rig's prefix to an event log, in order of arrival.

#include <signal.h>
#include <unistd.h>

#include <cstdio>
#include <imrig_msg/heartbeat_t.hpp>

#include "rig/base/clock.h"
#include "rig/base/command_line.h"
#include "rig/base/error.h"
#include "rig/base/file.h"
#include "rig/base/rig_config.h"
#include "rig/base/stop_signal.h"
#include "rig/bus/bus.h"
#include "rig/bus/channels.h"
#include "rig/recorder/ack_keeper.h"
#include "rig/recorder/disk_writer.h"
#include "rig/recorder/kernel_drops.h"

namespace imrig {
namespace {

constexpr int kRound_ms = 5;
constexpr std::int64_t kHeartbeat_us = 200000;
constexpr std::int64_t kDrain_us = 1000000;  // at most, when asked to stop
constexpr std::size_t kHoldBytes = std::size_t{64}
                                   << 20;  // more waits for the disk: no further credit for the device

struct Options {
  std::string config = "rig.toml";
  std::string out;
  bool append = false;
  int memory_MB = 1024;
};

Options parse(int argc, char** argv, int& exit_code) {
  Options options;
  CLI::App app{"imrig-recorder: writes every message of the rig to an LCM event log, without loss."};
  app.add_option("--config", options.config, "the rig's configuration")->capture_default_str();
  app.add_option("--out", options.out, "event log to write; must not exist")->required();
  app.add_flag("--append", options.append, "continue an existing log");
  app.add_option("--memory-mb", options.memory_MB, "messages may wait for the disk in so much memory")
      ->check(CLI::Range(1, 1 << 20))
      ->capture_default_str();
  exit_code = parse_command_line(app, "imrig-recorder", argc, argv).value_or(exit_code);
  return options;
}

// Signals go to the main thread alone, so that they end its wait for the bus.
class Signals {
 public:
  Signals() {
    catch_stop_signals();
    ::signal(SIGXFSZ, SIG_IGN);  // a file size limit is a failed write like any other
    sigemptyset(&set_);
    sigaddset(&set_, SIGINT);
    sigaddset(&set_, SIGTERM);
    sigaddset(&set_, SIGHUP);
    ::pthread_sigmask(SIG_BLOCK, &set_, nullptr);
  }
  void let_through() { ::pthread_sigmask(SIG_UNBLOCK, &set_, nullptr); }

 private:
  sigset_t set_;
};

class Recorder {
 public:
  Recorder(const RigConfig& config, const Options& options)
      : bus_(open_lcm_bus(config.bus)),
        writer_(options.out, config.bus.prefix, options.append,
                static_cast<std::size_t>(options.memory_MB) << 20),
        prefix_(config.bus.prefix + "_"),
        samples_channel_(prefix_ + channel::kSamples) {
    bus_->subscribe_raw("*", [this](std::string_view name, Bytes data) { on_message(name, data); });
    if (writer_.cut_bytes() > 0) {
      std::fprintf(stderr, "imrig-recorder: %s: its torn tail of %lld bytes was cut off\n",
                   options.out.c_str(), static_cast<long long>(writer_.cut_bytes()));
    }
  }

  void run() {
    while (!stop_asked()) {
      bus_->wait(kRound_ms);
      acknowledge();
      beat();
    }
    stopping_ = true;
    beat_now();
    // What was sent before the stop is still on its way through the sockets.
    const std::int64_t end_us = monotonic_us() + kDrain_us;
    while (bus_->wait(4 * kRound_ms) > 0 && monotonic_us() < end_us) {
    }
  }

  int finish(const std::string& log) {
    const bool well = writer_.finish();
    say_losses();
    if (!well) {
      std::fprintf(stderr, "imrig-recorder: the end of the log is missing: %s\n", writer_.failure().c_str());
      return 1;
    }
    write_text_atomically(
        log + ".index.json",
        writer_.index().to_json(log, writer_.bytes(), {kernel_drops(), writer_.dropped(), foreign_}));
    return 0;
  }

 private:
  void on_message(std::string_view name, Bytes data) {
    if (!name.starts_with(prefix_)) {
      ++foreign_;
      return;
    }
    writer_.push(wall_us(), name, data);
    if (name != samples_channel_) return;
    const auto block = guarded_decode<imrig_msg::samples_t>(data);
    if (!block) return;
    lost_ += samples_.see({std::to_string(block->boot_id), block->seq});
    acks_.on_samples(*block);
    acknowledge();
  }

  void acknowledge() {
    const bool hold = writer_.waiting_bytes() > kHoldBytes;
    auto ack = acks_.due(monotonic_us(), hold, lost_, writer_.flushed_record());
    if (!ack) return;
    ack->pid = static_cast<std::int32_t>(::getpid());
    publish(*bus_, channel::kAck, *ack);
  }

  void beat() {
    if (monotonic_us() - beaten_us_ >= kHeartbeat_us) beat_now();
  }

  void beat_now() {
    beaten_us_ = monotonic_us();
    say_losses();
    imrig_msg::heartbeat_t m = {};
    m.utime = acks_.utime();
    m.seq = ++heartbeat_seq_;
    m.heartbeat_v1 = 1;
    m.host_utime = wall_us();
    m.instance = instance_;
    m.process = imrig_msg::heartbeat_t::RECORDER;
    m.pid = ::getpid();
    m.state = imrig_msg::heartbeat_t::OK;
    if (degraded_) m.state = imrig_msg::heartbeat_t::DEGRADED;
    if (stopping_) m.state = imrig_msg::heartbeat_t::STOPPING;
    publish(*bus_, channel::kHeartbeat, m);
  }

  // Each kind of loss is said once on stderr when it begins; the index has the figures.
  void say_losses() {
    const std::string failure = writer_.failure();
    say(said_failure_, !failure.empty(), "cannot write at present, messages wait in memory: " + failure);
    say(said_memory_, writer_.dropped() > 0, "the memory limit is reached, messages are dropped");
    say(said_kernel_, kernel_drops() > 0,
        "the kernel dropped datagrams: raise net.core.rmem_max and recv_buf_size");
    degraded_ = !failure.empty() || said_memory_ || said_kernel_;
  }
  static void say(bool& said, bool happens, const std::string& what) {
    if (happens && !said) std::fprintf(stderr, "imrig-recorder: %s\n", what.c_str());
    said = said || happens;
  }

  std::unique_ptr<Bus> bus_;
  DiskWriter writer_;
  std::string prefix_;
  std::string samples_channel_;
  AckKeeper acks_;
  StreamWatch samples_;
  std::int64_t lost_ = 0;
  std::int64_t foreign_ = 0;
  std::int64_t instance_ = random_id();
  std::int64_t heartbeat_seq_ = 0;
  std::int64_t beaten_us_ = 0;
  bool stopping_ = false;
  bool degraded_ = false;
  bool said_failure_ = false;
  bool said_memory_ = false;
  bool said_kernel_ = false;
};

int body(int argc, char** argv) {
  int exit_code = -1;
  const Options options = parse(argc, argv, exit_code);
  if (exit_code >= 0) return exit_code;
  const RigConfig config = load_rig_config(options.config);
  Signals signals;  // before any thread
  Recorder recorder(config, options);
  signals.let_through();
  std::puts("ready");
  std::fflush(stdout);
  recorder.run();
  return recorder.finish(options.out);
}

}  // namespace
}  // namespace imrig

int main(int argc, char** argv) { return imrig::run_main("imrig-recorder", imrig::body, argc, argv); }
