#pragma once
// What a log holds, kept up while it is written: per channel and stream counts and losses, records with their
// offsets in the file. A convenience; every reader can do without.

#include <cstdint>
#include <imrig_msg/record_t.hpp>
#include <map>
#include <string>
#include <vector>

#include "rig/bus/bytes.h"
#include "rig/recorder/stream_watch.h"

namespace imrig {

class LogIndex {
 public:
  explicit LogIndex(const std::string& prefix) : prefix_(prefix + "_") {}

  struct Channel {
    std::int64_t count = 0;
    std::int64_t bytes = 0;
    std::int64_t first_utime = 0;  // us since 1970, of arrival
    std::int64_t last_utime = 0;
    std::int64_t lost = 0;  // found missing here, by seq
  };
  struct RecordEntry {
    std::string id;
    std::int32_t number = 0;
    std::int64_t begin_offset = -1;  // of the RECORD messages
    std::int64_t end_offset = -1;    // -1: none yet
    std::int32_t status = -1;        // record_t's constants; -1: no end yet
    std::int64_t samples = 0;
  };

  void add(std::int64_t utime, const std::string& channel, Bytes data, std::int64_t offset);

  // Of the last event added: it ends a record, which has this number; else 0.
  std::int32_t ended_record() const { return ended_record_; }
  std::int32_t begun_record() const { return begun_record_; }  // likewise

  const std::map<std::string, Channel>& channels() const { return channels_; }
  const std::vector<RecordEntry>& records() const { return records_; }
  const StreamWatch& streams() const { return streams_; }

  struct Losses {
    std::int64_t kernel_drops = 0;  // datagrams the kernel had no room for, all channels
    std::int64_t memory_drops = 0;  // messages dropped because the disk was too slow for the memory limit
    std::int64_t foreign = 0;       // messages of other prefixes, not recorded
  };
  std::string to_json(const std::string& log, std::int64_t bytes, const Losses& losses) const;

 private:
  void add_record(const imrig_msg::record_t& message, std::int64_t offset);

  std::string prefix_;
  std::map<std::string, Channel> channels_;
  std::vector<RecordEntry> records_;
  StreamWatch streams_;
  std::int32_t ended_record_ = 0;
  std::int32_t begun_record_ = 0;
};

}  // namespace imrig
