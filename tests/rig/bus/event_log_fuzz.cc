// Whatever a file holds, reading it ends, stays inside it and accounts for every byte; what makes records of
// it does not fall over either.

#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

#include "rig/base/error.h"
#include "rig/base/file.h"
#include "rig/bus/event_log.h"
#include "rig/bus/log_records.h"
#include "tests/rig/bus/messages.h"

using namespace imrig;

namespace {

// A file in memory: a disk would be the slowest part by far.
int memory_file() {
  static const int fd = ::memfd_create("imrig_fuzz", 0);
  return fd;
}

const std::string& path() {
  static const std::string name = "/proc/self/fd/" + std::to_string(memory_file());
  return name;
}

void check_reader(std::size_t size) {
  EventLogReader log(path());
  LogEvent event;
  std::int64_t bytes = 0;
  while (log.next(event)) bytes += static_cast<std::int64_t>(28 + event.channel.size() + event.data.size());
  if (bytes + log.garbage_bytes() + log.torn_bytes() != static_cast<std::int64_t>(size)) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (::ftruncate(memory_file(), 0) != 0) std::abort();
  if (::pwrite(memory_file(), data, size, 0) != static_cast<ssize_t>(size)) std::abort();
  try {
    check_reader(size);
    read_log(path());
  } catch (const Error&) {  // the right answer to most of it
  }
  return 0;
}

std::vector<std::vector<std::uint8_t>> fuzz_corpus() {
  using namespace imrig::test;
  EventLogWriter log(path(), LogOpen::kReplace);
  imrig_msg::record_t mark = record();
  imrig_msg::samples_t block = samples(20);
  block.record = 1;
  log.write(1, "IMRIG_DATASET", encoded(dataset()));
  log.write(2, "IMRIG_RECORD", encoded(mark));
  for (int k = 0; k < 3; ++k) {
    block.first_index = 20 * k;
    log.write(3 + k, "IMRIG_SAMPLES", encoded(block));
  }
  mark.phase = imrig_msg::record_t::END;
  mark.samples = 60;
  log.write(7, "IMRIG_RECORD", encoded(mark));
  mark.phase = imrig_msg::record_t::BEGIN;
  mark.number = 2;
  mark.id = "table";
  log.write(8, "IMRIG_RECORD", encoded(mark));
  imrig_msg::series_t rows = series(5);
  rows.number = 2;
  log.write(9, "IMRIG_SERIES", encoded(rows));
  mark.phase = imrig_msg::record_t::END;
  mark.samples = 5;
  log.write(10, "IMRIG_RECORD", encoded(mark));
  log.close();
  if (read_log(path()).records.size() != 2) std::abort();
  const std::string bytes = read_text(path());
  return {{bytes.begin(), bytes.end()}};
}
