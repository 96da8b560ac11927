#include "rig/bus/log_records.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <unordered_map>

#include "rig/base/error.h"
#include "rig/base/file.h"
#include "rig/bus/channels.h"
#include "rig/bus/event_log.h"
#include "rig/bus/guarded_decode.h"
#include "rig/bus/record_builder.h"
#include "rig/bus/record_collector.h"
#include "rig/bus/speed_from_counts.h"
#include "rig/data/data_hash.h"

namespace imrig {

namespace {

// Hands a message to the collector; false when it is not what its channel promises.
using Intake = bool (*)(RecordCollector&, Bytes);

template <class Message>
bool take(RecordCollector& collector, Bytes data) {
  std::optional<Message> message = guarded_decode<Message>(data);
  if (!message) return false;
  if constexpr (std::is_same_v<Message, imrig_msg::record_t>) {
    if (message->number <= 0) return false;  // 0 is the number of samples that belong to no record
  }
  if constexpr (std::is_same_v<Message, imrig_msg::samples_t>) {
    return collector.add(std::move(*message));
  } else {
    collector.add(*message);
    return true;
  }
}

constexpr std::array<std::pair<const char*, Intake>, 6> kIntakes = {
    {{channel::kSamples, take<imrig_msg::samples_t>},
     {channel::kRecord, take<imrig_msg::record_t>},
     {channel::kSeries, take<imrig_msg::series_t>},
     {channel::kPoints, take<imrig_msg::points_t>},
     {channel::kRemark, take<imrig_msg::remark_t>},
     {channel::kDataset, take<imrig_msg::dataset_t>}}};

// What one prefix says.
struct Source {
  RecordCollector collector;
  std::int64_t taken = 0;
};

struct Route {
  Intake intake = nullptr;  // none: a channel that no record needs
  std::string prefix;
  std::int64_t messages = 0;
  std::int64_t malformed = 0;
};

Route route_of(const std::string& name) {
  for (const auto& [ending, intake] : kIntakes) {
    const std::string tail = std::string("_") + ending;
    if (name.size() > tail.size() && name.ends_with(tail))
      return {intake, name.substr(0, name.size() - tail.size())};
  }
  return {};
}

struct Contents {
  std::map<std::string, Source> sources;  // by prefix
  std::unordered_map<std::string, Route> routes;
  std::vector<std::string> notes;  // about the file
};

void note_damage(const EventLogReader& log, std::vector<std::string>& notes) {
  if (log.torn())
    notes.push_back(
        fmt::format("the log ends inside an event: its last {} bytes are left out", log.torn_bytes()));
  if (log.garbage_stretches() > 0) {
    notes.push_back(fmt::format("{} bytes in {} places are no event and are left out", log.garbage_bytes(),
                                log.garbage_stretches()));
  }
}

Contents read_contents(const std::string& path, const std::string& wanted_prefix) {
  Contents out;
  EventLogReader log(path);
  LogEvent event;
  while (log.next(event)) {
    auto found = out.routes.find(event.channel);
    if (found == out.routes.end()) found = out.routes.emplace(event.channel, route_of(event.channel)).first;
    Route& route = found->second;
    ++route.messages;
    if (route.intake == nullptr || (!wanted_prefix.empty() && route.prefix != wanted_prefix)) continue;
    Source& source = out.sources[route.prefix];
    if (route.intake(source.collector, event.data)) {
      ++source.taken;
    } else {
      ++route.malformed;
    }
  }
  note_damage(log, out.notes);
  return out;
}

// The prefix that has records.
std::string choose_prefix(const std::string& path, const Contents& contents) {
  std::vector<std::string> with_records;
  std::vector<std::string> with_samples;
  for (const auto& [prefix, source] : contents.sources) {
    if (source.collector.has_records()) with_records.push_back(prefix);
    if (source.taken > 0) with_samples.push_back(prefix);
  }
  if (with_records.size() == 1) return with_records.front();
  if (with_records.size() > 1) {
    throw Error(path, fmt::format("holds records of several rigs: {}", fmt::join(with_records, ", ")),
                "name the prefix to read");
  }
  if (!with_samples.empty()) {
    throw Error(path, fmt::format("is a log of {} but holds no record", with_samples.front()),
                "a campaign marks its records with RECORD messages; was the log started after them?");
  }
  std::int64_t messages = 0;
  for (const auto& [name, route] : contents.routes) messages += route.messages;
  throw Error(path,
              fmt::format("is an LCM log without any message of imrig ({} messages on {} other channels)",
                          messages, contents.routes.size()),
              "a log of a campaign or of imrig import is needed here");
}

void note_other_traffic(const Contents& contents, const std::string& prefix,
                        std::vector<std::string>& notes) {
  std::int64_t others = 0;
  std::int64_t malformed = 0;
  std::int64_t channels = 0;
  for (const auto& [name, route] : contents.routes) {
    if (name.starts_with(prefix + "_")) {
      malformed += route.malformed;
    } else {
      others += route.messages;
      ++channels;
    }
  }
  if (others > 0)
    notes.push_back(fmt::format("{} messages on {} other channels are ignored", others, channels));
  if (malformed > 0) notes.push_back(fmt::format("{} malformed messages are ignored", malformed));
}

void take_facts(const std::string& path, const RecordCollector& in, DataSet& out) {
  out.name = std::filesystem::path(path).stem().string();
  out.pole_pairs = in.records().front()->begin.pole_pairs;
  for (const auto& record : in.records()) {
    if (record->begin.pole_pairs != out.pole_pairs) {
      throw Error(path,
                  fmt::format("holds records of motors with {} and {} pole pairs", out.pole_pairs,
                              record->begin.pole_pairs),
                  "one log, one motor");
    }
  }
  for (const auto& facts : in.datasets()) {
    const auto& first = in.datasets().front();
    if (facts.pole_pairs != first.pole_pairs || facts.delta != first.delta) {
      throw Error(path, "holds data of two motors: pole pairs or connection differ", "one log, one motor");
    }
  }
  if (in.datasets().empty()) return;
  const auto& facts = in.datasets().back();
  if (!facts.name.empty()) out.name = facts.name;
  out.pole_pairs = facts.pole_pairs;
  out.delta = facts.delta != 0;
  out.noise = {facts.noise_current_A, facts.noise_voltage_V, facts.noise_speed_rad_s, facts.noise_torque_Nm,
               facts.noise_power_W};
  out.accuracy = {facts.accuracy_current_gain, facts.accuracy_voltage_gain};
}

SensorZero find_zero(const RecordCollector& in, DataSet& out) {
  const bool measured =
      std::any_of(in.records().begin(), in.records().end(), [](const auto& r) { return !r->blocks.empty(); });
  if (!measured) return {};  // nothing but imported records
  const SensorZero zero = in.zero();
  if (zero.samples == 0) {
    out.notes.emplace_back(
        "no samples with gates off at rest: the sensors' zeros are taken as 0 counts, their noise is "
        "unknown");
    return zero;
  }
  out.notes.push_back(
      fmt::format("sensor zeros from {} samples with gates off at rest: currents {:.3f} {:.3f} {:.3f}, "
                  "voltages {:.3f} {:.3f} {:.3f} counts",
                  zero.samples, zero.counts[kIa], zero.counts[kIb], zero.counts[kIc], zero.counts[kVa],
                  zero.counts[kVb], zero.counts[kVc]));
  return zero;
}

// What is declared comes first.
void measure_noise(const SensorZero& zero, const RecordCollector& in, Noise& noise) {
  const auto fill = [](double& declared, double measured) {
    if (std::isnan(declared)) declared = measured;
  };
  for (const auto& record : in.records()) {
    if (record->blocks.empty()) continue;
    const auto& facts = *record->blocks.front();
    if (zero.samples > 0) {
      fill(noise.current_A, zero.current_noise_A);
      fill(noise.voltage_V, zero.voltage_noise_V);
    }
    if (facts.encoder_counts_per_rev > 0) {
      fill(noise.speed_rad_s,
           speed_noise_rad_s(static_cast<double>(facts.sample_time_ns) * 1e-9, facts.encoder_counts_per_rev));
    }
    return;
  }
}

std::uint64_t hash_of_one(const Record& record, const DataSet& set) {
  DataSet alone;
  alone.pole_pairs = set.pole_pairs;
  alone.delta = set.delta;
  alone.records.push_back(record);
  return hash_of(alone);
}

// Builds the records; a later whole one replaces an earlier one of the same id.
void build_all(const RecordCollector& in, const SensorZero& zero, DataSet& out) {
  std::vector<std::uint64_t> hashes;
  bool measured = false;
  for (const auto& raw : in.records()) {
    BuiltRecord built = build_record(*raw, zero);
    if (!built.record) {
      out.notes.push_back(fmt::format("record {} is left out: {}", raw->begin.id, built.reason));
      continue;
    }
    const auto same = std::find_if(out.records.begin(), out.records.end(),
                                   [&](const Record& r) { return r.id == built.record->id; });
    if (same != out.records.end()) {
      hashes.erase(hashes.begin() + (same - out.records.begin()));
      out.records.erase(same);
      out.notes.push_back(
          fmt::format("record {} was taken more than once: the last one counts", built.record->id));
    }
    measured = measured || built.from_samples;
    hashes.push_back(built.from_samples ? built.raw_hash : hash_of_one(*built.record, out));
    out.records.push_back(std::move(*built.record));
  }
  for (const auto& [number, count] : in.without_begin()) {
    out.notes.push_back(fmt::format("record number {} is left out: the log has no begin of it", number));
  }
  if (!measured) {
    out.hash = hash_of(out);  // as for the folder it was imported from
    return;
  }
  hashes.push_back(static_cast<std::uint64_t>(out.pole_pairs) * 2 + (out.delta ? 1 : 0));
  out.hash = fnv1a64({reinterpret_cast<const char*>(hashes.data()), hashes.size() * sizeof hashes[0]});
}

}  // namespace

DataSet read_log(const std::string& path, const std::string& prefix) {
  const Contents contents = read_contents(path, prefix);
  const std::string chosen = choose_prefix(path, contents);
  const RecordCollector& collector = contents.sources.at(chosen).collector;
  DataSet out;
  take_facts(path, collector, out);
  out.notes = collector.remarks();
  const SensorZero zero = find_zero(collector, out);
  measure_noise(zero, collector, out.noise);
  build_all(collector, zero, out);
  out.notes.insert(out.notes.end(), contents.notes.begin(), contents.notes.end());
  note_other_traffic(contents, chosen, out.notes);
  if (out.records.empty()) {
    throw Error(
        path,
        fmt::format("holds no whole record; {}", out.notes.empty() ? "all are empty" : out.notes.front()),
        "see imrig info, or run the campaign again");
  }
  return out;
}

}  // namespace imrig
