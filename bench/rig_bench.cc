// Speed of the whole rig, from the logs of real campaigns on the emulator: stack_rtf, rt_lateness_us, identify_record_ms,
// log_read_MB_s. The campaigns are run with `imrig campaign run`, as a user would.
// usage: imrig-bench-rig [--json] --root DIR NAME...

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <imrig_msg/samples_t.hpp>
#include <optional>
#include <vector>

#include "bench/command.h"
#include "bench/result.h"
#include "rig/base/clock.h"
#include "rig/base/error.h"
#include "rig/bus/event_log.h"
#include "rig/bus/guarded_decode.h"
#include "rig/bus/log_records.h"
#include "rig/data/record.h"

namespace imrig::bench {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// The sample blocks of a log: when they reached the recorder, when their last sample was taken.
struct Block {
  std::int64_t arrived_us, sampled_us;
};

struct Blocks {
  std::vector<Block> all;
  std::int64_t lost = 0;
  double period_us = 0.0;  // of a whole block
};

Blocks blocks_of(const std::string& log) {
  EventLogReader reader(log);
  Blocks blocks;
  std::int64_t next_index = -1;
  LogEvent event;
  while (reader.next(event)) {
    if (!event.channel.ends_with("_SAMPLES")) continue;
    const auto block = guarded_decode<imrig_msg::samples_t>(event.data);
    if (!block || block->n < 1) throw Error(log, "holds a sample block that cannot be read");
    if (next_index >= 0) blocks.lost += block->first_index - next_index;
    next_index = block->first_index + block->n;
    blocks.all.push_back({event.utime, (next_index - 1) * block->sample_time_ns / 1000});
    blocks.period_us = std::max(blocks.period_us, 1e-3 * static_cast<double>(block->sample_time_ns) * block->n);
  }
  if (blocks.all.size() < 100) throw Error(log, "holds hardly a sample block");
  return blocks;
}

class Rig {
 public:
  explicit Rig(std::string root) : root_(std::move(root)) {}

  Result stack_rtf() {
    const Campaign& c = at_full_pace();
    const Blocks blocks = blocks_of(c.log());
    const Block &first = blocks.all.front(), &last = blocks.all.back();
    const double rig_s = 1e-6 * static_cast<double>(last.sampled_us - first.sampled_us);
    const double wall_s = 1e-6 * static_cast<double>(last.arrived_us - first.arrived_us);
    return {"stack_rtf", rig_s / wall_s, "x real time", 40.0, true,
            fmt::format("campaigns/quick.toml at pace max on {}: {:.1f} s of the rig in {:.2f} s, {} of {} points, {} samples "
                        "and {} blocks lost; {:.2f} s with start and end of the processes",
                        c.plant, rig_s, wall_s, c.result.at("points_done").get<int>(),
                        c.result.at("points_total").get<int>(), blocks.lost, c.result.at("lost_blocks").get<int>(),
                        c.result.at("wall_s").get<double>())};
  }

  Result rt_lateness_us() {
    const Campaign c = run("dc.toml", "realtime");
    const Blocks blocks = blocks_of(c.log());
    std::vector<std::int64_t> late;
    for (const Block& b : blocks.all) late.push_back(b.arrived_us - b.sampled_us);
    std::sort(late.begin(), late.end());
    const std::int64_t least = late.front();
    for (std::int64_t& l : late) l -= least;
    const auto met = std::upper_bound(late.begin(), late.end(), static_cast<std::int64_t>(blocks.period_us)) - late.begin();
    const double share = 100.0 * static_cast<double>(met) / static_cast<double>(late.size());
    const auto at = [&](double quantile) {
      return late[static_cast<std::size_t>(quantile * static_cast<double>(late.size() - 1))];
    };
    return {"rt_lateness_us", static_cast<double>(at(0.999)), "us, p99.9", blocks.period_us, false,
            fmt::format("campaigns/dc.toml in real time on {}: {} blocks in the recorder, {:.2f} % within one block time of the "
                        "earliest (target 99.9 %), median {} us, p99 {} us, most {} us, {} samples lost",
                        c.plant, late.size(), share, at(0.5), at(0.99), late.back(), blocks.lost)};
  }

  Result identify_record_ms() {
    const Campaign& c = at_full_pace();
    const std::int64_t start = monotonic_us();
    const json found = answer(fmt::format("imrig identify {} --out {} --json", c.folder, scratch_ / "model.toml"));
    const double wall_ms = 1e-3 * static_cast<double>(monotonic_us() - start);
    const int records = c.result.at("points_done").get<int>();
    return {"identify_record_ms", wall_ms / records, "ms a record", 1000.0, false,
            fmt::format("imrig identify on {} records of campaigns/quick.toml, reading included: {:.1f} s", records,
                        1e-3 * wall_ms)};
  }

  Result log_read_MB_s() {
    const Campaign& c = at_full_pace();
    const double MB = 1e-6 * static_cast<double>(fs::file_size(c.log()));
    const std::int64_t start = monotonic_us();
    const DataSet data = read_log(c.log());
    const double s = 1e-6 * static_cast<double>(monotonic_us() - start);
    return {"log_read_MB_s", MB / s, "MB/s", 50.0, true,
            fmt::format("{:.0f} MB, {} records into memory in {:.2f} s", MB, data.records.size(), s)};
  }

 private:
  struct Campaign {
    std::string folder, plant;
    json result;
    std::string log() const { return folder + "/log-000.lcm"; }
  };

  Campaign run(const std::string& plan, const std::string& pace) const {
    Campaign c;
    c.folder = scratch_ / (plan + "-" + pace);
    c.plant = fs::exists(root_ + "/models/plants/proca_5hp_full.toml") ? "proca_5hp_full.toml" : "proca_5hp.toml";
    c.result = answer(fmt::format("imrig campaign run {0}/campaigns/{1} --emulate {0}/models/plants/{2} --pace {3} --out {4} --json",
                                  root_, plan, c.plant, pace, c.folder));
    if (c.result.at("end") != "done") throw Error(plan, "did not run to its end: " + c.result.dump());
    return c;
  }

  const Campaign& at_full_pace() {
    if (!quick_) quick_ = run("quick.toml", "max");
    return *quick_;
  }

  std::string root_;
  Scratch scratch_;
  std::optional<Campaign> quick_;
};

int body(int argc, char** argv) {
  bool as_json = false;
  std::string root = ".";
  std::vector<std::string> names;
  for (int k = 1; k < argc; ++k) {
    const std::string word = argv[k];
    if (word == "--json") as_json = true;
    else if (word == "--root" && k + 1 < argc) root = argv[++k];
    else names.push_back(word);
  }
  Rig rig(root);
  for (const std::string& name : names) {
    if (name == "stack_rtf") print(rig.stack_rtf(), as_json);
    else if (name == "rt_lateness_us") print(rig.rt_lateness_us(), as_json);
    else if (name == "identify_record_ms") print(rig.identify_record_ms(), as_json);
    else if (name == "log_read_MB_s") print(rig.log_read_MB_s(), as_json);
    else throw Error("usage", "no benchmark is called " + name);
  }
  return 0;
}

}  // namespace
}  // namespace imrig::bench

int main(int argc, char** argv) { return imrig::run_main("imrig-bench-rig", imrig::bench::body, argc, argv); }
