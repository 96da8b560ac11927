#pragma once
// DIR/journal.jsonl: what a campaign has done, one JSON object a line, appended and flushed to disk line by
// line.
//
// A point is finished when its RECORD END (complete) is in the event log on disk and its line is in the
// journal, in this order: the END is published, the recorder writes it and flushes it to disk and says so,
// then the journal's line is written and flushed. A crash between the two leaves an END without a line;
// --resume finds it in the log and writes the missing line ("recovered"), so nothing is recorded twice. A
// line whose END is missing (a disk that lied) is withdrawn, and the point is run again.

#include <cstdint>
#include <set>
#include <string>
#include <vector>

namespace imrig {

struct JournalIdentity {
  std::string plan;  // its name
  std::uint64_t plan_hash = 0;
  std::uint64_t rig_hash = 0;    // measurement_hash of the rig's configuration
  std::uint64_t plant_hash = 0;  // of the emulated plant's file; 0 on hardware
  int points = 0;
};

struct DonePoint {
  std::string id;
  int number = 0;  // record number in the log
  int part = 0;    // log-000.lcm is part 0
  std::int64_t samples = 0;
};

// What an existing journal says.
struct JournalState {
  JournalIdentity identity;
  std::vector<DonePoint> done;   // withdrawn ones left out
  int highest_number = 0;        // highest record number ever begun
  std::int64_t whole_bytes = 0;  // length up to and including the last whole line
  bool began =
      false;  // its start line is whole; if not, nothing was ever done: remove the file and begin anew
  bool torn = false;  // an unfinished last line was found and is to be cut off
};

std::string journal_path(const std::string& folder);
std::string log_part_path(const std::string& folder, int part);
// How many parts there are; the next one has this number. A part may be there without a line in the journal:
// a crash between the two.
int count_log_parts(const std::string& folder);
bool has_journal(const std::string& folder);

// Throws Error: unreadable, or a bad line that is not the last.
JournalState read_journal(const std::string& folder);
// Throws Error in one sentence when a plan, rig or plant has changed since the campaign began.
void require_same(const JournalIdentity& then, const JournalIdentity& now, const std::string& folder);

class Journal {
 public:
  // Begins a new journal (folder must exist, no journal in it), or goes on with one: cuts the torn tail,
  // notes the new log part.
  static Journal begin(const std::string& folder, const JournalIdentity& identity, int part = 0);
  static Journal resume(const std::string& folder, const JournalState& state, int part);
  Journal(Journal&& other) noexcept;
  Journal& operator=(Journal&&) = delete;
  ~Journal();

  // Each line is on the disk when the call returns. Throws Error when it cannot be written.
  void record_begun(const std::string& id, int number);
  void point_done(const DonePoint& point, bool recovered = false);
  void point_withdrawn(const std::string& id, const std::string& why);
  void point_retried(const std::string& id, int attempt, const std::string& why);
  void point_failed(const std::string& id, const std::string& why);
  void ended(const std::string& how, const std::string& why);  // "done", "stopped", "tripped", "failed"

  int part() const { return part_; }

 private:
  Journal(int fd, int part) : fd_(fd), part_(part) {}
  void write_line(const std::string& line);
  int fd_ = -1;
  int part_ = 0;
};

}  // namespace imrig
