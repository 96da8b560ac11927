#include "rig/recorder/disk_writer.h"

#include <chrono>
#include <filesystem>
#include <utility>

#include "rig/base/error.h"

namespace imrig {

namespace {

constexpr auto kTryAgain = std::chrono::milliseconds(200);

// What an existing log holds already.
LogIndex index_of(const std::string& path, const std::string& prefix, bool append) {
  LogIndex index(prefix);
  std::error_code ignored;
  if (!append || !std::filesystem::exists(path, ignored) || std::filesystem::file_size(path, ignored) == 0)
    return index;
  EventLogReader log(path);
  LogEvent event;
  while (log.next(event)) index.add(event.utime, event.channel, event.data, log.offset());
  return index;
}

}  // namespace

DiskWriter::DiskWriter(const std::string& path, const std::string& prefix, bool append,
                       std::size_t memory_limit_bytes)
    : index_(index_of(path, prefix, append)),
      log_(path, append ? LogOpen::kAppend : LogOpen::kNew),
      limit_(memory_limit_bytes),
      cut_bytes_(log_.cut_bytes()),
      thread_([this] { run(); }) {}

DiskWriter::~DiskWriter() { finish(); }

bool DiskWriter::push(std::int64_t utime, std::string_view channel, Bytes data) {
  Item item{utime, std::string(channel), {data.begin(), data.end()}};
  const std::size_t cost = item.cost();
  if (waiting_bytes_ + cost > limit_) {
    ++dropped_;
    return false;
  }
  waiting_bytes_ += cost;
  const std::lock_guard lock(mutex_);
  queue_.push_back(std::move(item));
  changed_.notify_one();
  return true;
}

std::string DiskWriter::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

void DiskWriter::set_failure(const std::string& text) {
  const std::lock_guard lock(mutex_);
  failure_ = text;
}

// Flushes until it works; false when the writer is to finish and the last try failed. What failed stays
// buffered in the log's writer.
bool DiskWriter::insist(bool to_disk) {
  for (bool last = false;;) {
    try {
      to_disk ? log_.flush_to_disk() : log_.flush();
      set_failure("");
      return true;
    } catch (const Error& e) {
      set_failure(e.what());
    }
    if (last) return false;
    std::unique_lock lock(mutex_);
    last = changed_.wait_for(lock, kTryAgain, [this] { return finishing_; });
  }
}

bool DiskWriter::write(const Item& item) {
  const std::int64_t offset = log_.next_offset();
  bool well = true;
  try {
    log_.write(item.utime, item.channel, item.data);
  } catch (const Error& e) {  // the event itself is buffered
    set_failure(e.what());
    well = insist(false);
  }
  index_.add(item.utime, item.channel, item.data, offset);
  if (const std::int32_t begun = index_.begun_record(); begun != 0 && flushed_record_ >= begun)
    flushed_record_ = 0;
  if (const std::int32_t ended = index_.ended_record(); ended != 0 && well) {
    well = insist(true);
    if (well) flushed_record_ = ended;
  }
  return well;
}

void DiskWriter::run() {
  std::deque<Item> batch;
  bool well = true;
  for (bool more = true; more && well;) {
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return finishing_ || !queue_.empty(); });
      batch.swap(queue_);
      more = !(finishing_ && batch.empty());
    }
    for (; well && !batch.empty(); batch.pop_front()) {
      well = write(batch.front());
      waiting_bytes_ -= batch.front().cost();
    }
    if (well) well = insist(false);
  }
  if (well) well = insist(true);
  closed_well_ = well;
}

bool DiskWriter::finish() {
  if (!thread_.joinable()) return closed_well_;
  {
    const std::lock_guard lock(mutex_);
    finishing_ = true;
    changed_.notify_all();
  }
  thread_.join();
  bytes_ = log_.next_offset();
  return closed_well_;
}

}  // namespace imrig
