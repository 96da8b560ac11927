#include <algorithm>
#include <cstring>
#include <utility>

#include "rig/base/error.h"
#include "rig/bus/event_log.h"
#include "rig/bus/file_window.h"
#include "rig/bus/log_bytes.h"

namespace imrig {

struct EventLogReader::State {
  explicit State(const std::string& path) : file(path) {}

  FileWindow file;
  std::int64_t at = 0;     // where the next event is looked for
  std::int64_t last = -1;  // offset of the event last handed out
  std::int64_t torn_bytes = 0;
  std::int64_t garbage_stretches = 0;
  std::int64_t garbage_bytes = 0;

  std::optional<LogHeader> header_at(std::int64_t offset) const;
  bool whole(std::int64_t offset, const LogHeader& header) const {
    return header.event_bytes() <= file.size() - offset;
  }
  bool followed(std::int64_t offset, const LogHeader& header) const;
  std::int64_t find_event(std::int64_t from, std::int64_t until);
  std::optional<LogHeader> next_event();
  std::optional<LogHeader> resynchronize();
};

std::optional<LogHeader> EventLogReader::State::header_at(std::int64_t offset) const {
  std::uint8_t bytes[kLogHeaderBytes];
  if (!file.peek(offset, bytes, sizeof bytes)) return std::nullopt;
  return parse_log_header(bytes);
}

// Behind the event comes another sync word, or the file's end: what no length in garbage does by chance.
bool EventLogReader::State::followed(std::int64_t offset, const LogHeader& header) const {
  const std::int64_t end = offset + header.event_bytes();
  std::uint8_t sync[4] = {};
  const auto left = static_cast<std::size_t>(std::clamp<std::int64_t>(file.size() - end, 0, 4));
  if (!file.peek(end, sync, left)) return false;
  std::uint8_t expected[4];
  put_big_endian(expected, kLogSync, 4);
  return std::equal(sync, sync + left, expected);
}

// First offset in from..until-1 where a whole event starts that something sound follows; -1 if there is none.
std::int64_t EventLogReader::State::find_event(std::int64_t from, std::int64_t until) {
  constexpr std::int64_t kStep = 1 << 16;
  until = std::min(until, file.size() - static_cast<std::int64_t>(kLogHeaderBytes) + 1);
  for (std::int64_t start = from; start < until; start += kStep) {
    const std::int64_t stop = std::min(start + kStep, until);
    for (std::int64_t k = start; k < stop; ++k) {
      const std::uint8_t* bytes = file.at(k, static_cast<std::size_t>(stop - k) + 3);
      const void* first =
          std::memchr(bytes, static_cast<int>(kLogSync >> 24), static_cast<std::size_t>(stop - k));
      if (first == nullptr) break;
      k += static_cast<const std::uint8_t*>(first) - bytes;
      if (!is_log_sync(static_cast<const std::uint8_t*>(first))) continue;
      const auto header = header_at(k);
      if (header && whole(k, *header) && followed(k, *header)) return k;
    }
  }
  return -1;
}

// At `at` there is no event that something sound follows: is it a good one before garbage, garbage itself, or
// the torn tail?
std::optional<LogHeader> EventLogReader::State::resynchronize() {
  const auto header = header_at(at);
  const std::int64_t left = file.size() - at;
  if (header && whole(at, *header) && find_event(at + 4, at + header->event_bytes()) < 0)
    return header;  // garbage comes after it
  const std::int64_t found = find_event(at + 1, file.size());
  if (found >= 0) {
    ++garbage_stretches;
    garbage_bytes += found - at;
    at = found;
    return header_at(at);
  }
  std::uint8_t start[4];
  const bool cut = header || (left < static_cast<std::int64_t>(kLogHeaderBytes) &&
                              (left < 4 || (file.peek(at, start, 4) && is_log_sync(start))));
  if (cut) {
    torn_bytes = left;
  } else {
    ++garbage_stretches;
    garbage_bytes += left;
  }
  at = file.size();
  return std::nullopt;
}

std::optional<LogHeader> EventLogReader::State::next_event() {
  if (at >= file.size()) return std::nullopt;
  const std::uint8_t* bytes = file.at(at, kLogHeaderBytes);
  const auto header = bytes == nullptr ? std::nullopt : parse_log_header(bytes);
  if (header && whole(at, *header) && followed(at, *header)) return header;
  return resynchronize();
}

EventLogReader::EventLogReader(const std::string& path) : state_(std::make_unique<State>(path)) {
  if (state_->file.size() == 0) throw Error(path, "is empty", "an LCM event log is needed here");
  State probe(path);
  if (!probe.next_event()) {
    throw Error(path, "is no LCM event log: no whole event in it",
                "a log by imrig-recorder, imrig import or lcm-logger is needed here");
  }
}

EventLogReader::~EventLogReader() = default;
EventLogReader::EventLogReader(EventLogReader&&) noexcept = default;
EventLogReader& EventLogReader::operator=(EventLogReader&&) noexcept = default;

bool EventLogReader::next(LogEvent& event) {
  State& s = *state_;
  const auto header = s.next_event();
  if (!header) return false;
  const std::uint8_t* bytes =
      s.file.at(s.at, static_cast<std::size_t>(header->event_bytes())) + kLogHeaderBytes;
  event.number = header->number;
  event.utime = header->utime;
  event.channel.assign(reinterpret_cast<const char*>(bytes), static_cast<std::size_t>(header->channel_bytes));
  event.data.assign(bytes + header->channel_bytes, bytes + header->channel_bytes + header->data_bytes);
  s.last = s.at;
  s.at += header->event_bytes();
  return true;
}

std::optional<LogEvent> EventLogReader::next() {
  LogEvent event;
  if (!next(event)) return std::nullopt;
  return event;
}

std::int64_t EventLogReader::offset() const { return state_->last; }
std::int64_t EventLogReader::size() const { return state_->file.size(); }
bool EventLogReader::torn() const { return state_->torn_bytes > 0; }
std::int64_t EventLogReader::torn_bytes() const { return state_->torn_bytes; }
std::int64_t EventLogReader::garbage_stretches() const { return state_->garbage_stretches; }
std::int64_t EventLogReader::garbage_bytes() const { return state_->garbage_bytes; }

}  // namespace imrig
