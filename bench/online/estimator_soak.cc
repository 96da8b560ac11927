// The whole stack on the emulator, rig minutes on end under load that changes: are losses noticed, does memory grow?

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <imrig_msg/ack_t.hpp>
#include <imrig_msg/heartbeat_t.hpp>
#include <imrig_msg/motor_estimate_t.hpp>
#include <thread>

#include "bench/command.h"
#include "bench/online/estimator_bench.h"
#include "rig/base/clock.h"
#include "rig/base/error.h"
#include "rig/base/file.h"
#include "rig/base/rig_config.h"
#include "rig/bus/bus.h"
#include "rig/bus/channels.h"

namespace imrig::bench {

namespace {

using imrig_msg::heartbeat_t;

std::string plan(double minutes) {
  constexpr int kPoints = 10;
  std::string out = "version = 1\nname = \"estimator soak\"\n";
  for (int k = 0; k < kPoints; ++k)
    out += fmt::format("[[point]]\nid = \"p{}\"\nkind = \"steady\"\nfrequency_Hz = {}\nvoltage_percent = {}\nload_share = {}\nsettle_s = {:.1f}\n", k,
                       k % 2 == 0 ? 60 : 40, k % 2 == 0 ? 100 : 66, 0.3 + 0.1 * (k % 4), 60.0 * minutes / kPoints);
  return out;
}

// kB of resident memory that is not files; 0 when the process is gone.
long resident_kB(int pid) {
  std::ifstream status("/proc/" + std::to_string(pid) + "/status");
  std::string word;
  while (status >> word) {
    long kB = 0;
    if (word == "RssAnon:" && status >> kB) return kB;
  }
  return 0;
}

struct Watch {
  int pid = 0;
  std::int64_t lost_blocks = 0, missing_samples = 0, last_index = 0, estimates = 0, estimate_gaps = 0, last_seq = 0;
  std::vector<long> memory_kB;
};

}  // namespace

std::vector<Result> soak(const std::string& root, double minutes) {
  const Scratch scratch;
  const std::string folder = scratch / "campaign";
  write_text_atomically(scratch / "plan.toml", plan(minutes));
  nlohmann::json result;
  std::atomic<bool> done = false;
  const std::int64_t start = monotonic_us();
  std::thread campaign([&] {
    try {
      result = answer(fmt::format("imrig campaign run {} --emulate {}/models/plants/proca_5hp.toml --pace max --out {} --json", scratch / "plan.toml", root, folder));
    } catch (const std::exception& e) {
      result = {{"end", e.what()}};
    }
    done = true;
  });
  Watch w;
  while (!done && !std::filesystem::exists(folder + "/rig.toml")) ::usleep(20000);
  if (!done) {
    const auto bus = open_lcm_bus(load_rig_config(folder + "/rig.toml").bus);
    subscribe<heartbeat_t>(*bus, channel::kHeartbeat, [&](const auto& m) {
      if (m.process == heartbeat_t::ESTIMATOR) w.pid = m.pid;
    });
    subscribe<imrig_msg::ack_t>(*bus, channel::kAck, [&](const auto& m) {
      if (m.process == heartbeat_t::ESTIMATOR) w.lost_blocks = m.lost_blocks;
    });
    subscribe<imrig_msg::motor_estimate_t>(*bus, channel::kMotorEstimate, [&](const auto& m) {
      ++w.estimates;
      if (w.last_seq > 0) w.estimate_gaps += m.seq - w.last_seq - 1;
      w.last_seq = m.seq;
      w.missing_samples = m.missing_samples;
      w.last_index = m.last_index;
    });
    std::int64_t due = monotonic_us();
    while (!done) {
      bus->wait(20);
      if (monotonic_us() < due) continue;
      due += 200'000;
      if (const long kB = w.pid > 0 ? resident_kB(w.pid) : 0; kB > 0) w.memory_kB.push_back(kB);
    }
  }
  campaign.join();
  if (result.value("end", "") != "done") throw Error("soak", "did not run to its end: " + result.dump());
  if (w.memory_kB.size() < 10) throw Error("soak", "is too short to see memory");
  // Samples that are missing by their index against blocks that are missing by their number.
  const bool told = (w.missing_samples > 0) == (w.lost_blocks > 0);
  const double rig_min = 60e-6 / 60.0 * static_cast<double>(w.last_index);
  const auto settled = w.memory_kB.begin() + static_cast<std::ptrdiff_t>(w.memory_kB.size() / 5);
  const auto [least, most] = std::minmax_element(settled, w.memory_kB.end());
  const std::string of = fmt::format("{:.0f} rig minutes at 16.7 kHz in {:.0f} s, {} estimates", rig_min, 1e-6 * static_cast<double>(monotonic_us() - start), w.estimates);
  return {{"soak", told ? 0.0 : static_cast<double>(std::max<std::int64_t>(w.lost_blocks, w.missing_samples / 256)), "blocks lost unnoticed", 0.0, false,
           fmt::format("{}; {} blocks lost by their numbers, {} samples by their index, {} estimates lost on the way to the watcher", of, w.lost_blocks,
                       w.missing_samples, w.estimate_gaps)},
          {"soak_memory_kB", static_cast<double>(w.memory_kB.back() - *settled), "kB", 256.0, false,
           fmt::format("{}; anonymous memory of imrig-estimator after the first fifth {} kB, at the end {} kB, between {} and {} kB", of, *settled, w.memory_kB.back(), *least, *most)}};
}

}  // namespace imrig::bench
