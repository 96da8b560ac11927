#include "rig/bus/event_log.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <lcm/lcm.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "rig/base/error.h"
#include "rig/base/file.h"
#include "tests/rig/bus/messages.h"
#include "tests/rig/bus/wire.h"

namespace imrig::test {
namespace {

struct Event {
  std::int64_t utime;
  std::string channel;
  ByteVector data;
  bool operator==(const Event&) const = default;
};

std::vector<Event> some_events(int n, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::vector<Event> events;
  for (int k = 0; k < n; ++k) {
    ByteVector data(random() % 300);
    for (auto& byte : data) byte = static_cast<std::uint8_t>(random());
    events.push_back({1700000000000000 + 1000 * k, "IMRIG_C" + std::to_string(random() % 5), data});
  }
  return events;
}

void write_events(const std::string& path, const std::vector<Event>& events, LogOpen open = LogOpen::kNew) {
  EventLogWriter log(path, open);
  for (const auto& e : events) log.write(e.utime, e.channel, e.data);
  log.close();
}

std::vector<Event> read_events(EventLogReader& log) {
  std::vector<Event> events;
  while (auto e = log.next()) events.push_back({e->utime, e->channel, e->data});
  return events;
}

std::vector<Event> read_events(const std::string& path) {
  EventLogReader log(path);
  return read_events(log);
}

void overwrite(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

std::string complaint_of(const std::function<void()>& body) {
  try {
    body();
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

TEST(EventLog, WhatIsWrittenIsReadBack) {
  const Folder folder;
  const auto events = some_events(1000);
  write_events(folder / "a.lcm", events);
  EventLogReader log(folder / "a.lcm");
  EXPECT_EQ(read_events(log), events);
  EXPECT_FALSE(log.torn());
  EXPECT_EQ(log.garbage_bytes(), 0);
  EXPECT_EQ(log.size(), static_cast<std::int64_t>(std::filesystem::file_size(folder / "a.lcm")));
}

TEST(EventLog, NumbersAndOffsetsRiseFromZero) {
  const Folder folder;
  EventLogWriter writer(folder / "a.lcm");
  std::vector<std::int64_t> offsets;
  for (int k = 0; k < 5; ++k)
    offsets.push_back(writer.write(k, "C", ByteVector(static_cast<std::size_t>(k))));
  writer.close();
  EventLogReader log(folder / "a.lcm");
  for (int k = 0; k < 5; ++k) {
    EXPECT_EQ(log.next()->number, k);
    EXPECT_EQ(log.offset(), offsets[static_cast<std::size_t>(k)]);
  }
}

TEST(EventLog, LcmsOwnReaderReadsOurs) {
  const Folder folder;
  const auto events = some_events(500);
  write_events(folder / "a.lcm", events);
  lcm_eventlog_t* theirs = lcm_eventlog_create((folder / "a.lcm").c_str(), "r");
  ASSERT_NE(theirs, nullptr);
  std::vector<Event> read;
  while (lcm_eventlog_event_t* e = lcm_eventlog_read_next_event(theirs)) {
    const auto* data = static_cast<const std::uint8_t*>(e->data);
    read.push_back({e->timestamp, std::string(e->channel, static_cast<std::size_t>(e->channellen)),
                    ByteVector(data, data + e->datalen)});
    lcm_eventlog_free_event(e);
  }
  lcm_eventlog_destroy(theirs);
  EXPECT_EQ(read, events);
}

TEST(EventLog, LcmsFileProviderPlaysOursWithoutLoss) {
  const Folder folder;
  const auto events = some_events(2000);
  write_events(folder / "a.lcm", events);
  lcm_t* lcm = lcm_create(("file://" + (folder / "a.lcm") + "?speed=0").c_str());
  ASSERT_NE(lcm, nullptr);
  std::vector<Event> heard;
  const auto handler = [](const lcm_recv_buf_t* m, const char* channel, void* user) {
    const auto* data = static_cast<const std::uint8_t*>(m->data);
    static_cast<std::vector<Event>*>(user)->push_back({0, channel, ByteVector(data, data + m->data_size)});
  };
  lcm_subscribe(lcm, ".*", handler, &heard);
  while (lcm_handle(lcm) == 0) {
  }
  lcm_destroy(lcm);
  ASSERT_EQ(heard.size(), events.size());
  for (std::size_t k = 0; k < events.size(); ++k) {
    EXPECT_EQ(heard[k].channel, events[k].channel);
    EXPECT_EQ(heard[k].data, events[k].data);
  }
}

TEST(EventLog, WeReadWhatLcmLoggerWrote) {
  const Folder folder;
  const int port = free_udp_port();
  const auto bus = open_lcm_bus(bus_config(port));
  const std::string path = folder / "theirs.lcm";
  const auto size = [&] {
    std::error_code none;
    const auto bytes = std::filesystem::file_size(path, none);
    return none ? std::uintmax_t{0} : bytes;
  };
  const auto events = some_events(300);
  {
    Background logger({"lcm-logger", "--lcm-url=" + url_of(port), path});
    ASSERT_TRUE(wait_until([&] {  // it listens once it has written something
      bus->publish_raw("MARK", {});
      return size() > 0;
    }));
    for (const auto& e : events) {
      bus->publish_raw(e.channel, e.data);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));  // its queue holds 30
    }
    ASSERT_TRUE(wait_until([&] {
      bus->publish_raw("END", {});
      const auto read = all_events(path);
      return !read.empty() && read.back().channel == "IMRIG_END";
    }));
    logger.stop();
  }
  std::vector<Event> read;
  for (const auto& e : read_events(path)) {
    if (e.channel.starts_with("IMRIG_IMRIG_")) read.push_back(e);
  }
  ASSERT_EQ(read.size(), events.size());
  for (std::size_t k = 0; k < events.size(); ++k) {
    EXPECT_EQ(read[k].channel, "IMRIG_" + events[k].channel);
    EXPECT_EQ(read[k].data, events[k].data);
  }
}

TEST(EventLog, LcmLogplayerPlaysOurs) {
  const Folder folder;
  const int port = free_udp_port();
  auto events = some_events(300);
  for (int k = 0; k < 20; ++k) events.push_back({events.back().utime + 1000, "IMRIG_LAST", {}});
  write_events(folder / "ours.lcm", events);
  const auto bus = open_lcm_bus(bus_config(port));
  std::vector<Event> heard;
  bus->subscribe_raw("*", [&](std::string_view name, Bytes data) {
    heard.push_back({0, std::string(name), {data.begin(), data.end()}});
  });
  bus->wait(0);
  Background player({"lcm-logplayer", "--lcm-url=" + url_of(port), "--speed=1", folder / "ours.lcm"});
  ASSERT_TRUE(wait_until(*bus, [&] { return heard.size() == events.size(); }));
  for (std::size_t k = 0; k < events.size(); ++k) {
    EXPECT_EQ(heard[k].channel, events[k].channel);
    EXPECT_EQ(heard[k].data, events[k].data);
  }
}

TEST(EventLog, TornTailIsLeftOutAndSaidWhereverTheFileEnds) {
  const Folder folder;
  const auto events = some_events(4);
  const std::string path = folder / "a.lcm";
  std::vector<std::int64_t> ends;
  {
    EventLogWriter log(path);
    for (const auto& e : events) {
      log.write(e.utime, e.channel, e.data);
      ends.push_back(log.next_offset());
    }
  }
  const std::string whole = read_text(path);
  for (std::size_t size = static_cast<std::size_t>(ends[0]); size <= whole.size(); ++size) {
    overwrite(path, whole.substr(0, size));
    EventLogReader log(path);
    const auto read = read_events(log);
    const auto expected = static_cast<std::size_t>(std::count_if(
        ends.begin(), ends.end(), [&](auto end) { return end <= static_cast<std::int64_t>(size); }));
    ASSERT_EQ(read,
              std::vector<Event>(events.begin(), events.begin() + static_cast<std::ptrdiff_t>(expected)))
        << size;
    EXPECT_EQ(log.torn_bytes(), static_cast<std::int64_t>(size) - ends[expected - 1]) << size;
    EXPECT_EQ(log.garbage_stretches(), 0);
  }
}

TEST(EventLog, GarbageBetweenEventsIsSkippedAndCounted) {
  const Folder folder;
  const auto events = some_events(6);
  write_events(folder / "1.lcm", {events.begin(), events.begin() + 3});
  write_events(folder / "2.lcm", {events.begin() + 3, events.end()});
  const std::string first = read_text(folder / "1.lcm");
  const std::string second = read_text(folder / "2.lcm");
  std::mt19937 random(3);
  const std::string sync = "\xED\xA1\xDA\x01";
  for (const std::size_t n : {1u, 3u, 4u, 27u, 28u, 1000u, 200000u}) {
    std::string garbage;
    while (garbage.size() < n) garbage += static_cast<char>(random());
    garbage.resize(n);
    if (n > 100)
      garbage.replace(10, 4, sync)
          .replace(50, 28, second.substr(0, 28));  // what looks like an event, and is none
    overwrite(folder / "g.lcm", first + garbage + second);
    EventLogReader log(folder / "g.lcm");
    EXPECT_EQ(read_events(log), events) << n;
    EXPECT_EQ(log.garbage_stretches(), 1) << n;
    EXPECT_EQ(log.garbage_bytes(), static_cast<std::int64_t>(n));
    EXPECT_FALSE(log.torn());
    overwrite(folder / "h.lcm", garbage + first);
    EXPECT_EQ(read_events(folder / "h.lcm"), (std::vector<Event>(events.begin(), events.begin() + 3))) << n;
  }
}

TEST(EventLog, DamagedLengthCostsItsEventAlone) {
  const Folder folder;
  const auto events = some_events(20);
  write_events(folder / "a.lcm", events);
  const std::string whole = read_text(folder / "a.lcm");
  EventLogReader sound(folder / "a.lcm");
  for (int k = 0; k < 10; ++k) sound.next();
  const auto at = static_cast<std::size_t>(sound.offset());
  auto expected = events;
  expected.erase(expected.begin() + 9);
  for (const char* length :
       {"\x00\x00\x02\x00", "\x00\x00\x08\x00", "\x7f\xff\xff\xff", "\xff\xff\xff\xff", "\x0f\xff\xff\xff"}) {
    std::string damaged = whole;
    damaged.replace(at + 24, 4, length, 4);  // data bytes
    overwrite(folder / "b.lcm", damaged);
    EXPECT_EQ(read_events(folder / "b.lcm"), expected);
  }
}

TEST(EventLog, FileThatIsNoLogIsRefusedWithASentence) {
  const Folder folder;
  overwrite(folder / "empty", "");
  overwrite(folder / "text", std::string(100000, 'x'));
  overwrite(folder / "cut", std::string("\xED\xA1\xDA\x01", 4) + std::string(10, '\0'));
  for (const char* name : {"empty", "text", "cut", "absent"})
    EXPECT_NE(complaint_of([&] { EventLogReader log(folder / name); }), "") << name;
  EXPECT_NE(complaint_of([&] { EventLogReader log(folder.path()); }), "");
  EXPECT_NE(complaint_of([&] { EventLogReader log("/dev/zero"); }), "");
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  EXPECT_NE(complaint_of([&] { EventLogReader log(folder / "pipe"); }), "");
}

TEST(EventLog, WriterNeverOverwritesUnasked) {
  const Folder folder;
  const auto events = some_events(3);
  write_events(folder / "a.lcm", events);
  EXPECT_NE(complaint_of([&] { EventLogWriter log(folder / "a.lcm"); }).find("exists already"),
            std::string::npos);
  EXPECT_EQ(read_events(folder / "a.lcm"), events);
  EXPECT_NE(complaint_of([&] { EventLogWriter log(folder / "none/a.lcm"); }), "");
  EXPECT_NE(complaint_of([&] { EventLogWriter log(folder.path(), LogOpen::kAppend); }), "");
}

TEST(EventLog, TwoWritersOfOneLogAreRefused) {
  const Folder folder;
  EventLogWriter first(folder / "a.lcm");
  first.write(1, "C", {});
  first.flush();
  EXPECT_NE(complaint_of([&] {
              EventLogWriter second(folder / "a.lcm", LogOpen::kAppend);
            }).find("another process"),
            std::string::npos);
}

TEST(EventLog, AppendingContinuesBehindTheLastWholeEvent) {
  const Folder folder;
  const auto events = some_events(10);
  const std::string path = folder / "a.lcm";
  write_events(path, {events.begin(), events.begin() + 5}, LogOpen::kAppend);  // makes it
  std::ofstream(path, std::ios::binary | std::ios::app)
      << std::string("\xED\xA1\xDA\x01", 4) + std::string(13, '\0');
  {
    EventLogWriter log(path, LogOpen::kAppend);
    EXPECT_EQ(log.cut_bytes(), 17);
    EXPECT_EQ(log.next_number(), 5);
    for (auto e = events.begin() + 5; e != events.end(); ++e) log.write(e->utime, e->channel, e->data);
  }
  EXPECT_EQ(read_events(path), events);
  EXPECT_EQ(all_events(path).back().number, 9);
}

// Events of 64 MB of nothing: the file has holes, so it takes no disk.
TEST(EventLog, LogsBeyondFourGigabytesAreReadToTheirEnd) {
  const Folder folder;
  const std::string path = folder / "big.lcm";
  constexpr std::int64_t kData = 64 << 20;
  constexpr int kEvents = 65;
  write_events(folder / "big", {{7, "BIG", {}}});
  write_events(folder / "last", {{8, "LAST", {1, 2, 3}}});
  std::string head = read_text(folder / "big");
  head[24] = static_cast<char>(kData >> 24);  // data bytes
  const std::string last = read_text(folder / "last");
  const std::int64_t size = kData + static_cast<std::int64_t>(head.size());
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT, 0600);
  const auto put = [&](const std::string& bytes, std::int64_t at) {
    return ::pwrite(fd, bytes.data(), bytes.size(), at) == static_cast<ssize_t>(bytes.size());
  };
  for (int k = 0; k < kEvents; ++k) ASSERT_TRUE(put(head, size * k));
  ASSERT_TRUE(put(last, size * kEvents));
  ::close(fd);
  EventLogReader log(path);
  LogEvent event;
  int big = 0;
  while (log.next(event) && event.channel == "BIG") ++big;
  EXPECT_EQ(big, kEvents);
  EXPECT_EQ(event.channel, "LAST");
  EXPECT_EQ(event.data, (ByteVector{1, 2, 3}));
  EXPECT_GT(log.offset(), std::int64_t{1} << 32);
  EXPECT_FALSE(log.next(event));
  EXPECT_FALSE(log.torn());
}

}  // namespace
}  // namespace imrig::test
