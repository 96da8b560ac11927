#pragma once
// Messages to an event log on a thread of its own, so that no disk holds up the bus. The queue between them
// grows up to a memory limit; beyond it messages are dropped and counted. A write that fails (disk full) is
// tried again until it succeeds or the writer is finished. The log is flushed to disk at each end of a
// record, and to the operating system whenever the queue is empty.

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "rig/bus/event_log.h"
#include "rig/recorder/log_index.h"

namespace imrig {

class DiskWriter {
 public:
  // Throws Error as EventLogWriter does; appending reads the log's events into the index first.
  DiskWriter(const std::string& path, const std::string& prefix, bool append, std::size_t memory_limit_bytes);
  ~DiskWriter();
  DiskWriter(const DiskWriter&) = delete;
  DiskWriter& operator=(const DiskWriter&) = delete;

  // From one thread. False when the memory limit is reached: the message is dropped.
  bool push(std::int64_t utime, std::string_view channel, Bytes data);

  std::size_t waiting_bytes() const { return waiting_bytes_; }
  std::int64_t dropped() const { return dropped_; }
  std::int32_t flushed_record() const {
    return flushed_record_;
  }                                                      // number of the last RECORD END on disk; 0 none
  std::int64_t cut_bytes() const { return cut_bytes_; }  // torn tail that appending cut off
  std::string failure() const;                           // why writing fails at present; empty: it does not

  // Writes what waits and closes the log. False when that fails: failure() says why. Then index() and bytes()
  // may be used.
  bool finish();
  const LogIndex& index() const { return index_; }
  std::int64_t bytes() const { return bytes_; }

 private:
  struct Item {
    std::int64_t utime = 0;
    std::string channel;
    std::vector<std::uint8_t> data;
    std::size_t cost() const { return sizeof(Item) + channel.size() + data.size(); }
  };

  void run();
  bool write(const Item& item);
  bool insist(bool to_disk);
  void set_failure(const std::string& text);

  LogIndex index_;
  EventLogWriter log_;
  std::size_t limit_;
  std::int64_t cut_bytes_ = 0;
  std::int64_t bytes_ = 0;

  std::mutex mutable mutex_;
  std::condition_variable changed_;
  std::deque<Item> queue_;
  bool finishing_ = false;
  std::string failure_;
  bool closed_well_ = false;

  std::atomic<std::size_t> waiting_bytes_ = 0;
  std::atomic<std::int64_t> dropped_ = 0;
  std::atomic<std::int32_t> flushed_record_ = 0;
  std::thread thread_;  // last: starts when everything else is there
};

}  // namespace imrig
