// From publishing a block of samples to the arrival of the estimate that it completes, beside the way of a block of
// the same size to a process that answers at once with as many bytes as an estimate has: both in turn, same run,
// same bus. Which blocks complete an estimate is known beforehand, since the core says so without any bus.

#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <imrig_msg/heartbeat_t.hpp>
#include <imrig_msg/motor_estimate_t.hpp>

#include "bench/command.h"
#include "bench/online/estimator_bench.h"
#include "estimators/online/estimator_node.h"
#include "rig/base/clock.h"
#include "rig/base/error.h"
#include "rig/base/file.h"
#include "rig/bus/bus.h"
#include "rig/bus/channels.h"

extern char** environ;

namespace imrig::bench {

namespace {

constexpr char kEcho[] = "BENCH_ECHO", kEchoed[] = "BENCH_ECHOED";
constexpr int kPace_us = 3000;      // between blocks
constexpr int kGiven_up_us = 200000;  // for one answer

class Child {
 public:
  explicit Child(std::vector<std::string> argv) {
    std::vector<char*> words;
    for (std::string& word : argv) words.push_back(word.data());
    words.push_back(nullptr);
    posix_spawn_file_actions_t quiet;
    posix_spawn_file_actions_init(&quiet);
    posix_spawn_file_actions_addopen(&quiet, STDOUT_FILENO, "/dev/null", 1, 0);
    const int failed = ::posix_spawn(&pid_, words[0], &quiet, nullptr, words.data(), environ);
    posix_spawn_file_actions_destroy(&quiet);
    if (failed != 0) throw Error(argv[0], "cannot be run");
  }
  ~Child() {
    ::kill(pid_, SIGTERM);
    ::waitpid(pid_, nullptr, 0);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

 private:
  pid_t pid_ = -1;
};

double now_us() {
  timespec t = {};
  ::clock_gettime(CLOCK_MONOTONIC, &t);
  return 1e6 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_nsec);
}

double quantile(std::vector<double>& values, double q) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

class Course {
 public:
  Course(const std::string& root, int seconds)
      : messages_(motor_messages(root, 1e6 * seconds / kPace_us * 256 * 60e-6 / 2.0)), url_(fmt::format("udpm://239.255.76.77:{}?ttl=0&recv_buf_size=4194304", 20000 + ::getpid() % 20000)) {
    bool emitted = false;
    est::EstimatorNode node(estimator_config(root), [&](est::EstimatorNode::Kind kind, Bytes) { emitted = emitted || kind == est::EstimatorNode::Kind::kMotor; });
    imrig_msg::samples_t block = {};
    for (const auto& m : messages_) {
      emitted = false;
      if (guarded_decode_into(m, block)) node.take(block);
      completes_.push_back(emitted);
    }
  }

  void run(const std::string& root) {
    RigConfig rig = load_rig_config(root + "/models/rigs/proca_5hp.toml");
    rig.bus.url = url_;
    const Scratch scratch;
    write_text_atomically(scratch / "rig.toml", to_toml(rig));
    const auto bus = open_lcm_bus(rig.bus);
    int arrived = 0, echoed = 0;
    bool alive = false;
    bus->subscribe_raw(channel::kMotorEstimate, [&](std::string_view, Bytes) { ++arrived; });
    bus->subscribe_raw(kEchoed, [&](std::string_view, Bytes) { ++echoed; });
    bus->subscribe_raw(channel::kHeartbeat, [&](std::string_view, Bytes) { alive = true; });
    const Child estimator({executable_folder() + "/imrig-estimator", "--config", scratch / "rig.toml"});
    const Child echo({executable_folder() + "/imrig-bench-online", "--echo", url_});
    const std::vector<std::uint8_t> block = messages_[messages_.size() / 2];
    for (int k = 0; k < 500 && !(alive && echoed > 0); ++k) {
      bus->publish_raw(kEcho, block);
      bus->wait(20);
    }
    if (!alive || echoed == 0) throw Error("latency", "estimator or echo does not answer");
    for (std::size_t k = 0; k < messages_.size(); ++k) {
      time_one(*bus, channel::kSamples, messages_[k], completes_[k] ? &arrived : nullptr, estimate_us);
      pause(*bus);
      // As often as an estimate, in between two of them.
      if (k >= 6 && completes_[k - 6]) {
        time_one(*bus, kEcho, block, &echoed, echo_us);
        pause(*bus);
      }
    }
  }

  std::vector<double> estimate_us, echo_us;
  int given_up = 0;

 private:
  void time_one(Bus& bus, const std::string& name, Bytes data, const int* answers, std::vector<double>& out) {
    const int before = answers != nullptr ? *answers : 0;
    const double start = now_us();
    bus.publish_raw(name, data);
    if (answers == nullptr) return;
    while (*answers == before && now_us() - start < kGiven_up_us) bus.wait(5);
    if (*answers == before) ++given_up;
    else out.push_back(now_us() - start);
  }
  static void pause(Bus& bus) {
    ::usleep(kPace_us);
    bus.wait(0);
  }

  std::vector<std::vector<std::uint8_t>> messages_;
  std::vector<bool> completes_;
  std::string url_;
};

}  // namespace

int answer_echoes(const std::string& url) {
  const auto bus = open_lcm_bus({url, "IMRIG"});
  const std::vector<std::uint8_t> answer(static_cast<std::size_t>(imrig_msg::motor_estimate_t{}.getEncodedSize()));
  bus->subscribe_raw(kEcho, [&](std::string_view, Bytes) { bus->publish_raw(kEchoed, answer); });
  while (::getppid() != 1) bus->wait(100);
  return 0;
}

Result estimator_latency_ratio(const std::string& root, int seconds) {
  Course course(root, seconds);
  course.run(root);
  if (course.estimate_us.size() < 100 || course.echo_us.size() < 100) throw Error("latency", "hardly an answer came");
  const double estimate = quantile(course.estimate_us, 0.99), echo = quantile(course.echo_us, 0.99);
  return {"estimator_latency_ratio", estimate / echo, "p99 over p99", 1.5, false,
          fmt::format("publish of a block to arrival of its estimate: p99 {:.0f} us, median {:.0f} us, {} times; echo of the same sizes in between: p99 {:.0f} us, "
                      "median {:.0f} us, {} times; {} without an answer",
                      estimate, quantile(course.estimate_us, 0.5), course.estimate_us.size(), echo, quantile(course.echo_us, 0.5),
                      course.echo_us.size(), course.given_up)};
}

}  // namespace imrig::bench
