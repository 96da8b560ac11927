#include "rig/campaign/log_scan.h"

#include <algorithm>
#include <imrig_msg/record_t.hpp>
#include <imrig_msg/samples_t.hpp>
#include <map>

#include "rig/base/error.h"
#include "rig/bus/channels.h"
#include "rig/bus/event_log.h"
#include "rig/bus/guarded_decode.h"

namespace imrig {

namespace {

using imrig_msg::record_t;
using imrig_msg::samples_t;

class Scanner {
 public:
  Scanner(LogScan& scan, const std::string& prefix)
      : scan_(scan),
        record_channel_(prefix + "_" + channel::kRecord),
        samples_channel_(prefix + "_" + channel::kSamples) {}

  void part(const std::string& path, int part) {
    EventLogReader reader(path);
    samples_.clear();
    for (LogEvent event; reader.next(event);) {
      if (event.channel == samples_channel_) {
        if (const auto block = guarded_decode<samples_t>(event.data); block && block->record != 0)
          samples_[block->record] += block->n;
      } else if (event.channel == record_channel_) {
        if (const auto record = guarded_decode<record_t>(event.data)) take(*record, part);
      }
    }
  }

 private:
  void take(const record_t& record, int part) {
    scan_.highest_number = std::max(scan_.highest_number, record.number);
    if (record.phase != record_t::END || record.status != record_t::COMPLETE) return;
    if (samples_[record.number] != record.samples) return;
    std::erase_if(scan_.whole, [&](const DonePoint& p) { return p.id == record.id; });
    scan_.whole.push_back({record.id, record.number, part, record.samples});
  }

  LogScan& scan_;
  std::string record_channel_;
  std::string samples_channel_;
  std::map<std::int32_t, std::int64_t> samples_;  // by record number
};

}  // namespace

LogScan scan_log_parts(const std::string& folder, const std::string& prefix) {
  LogScan scan;
  Scanner scanner(scan, prefix);
  for (int part = 0; part < count_log_parts(folder); ++part) {
    try {
      scanner.part(log_part_path(folder, part), part);
    } catch (const Error&) {
      continue;  // killed before the first event was written
    }
  }
  return scan;
}

}  // namespace imrig
