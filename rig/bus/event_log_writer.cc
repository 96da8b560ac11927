#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <limits>
#include <utility>

#include "rig/base/error.h"
#include "rig/bus/event_log.h"
#include "rig/bus/log_bytes.h"

namespace imrig {

namespace {
constexpr std::size_t kBufferBytes = std::size_t{1} << 18;
}  // namespace

struct EventLogWriter::State {
  std::string path;
  int fd = -1;
  std::vector<std::uint8_t> buffer;
  std::int64_t number = 0;
  std::int64_t offset = 0;  // behind the last event, buffered ones included
  std::int64_t cut_bytes = 0;

  ~State() {
    if (fd < 0) return;
    try {
      flush();
    } catch (const Error&) {  // nobody left to tell
    }
    ::close(fd);
  }

  [[noreturn]] void fail(const char* what) const {
    throw Error(path, std::string(what) + ": " + std::strerror(errno));
  }
  void open(LogOpen how);
  void continue_behind_last_event();
  void flush();
};

void EventLogWriter::State::open(LogOpen how) {
  fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | (how == LogOpen::kNew ? O_EXCL : 0), 0644);
  if (fd < 0 && errno == EEXIST) throw Error(path, "exists already", "give another name, or append to it");
  if (fd < 0) fail("cannot be written");
  struct stat info = {};
  if (::fstat(fd, &info) != 0 || !S_ISREG(info.st_mode))
    throw Error(path, "is no regular file", "give the name of a log to write");
  if (::flock(fd, LOCK_EX | LOCK_NB) != 0)
    throw Error(path, "is being written by another process", "give another name");
  if (how == LogOpen::kReplace && ::ftruncate(fd, 0) != 0) fail("cannot be cut");
  if (how == LogOpen::kAppend && info.st_size > 0) continue_behind_last_event();
}

void EventLogWriter::State::continue_behind_last_event() {
  EventLogReader log(path);
  LogEvent event;
  while (log.next(event))
    number = event.number == std::numeric_limits<std::int64_t>::max() ? 0 : event.number + 1;
  cut_bytes = log.torn_bytes();
  offset = log.size() - cut_bytes;
  if (cut_bytes > 0 && ::ftruncate(fd, offset) != 0) fail("cannot be cut");
  if (::lseek(fd, offset, SEEK_SET) != offset) fail("cannot be continued");
}

void EventLogWriter::State::flush() {
  std::size_t done = 0;
  while (done < buffer.size()) {
    const ssize_t wrote = ::write(fd, buffer.data() + done, buffer.size() - done);
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote < 0) {
      buffer.erase(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(
                                                        done));  // what is written is not written twice
      fail("cannot be written");
    }
    done += static_cast<std::size_t>(wrote);
  }
  buffer.clear();
}

EventLogWriter::EventLogWriter(const std::string& path, LogOpen open) : state_(std::make_unique<State>()) {
  state_->path = path;
  state_->open(open);
  state_->buffer.reserve(kBufferBytes + (kBufferBytes >> 1));
}

EventLogWriter::~EventLogWriter() = default;
EventLogWriter::EventLogWriter(EventLogWriter&&) noexcept = default;
EventLogWriter& EventLogWriter::operator=(EventLogWriter&&) noexcept = default;

std::int64_t EventLogWriter::write(std::int64_t utime, std::string_view channel, Bytes data) {
  State& s = *state_;
  if (s.fd < 0) throw Error(s.path, "is closed");
  if (channel.empty() || channel.size() > static_cast<std::size_t>(kMaxChannelBytes) ||
      data.size() > static_cast<std::size_t>(kMaxEventBytes)) {
    throw Error(s.path, "an event's channel or data has a length that no log can hold");
  }
  const LogHeader header{s.number, utime, static_cast<std::int32_t>(channel.size()),
                         static_cast<std::int32_t>(data.size())};
  const auto head = make_log_header(header);
  s.buffer.insert(s.buffer.end(), head.begin(), head.end());
  s.buffer.insert(s.buffer.end(), channel.begin(), channel.end());
  s.buffer.insert(s.buffer.end(), data.begin(), data.end());
  ++s.number;
  const std::int64_t begin = s.offset;
  s.offset += header.event_bytes();
  if (s.buffer.size() >= kBufferBytes) s.flush();
  return begin;
}

void EventLogWriter::flush() { state_->flush(); }

void EventLogWriter::flush_to_disk() {
  state_->flush();
  if (::fdatasync(state_->fd) != 0) state_->fail("cannot be flushed to disk");
}

void EventLogWriter::close() {
  flush_to_disk();
  const int fd = std::exchange(state_->fd, -1);
  if (::close(fd) != 0) state_->fail("cannot be closed");
}

std::int64_t EventLogWriter::next_number() const { return state_->number; }
std::int64_t EventLogWriter::next_offset() const { return state_->offset; }
std::int64_t EventLogWriter::cut_bytes() const { return state_->cut_bytes; }

}  // namespace imrig
