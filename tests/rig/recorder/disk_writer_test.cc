#include "rig/recorder/disk_writer.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include "rig/base/error.h"
#include "tests/rig/bus/messages.h"
#include "tests/rig/bus/wire.h"

namespace imrig::test {
namespace {

constexpr std::size_t kMemory = std::size_t{64} << 20;

// A real disk-full: the process may not make files longer than this.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    ::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &before_);
    rlimit now = before_;
    now.rlim_cur = bytes;
    ::setrlimit(RLIMIT_FSIZE, &now);
  }
  ~FileSizeLimit() { lift(); }
  void lift() { ::setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_ = {};
};

TEST(DiskWriter, WritesEverythingInOrderAndSaysWhichRecordIsOnDisk) {
  const Folder folder;
  DiskWriter writer(folder / "a.lcm", "IMRIG", false, kMemory);
  imrig_msg::record_t mark = record();
  mark.number = 4;
  ASSERT_TRUE(writer.push(1, "IMRIG_RECORD", encoded(mark)));
  for (int k = 0; k < 1000; ++k)
    ASSERT_TRUE(writer.push(2 + k, "IMRIG_X", ByteVector{static_cast<std::uint8_t>(k)}));
  EXPECT_EQ(writer.flushed_record(), 0);
  mark.phase = imrig_msg::record_t::END;
  ASSERT_TRUE(writer.push(2000, "IMRIG_RECORD", encoded(mark)));
  ASSERT_TRUE(wait_until([&] { return writer.flushed_record() == 4; }));
  const auto before_the_end = all_events(folder / "a.lcm");
  ASSERT_EQ(before_the_end.size(), 1002u);
  for (int k = 0; k < 1000; ++k)
    EXPECT_EQ(before_the_end[static_cast<std::size_t>(k) + 1].data[0], static_cast<std::uint8_t>(k));
  // The next campaign counts its records from 1 again.
  mark.phase = imrig_msg::record_t::BEGIN;
  mark.number = 1;
  writer.push(2001, "IMRIG_RECORD", encoded(mark));
  EXPECT_TRUE(wait_until([&] { return writer.flushed_record() == 0; }));
  EXPECT_TRUE(writer.finish());
  EXPECT_EQ(writer.bytes(), EventLogReader(folder / "a.lcm").size());
  EXPECT_EQ(writer.index().records().size(), 2u);
}

TEST(DiskWriter, FullDiskLosesNothingOnceThereIsRoomAgain) {
  const Folder folder;
  DiskWriter writer(folder / "a.lcm", "IMRIG", false, kMemory);
  FileSizeLimit limit(50000);
  for (int k = 0; k < 2000; ++k)
    ASSERT_TRUE(writer.push(k, "IMRIG_X", ByteVector(200, static_cast<std::uint8_t>(k))));
  ASSERT_TRUE(wait_until([&] { return !writer.failure().empty(); }));
  EXPECT_NE(writer.failure().find("cannot be written"), std::string::npos);
  limit.lift();
  EXPECT_TRUE(wait_until([&] { return writer.failure().empty() && writer.waiting_bytes() == 0; }));
  EXPECT_TRUE(writer.finish());
  const auto events = all_events(folder / "a.lcm");
  ASSERT_EQ(events.size(), 2000u);
  for (int k = 0; k < 2000; ++k)
    EXPECT_EQ(events[static_cast<std::size_t>(k)].data, ByteVector(200, static_cast<std::uint8_t>(k)));
}

TEST(DiskWriter, BeyondTheMemoryLimitMessagesAreDroppedAndCounted) {
  const Folder folder;
  DiskWriter writer(folder / "a.lcm", "IMRIG", false, std::size_t{1} << 20);
  FileSizeLimit limit(50000);
  int taken = 0;
  for (int k = 0; k < 5000; ++k) taken += writer.push(k, "IMRIG_X", ByteVector(1000)) ? 1 : 0;
  EXPECT_GT(taken, 100);
  EXPECT_LT(taken, 5000);
  EXPECT_EQ(writer.dropped(), 5000 - taken);
  limit.lift();
  EXPECT_TRUE(writer.finish());
  EXPECT_EQ(all_events(folder / "a.lcm").size(), static_cast<std::size_t>(taken));
}

TEST(DiskWriter, DiskThatStaysFullIsSaidAtTheEnd) {
  const Folder folder;
  DiskWriter writer(folder / "a.lcm", "IMRIG", false, kMemory);
  const FileSizeLimit limit(50000);
  for (int k = 0; k < 2000; ++k) writer.push(k, "IMRIG_X", ByteVector(200));
  EXPECT_FALSE(writer.finish());
  EXPECT_NE(writer.failure(), "");
}

TEST(DiskWriter, AppendingKeepsTheIndexOfWhatWasThere) {
  const Folder folder;
  for (int run = 0; run < 2; ++run) {
    DiskWriter writer(folder / "a.lcm", "IMRIG", true, kMemory);
    writer.push(1, "IMRIG_X", ByteVector(10));
    EXPECT_TRUE(writer.finish());
    EXPECT_EQ(writer.index().channels().at("IMRIG_X").count, run + 1);
  }
  EXPECT_EQ(all_events(folder / "a.lcm").back().number, 1);
}

}  // namespace
}  // namespace imrig::test
