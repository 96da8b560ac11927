#pragma once
// LCM's event-log format, read and written without LCM, so that no length in a file is believed and no file
// is too large. One event, all numbers big-endian (docs/event-log.md):
//   u32 0xEDA1DA01 | i64 event number | i64 utime, us | i32 channel bytes | i32 data bytes | channel | data
// Source: lcm/eventlog.c of LCM 1.3.1, checked against lcm-logger and lcm-logplayer.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rig/bus/bytes.h"

namespace imrig {

inline constexpr std::int32_t kMaxChannelBytes = 999;    // as LCM's own reader
inline constexpr std::int32_t kMaxEventBytes = 1 << 28;  // LCM_MAX_MESSAGE_SIZE

struct LogEvent {
  std::int64_t number = 0;
  std::int64_t utime = 0;  // us; receive time, since 1970 in recorded logs
  std::string channel;
  std::vector<std::uint8_t> data;
};

// Reads a log from its beginning, one event at a time; holds one event in memory, whatever the file's size.
// Bytes that are no event are skipped up to the next event and counted; an event cut off by the file's end is
// left out and told by torn().
class EventLogReader {
 public:
  // Throws Error: missing, a folder or a pipe, empty, or no event in it at all.
  explicit EventLogReader(const std::string& path);
  ~EventLogReader();
  EventLogReader(EventLogReader&&) noexcept;
  EventLogReader& operator=(EventLogReader&&) noexcept;

  std::optional<LogEvent> next();
  // As next, into an event whose memory is used again. False at the end. Throws Error when the file cannot be
  // read any more.
  bool next(LogEvent& event);

  std::int64_t offset() const;  // of the event last handed out
  std::int64_t size() const;    // of the file when it was opened
  // Valid once next() has said there is no more:
  bool torn() const;                // the file ends inside an event
  std::int64_t torn_bytes() const;  // how many bytes of it are there
  std::int64_t garbage_stretches() const;
  std::int64_t garbage_bytes() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

enum class LogOpen { kNew, kReplace, kAppend };

// Writes a log. Every failure (disk full, no permission) throws Error.
class EventLogWriter {
 public:
  // kNew refuses a path that exists. kAppend continues an existing log behind its last whole event, cutting
  // off a torn tail, or makes a new one.
  explicit EventLogWriter(const std::string& path, LogOpen open = LogOpen::kNew);
  ~EventLogWriter();  // writes what is buffered, without complaint
  EventLogWriter(EventLogWriter&&) noexcept;
  EventLogWriter& operator=(EventLogWriter&&) noexcept;

  // Returns the event's offset in the file.
  std::int64_t write(std::int64_t utime, std::string_view channel, Bytes data);
  void flush();          // to the operating system
  void flush_to_disk();  // and to the disk
  void close();          // flush_to_disk, then close; a later write throws

  std::int64_t next_number() const;
  std::int64_t next_offset() const;  // of the next event; the file's size once everything is flushed
  std::int64_t cut_bytes() const;    // torn tail that kAppend removed

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace imrig
