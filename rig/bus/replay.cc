#include "rig/bus/replay.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <imrig_msg/heartbeat_t.hpp>
#include <memory>
#include <thread>

#include "rig/base/clock.h"
#include "rig/bus/channels.h"

namespace imrig {

namespace {

constexpr std::int64_t kLongestSleep_us = 100000;  // so that keep_going is asked often

// Wall times at which events may go out: log time over speed, and never faster than the rate.
class Pace {
 public:
  Pace(const ReplayOptions& options, std::int64_t start_us)
      : speed_(options.speed),
        gap_us_(1e6 / options.max_rate_per_s),
        start_us_(start_us),
        free_us_(static_cast<double>(start_us)) {}

  // When the next event, of this log time, may go out.
  double due_us(std::int64_t log_utime) {
    if (!begun_) first_utime_ = log_utime;
    begun_ = true;
    const double by_log =
        std::isinf(speed_)
            ? 0.0
            : static_cast<double>(start_us_) +
                  (static_cast<double>(log_utime) - static_cast<double>(first_utime_)) / speed_;
    const double due = std::max(by_log, free_us_);
    return due;
  }
  // Behind schedule, the rate still holds: one event after the other, not all at once.
  void sent(double now_us) { free_us_ = std::max(free_us_, now_us - kSlack_us) + gap_us_; }

 private:
  static constexpr double kSlack_us = 1000.0;  // sleeping is coarse: so much lateness is made up for
  double speed_;
  double gap_us_;
  std::int64_t start_us_;
  double free_us_;
  std::int64_t first_utime_ = 0;
  bool begun_ = false;
};

bool sleep_until(double due_us, const std::function<bool()>& keep_going) {
  for (;;) {
    if (keep_going && !keep_going()) return false;
    const double left_us = due_us - static_cast<double>(monotonic_us());
    if (left_us <= 0.0) return true;
    std::this_thread::sleep_for(std::chrono::microseconds(
        static_cast<std::int64_t>(std::clamp(left_us, 1.0, static_cast<double>(kLongestSleep_us)))));
  }
}

}  // namespace

std::string process_name(std::int32_t process) {
  switch (process) {
    case imrig_msg::heartbeat_t::BRIDGE:
      return "imrig-bridge";
    case imrig_msg::heartbeat_t::DYNO:
      return "imrig-dyno";
    case imrig_msg::heartbeat_t::RECORDER:
      return "imrig-recorder";
    case imrig_msg::heartbeat_t::ESTIMATOR:
      return "imrig-estimator";
    case imrig_msg::heartbeat_t::CAMPAIGN:
      return "imrig campaign";
    default:
      return "process " + std::to_string(process);
  }
}

std::vector<LiveProcess> live_heartbeats(Bus& bus, int listen_ms) {
  const auto heard = std::make_shared<std::vector<LiveProcess>>();
  bus.subscribe_raw("*", [heard](std::string_view channel, Bytes data) {
    if (!channel.ends_with(std::string("_") + channel::kHeartbeat)) return;
    const auto beat = guarded_decode<imrig_msg::heartbeat_t>(data);
    if (!beat) return;
    for (auto& known : *heard) {
      if (known.instance != beat->instance || known.channel != channel) continue;
      known.state = beat->state;
      return;
    }
    heard->push_back({beat->instance, beat->process, beat->pid, beat->state, std::string(channel)});
  });
  const std::int64_t end_us = monotonic_us() + std::int64_t{1000} * listen_ms;
  for (std::int64_t left_us = end_us - monotonic_us(); left_us > 0; left_us = end_us - monotonic_us()) {
    bus.wait(static_cast<int>(left_us / 1000) + 1);
  }
  return *heard;
}

bool is_command_channel(std::string_view channel) { return channel.ends_with("_CMD"); }

ReplayReport replay(EventLogReader& log, const Player& publish, const ReplayOptions& options) {
  ReplayReport report;
  Pace pace(options, monotonic_us());
  LogEvent event;
  while (log.next(event)) {
    if (is_command_channel(event.channel)) {
      ++report.commands_left_out;
      continue;
    }
    if (!sleep_until(pace.due_us(event.utime), options.keep_going)) {
      report.stopped = true;
      break;
    }
    publish(event.channel, event.data);
    pace.sent(static_cast<double>(monotonic_us()));
    ++report.played;
  }
  return report;
}

}  // namespace imrig
