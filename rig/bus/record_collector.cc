#include "rig/bus/record_collector.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "rig/bus/speed_from_counts.h"

namespace imrig {

namespace {

bool possible(const imrig_msg::samples_t& m) {
  constexpr std::int64_t kIndexLimit = std::int64_t{1} << 60;
  constexpr std::int64_t kSecond_ns = 1000000000;
  const auto scale = [](float x) { return std::isfinite(x) && x > 0.0F; };
  return m.first_index >= 0 && m.first_index < kIndexLimit && m.sample_time_ns > 0 &&
         m.sample_time_ns <= kSecond_ns && scale(m.current_A_per_count) && scale(m.voltage_V_per_count) &&
         std::isfinite(m.voltage_filter_s) && m.voltage_filter_s >= 0.0F && m.full_scale_counts > 0 &&
         m.encoder_counts_per_rev >= 0 && m.record >= 0;
}

std::int64_t end_index(const SampleBlock& block) { return block->first_index + block->n; }

bool follows(const SampleBlock& earlier, const SampleBlock& later) {
  return earlier->boot_id == later->boot_id && end_index(earlier) == later->first_index;
}

std::int64_t margin_samples(const SampleBlock& block) {
  return static_cast<std::int64_t>(speed_half_window(static_cast<double>(block->sample_time_ns) * 1e-9));
}

std::int64_t count(const std::vector<SampleBlock>& blocks) {
  std::int64_t n = 0;
  for (const auto& block : blocks) n += block->n;
  return n;
}

}  // namespace

RawRecord* RecordCollector::current(std::int32_t number) {
  const auto found = by_number_.find(number);
  return found == by_number_.end() ? nullptr : found->second;
}

void RecordCollector::add(const imrig_msg::dataset_t& message) {
  datasets_.push_back(message);
  zero_.campaign_begins(message.utime);
}

void RecordCollector::add(const imrig_msg::record_t& message) {
  if (message.phase == imrig_msg::record_t::BEGIN) {
    auto record = std::make_unique<RawRecord>();
    record->begin = message;
    by_number_[message.number] = record.get();
    records_.push_back(std::move(record));
    return;
  }
  RawRecord* record = current(message.number);
  if (message.phase != imrig_msg::record_t::END) return;
  if (record == nullptr) {
    ++without_begin_[message.number];
    return;
  }
  if (record->end) return;  // said twice
  record->end = message;
  if (message.status != imrig_msg::record_t::COMPLETE) {  // will be left out: its samples need not be kept
    record->blocks.clear();
    record->series.clear();
    record->points.clear();
    std::erase(want_after_, record);
  }
}

void RecordCollector::add(const imrig_msg::remark_t& message) {
  if (message.number == 0) {
    remarks_.push_back(message.text);
  } else if (RawRecord* record = current(message.number)) {
    record->remarks.push_back(message.text);
  }
}

void RecordCollector::add(const imrig_msg::series_t& message) {
  RawRecord* record = current(message.number);
  if (record == nullptr) {
    ++without_begin_[message.number];
  } else if (!record->end) {
    record->series.push_back(message);
  }
}

void RecordCollector::add(const imrig_msg::points_t& message) {
  RawRecord* record = current(message.number);
  if (record == nullptr) {
    ++without_begin_[message.number];
  } else if (!record->end) {
    record->points.push_back(message);
  }
}

bool RecordCollector::add(imrig_msg::samples_t&& message) {
  if (!possible(message)) return false;
  const auto block = std::make_shared<const imrig_msg::samples_t>(std::move(message));
  zero_.add(*block);
  RawRecord* record = block->record > 0 ? current(block->record) : nullptr;
  if (block->record > 0 && record == nullptr) ++without_begin_[block->record];
  // A block that arrives behind the END is still the record's, unless the record was aborted.
  if (record != nullptr && (!record->end || record->end->status == imrig_msg::record_t::COMPLETE)) {
    if (record->blocks.empty()) {
      if (!recent_.empty() && follows(recent_.back(), block)) record->before = recent_;
      want_after_.push_back(record);
    }
    record->blocks.push_back(block);
  }
  extend_margins(block);
  remember(block);
  return true;
}

// The stretch of blocks that ends with the newest, just long enough for a margin.
void RecordCollector::remember(const SampleBlock& block) {
  if (!recent_.empty() && !follows(recent_.back(), block)) recent_.clear();
  recent_.push_back(block);
  while (count(recent_) - recent_.front()->n >= margin_samples(block)) recent_.erase(recent_.begin());
}

void RecordCollector::extend_margins(const SampleBlock& block) {
  std::erase_if(want_after_, [&](RawRecord* record) {
    if (record->begin.number == block->record) return false;
    const bool next = follows(record->after.empty() ? record->blocks.back() : record->after.back(), block);
    if (next) record->after.push_back(block);
    return !next || count(record->after) >= margin_samples(block);
  });
}

}  // namespace imrig
