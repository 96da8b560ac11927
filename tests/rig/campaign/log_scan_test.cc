#include "rig/campaign/log_scan.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <imrig_msg/record_t.hpp>
#include <imrig_msg/samples_t.hpp>

#include "rig/base/file.h"
#include "rig/bus/event_log.h"

namespace imrig {
namespace {

using imrig_msg::record_t;
using imrig_msg::samples_t;

class LogScanTest : public ::testing::Test {
 protected:
  LogScanTest() {
    folder_ = (std::filesystem::temp_directory_path() / "imrig-scan-XXXXXX").string();
    if (::mkdtemp(folder_.data()) == nullptr) throw std::runtime_error("no temporary folder");
  }
  ~LogScanTest() override { std::filesystem::remove_all(folder_); }

  template <class Message>
  void write(EventLogWriter& log, const std::string& channel, const Message& message) {
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
    message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    log.write(1, channel, bytes);
  }

  void record(EventLogWriter& log, const std::string& id, int number, int samples, std::int64_t claimed,
              std::int32_t status = record_t::COMPLETE) {
    record_t r = {};
    r.record_v1 = 1;
    r.id = id;
    r.number = number;
    r.phase = record_t::BEGIN;
    write(log, "IMRIG_RECORD", r);
    samples_t s = {};
    s.samples_v1 = 1;
    s.record = number;
    s.n = samples;
    for (auto* channel : {&s.i_a, &s.i_b, &s.i_c, &s.v_a, &s.v_b, &s.v_c})
      channel->assign(static_cast<std::size_t>(samples), 0);
    s.encoder.assign(static_cast<std::size_t>(samples), 0);
    write(log, "IMRIG_SAMPLES", s);
    r.phase = record_t::END;
    r.status = status;
    r.samples = claimed;
    write(log, "IMRIG_RECORD", r);
  }

  std::string folder_;
};

TEST_F(LogScanTest, OnlyRecordsWithAllTheirSamplesAreWhole) {
  {
    EventLogWriter log(log_part_path(folder_, 0));
    record(log, "good", 1, 50, 50);
    record(log, "short", 2, 49, 50);
    record(log, "aborted", 3, 50, 50, record_t::ABORTED);
  }
  const LogScan scan = scan_log_parts(folder_, "IMRIG");
  ASSERT_EQ(scan.whole.size(), 1u);
  EXPECT_EQ(scan.whole[0].id, "good");
  EXPECT_EQ(scan.whole[0].samples, 50);
  EXPECT_EQ(scan.highest_number, 3);
}

TEST_F(LogScanTest, TornAndEmptyPartsArePassedOver) {
  {
    EventLogWriter log(log_part_path(folder_, 0));
    record(log, "a", 1, 50, 50);
    record(log, "b", 2, 50, 50);
  }
  const std::string whole = read_text(log_part_path(folder_, 0));
  write_text_atomically(log_part_path(folder_, 0), whole.substr(0, whole.size() - 5));  // b's END is torn
  write_text_atomically(log_part_path(folder_, 1), "");
  {
    EventLogWriter log(log_part_path(folder_, 2));
    record(log, "b", 7, 20, 20);
  }
  const LogScan scan = scan_log_parts(folder_, "IMRIG");
  ASSERT_EQ(scan.whole.size(), 2u);
  EXPECT_EQ(scan.whole[1].id, "b");
  EXPECT_EQ(scan.whole[1].part, 2);
  EXPECT_EQ(scan.highest_number, 7);
}

}  // namespace
}  // namespace imrig
