#pragma once
// Messages of one prefix, in the log's order, to what belongs to each record. Knows no file; record_builder.h
// turns the result into units.

#include <cstdint>
#include <imrig_msg/dataset_t.hpp>
#include <imrig_msg/points_t.hpp>
#include <imrig_msg/record_t.hpp>
#include <imrig_msg/remark_t.hpp>
#include <imrig_msg/samples_t.hpp>
#include <imrig_msg/series_t.hpp>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rig/bus/sensor_zero.h"

namespace imrig {

using SampleBlock = std::shared_ptr<const imrig_msg::samples_t>;

// Everything the log holds of one record, before any judgement but what its messages say themselves.
struct RawRecord {
  imrig_msg::record_t begin;
  std::optional<imrig_msg::record_t> end;
  std::vector<SampleBlock> blocks;  // in order of arrival
  std::vector<SampleBlock> before;  // contiguous with the first block: margin for the speed
  std::vector<SampleBlock> after;   // contiguous with the last block
  std::vector<imrig_msg::series_t> series;
  std::vector<imrig_msg::points_t> points;
  std::vector<std::string> remarks;
};

class RecordCollector {
 public:
  void add(const imrig_msg::dataset_t& message);
  void add(const imrig_msg::record_t& message);
  void add(const imrig_msg::remark_t& message);
  void add(const imrig_msg::series_t& message);
  void add(const imrig_msg::points_t& message);
  // False when the block's own facts (scales, sample time, index) are impossible; it is dropped then.
  bool add(imrig_msg::samples_t&& message);

  bool has_records() const { return !records_.empty(); }
  const std::vector<std::unique_ptr<RawRecord>>& records() const {
    return records_;
  }  // in order of their begins
  const std::vector<imrig_msg::dataset_t>& datasets() const { return datasets_; }
  const std::vector<std::string>& remarks() const { return remarks_; }
  SensorZero zero() const { return zero_.result(); }
  // Samples or an END whose record never began: the log was started too late. Numbers of those records.
  const std::map<std::int32_t, std::int64_t>& without_begin() const { return without_begin_; }

 private:
  RawRecord* current(std::int32_t number);
  void remember(const SampleBlock& block);
  void extend_margins(const SampleBlock& block);

  std::vector<std::unique_ptr<RawRecord>> records_;
  std::map<std::int32_t, RawRecord*> by_number_;
  std::vector<imrig_msg::dataset_t> datasets_;
  std::vector<std::string> remarks_;
  std::map<std::int32_t, std::int64_t> without_begin_;
  ZeroCollector zero_;
  std::vector<SampleBlock> recent_;  // contiguous, of whatever record, as many as a margin needs
  std::vector<RawRecord*> want_after_;
};

}  // namespace imrig
