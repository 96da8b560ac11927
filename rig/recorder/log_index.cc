#include "rig/recorder/log_index.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "rig/bus/channels.h"
#include "rig/bus/guarded_decode.h"

namespace imrig {

void LogIndex::add(std::int64_t utime, const std::string& channel, Bytes data, std::int64_t offset) {
  begun_record_ = ended_record_ = 0;
  Channel& entry = channels_[channel];
  if (entry.count == 0) entry.first_utime = utime;
  ++entry.count;
  entry.bytes += static_cast<std::int64_t>(data.size());
  entry.last_utime = utime;
  if (!channel.starts_with(prefix_)) return;
  const std::string_view name = std::string_view(channel).substr(prefix_.size());
  if (const auto place = stream_place(name, data))
    entry.lost = std::max<std::int64_t>(0, entry.lost + streams_.see(*place));
  if (name != channel::kRecord) return;
  if (const auto message = guarded_decode<imrig_msg::record_t>(data)) add_record(*message, offset);
}

void LogIndex::add_record(const imrig_msg::record_t& message, std::int64_t offset) {
  if (message.phase == imrig_msg::record_t::BEGIN) {
    begun_record_ = message.number;
    records_.push_back({message.id, message.number, offset});
    return;
  }
  if (message.phase != imrig_msg::record_t::END) return;
  ended_record_ = message.number;
  const auto open = std::find_if(records_.rbegin(), records_.rend(),
                                 [&](const RecordEntry& r) { return r.number == message.number; });
  if (open == records_.rend() || open->end_offset >= 0) {
    records_.push_back({message.id, message.number, -1, offset, message.status, message.samples});
    return;
  }
  open->end_offset = offset;
  open->status = message.status;
  open->samples = message.samples;
}

std::string LogIndex::to_json(const std::string& log, std::int64_t bytes, const Losses& losses) const {
  using nlohmann::json;
  json out = {{"log", log},
              {"bytes", bytes},
              {"kernel_drops", losses.kernel_drops},
              {"memory_drops", losses.memory_drops},
              {"other_prefixes", losses.foreign}};
  out["channels"] = json::object();
  for (const auto& [name, c] : channels_) {
    out["channels"][name] = {{"count", c.count},
                             {"bytes", c.bytes},
                             {"first_utime", c.first_utime},
                             {"last_utime", c.last_utime},
                             {"lost", c.lost}};
  }
  out["streams"] = json::object();
  for (const auto& [name, s] : streams_.streams()) {
    out["streams"][name] = {{"received", s.received}, {"lost", s.lost}, {"restarts", s.restarts}};
  }
  out["records"] = json::array();
  for (const auto& r : records_) {
    const bool ended = r.end_offset >= 0;
    json entry = {{"id", r.id}, {"number", r.number}, {"samples", r.samples}};
    entry["begin_offset"] = r.begin_offset >= 0 ? json(r.begin_offset) : json();
    entry["end_offset"] = ended ? json(r.end_offset) : json();
    entry["status"] = !ended ? "open" : r.status == imrig_msg::record_t::COMPLETE ? "complete" : "aborted";
    out["records"].push_back(std::move(entry));
  }
  return out.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
}

}  // namespace imrig
