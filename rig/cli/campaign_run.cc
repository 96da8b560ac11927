#include "rig/cli/campaign_run.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "rig/base/clock.h"
#include "rig/base/error.h"
#include "rig/base/file.h"
#include "rig/base/stop_signal.h"
#include "rig/campaign/log_scan.h"
#include "rig/campaign/session.h"
#include "rig/cli/campaign_check.h"
#include "rig/cli/supervisor/rig_processes.h"

namespace imrig {

namespace {

namespace fs = std::filesystem;

// The rig's configuration without the addresses of its wires: a private rig draws new ports each time.
std::uint64_t measurement_hash(RigConfig rig) {
  const RigConfig usual;
  rig.bus = usual.bus;
  rig.bridge.link = usual.bridge.link;
  rig.dyno.link = usual.dyno.link;
  return fnv1a64(to_toml(rig));
}

// A folder that is left as it was found unless keep() is called.
class FreshFolder {
 public:
  FreshFolder(const std::string& path, bool fresh) : path_(path), fresh_(fresh) {
    existed_ = fs::exists(path);
    if (existed_ && !fs::is_directory(path)) throw Error(path, "is a file", "--out takes a folder");
    if (fresh_ && existed_ && !fs::is_empty(path))
      throw Error(path, has_journal(path) ? "holds a campaign's journal already" : "is not empty",
                  has_journal(path) ? "go on with --resume, or take another folder"
                                    : "take an empty or a new folder");
    std::error_code failed;
    fs::create_directories(path_ + "/processes", failed);
    if (failed) throw Error(path_, "cannot be made: " + failed.message());
  }
  ~FreshFolder() {
    if (kept_ || !fresh_) return;
    std::error_code ignored;
    if (!existed_) {
      fs::remove_all(path_, ignored);
      return;
    }
    for (const auto& entry : fs::directory_iterator(path_, ignored)) fs::remove_all(entry.path(), ignored);
  }
  void keep() { kept_ = true; }
  void discard() { kept_ = false; }

 private:
  std::string path_;
  bool fresh_;
  bool existed_ = false;
  bool kept_ = false;
};

// What earlier runs have left, brought to agreement: journal and logs.
struct Past {
  JournalState state;
  std::vector<DonePoint> recovered;    // whole in a log, not in the journal
  std::vector<std::string> withdrawn;  // in the journal, not whole in a log
  int highest_number = 0;

  bool done(const std::string& id) const {
    const auto is = [&](const DonePoint& p) { return p.id == id; };
    return std::any_of(state.done.begin(), state.done.end(), is) ||
           std::any_of(recovered.begin(), recovered.end(), is);
  }
};

Past read_past(const std::string& folder, const std::string& prefix) {
  Past past;
  past.state = read_journal(folder);
  if (!past.state.began) return past;
  const LogScan scan = scan_log_parts(folder, prefix);
  past.highest_number = std::max(scan.highest_number, past.state.highest_number);
  const auto in = [](const std::vector<DonePoint>& list, const std::string& id) {
    return std::any_of(list.begin(), list.end(), [&](const DonePoint& p) { return p.id == id; });
  };
  for (const DonePoint& p : scan.whole)
    if (!in(past.state.done, p.id)) past.recovered.push_back(p);
  for (const DonePoint& p : past.state.done)
    if (!in(scan.whole, p.id)) past.withdrawn.push_back(p.id);
  std::erase_if(past.state.done, [&](const DonePoint& p) { return !in(scan.whole, p.id); });
  return past;
}

class Progress {
 public:
  explicit Progress(int total) : total_(total), terminal_(::isatty(STDERR_FILENO) != 0) {}
  void operator()(const Runner& runner) {
    if (!terminal_) return;
    const int done = runner.tally().done;
    std::fprintf(stderr, "\r\033[Kpoint %d of %d  %s", std::min(done + 1, total_), total_,
                 runner.point_id().c_str());
    std::fflush(stderr);
    shown_ = true;
  }
  void operator()(const RunnerEvent& event) {
    if (event.kind != RunnerEvent::kPointRetried && event.kind != RunnerEvent::kPointFailed) return;
    clear();
    const char* word = event.kind == RunnerEvent::kPointFailed ? "given up" : "again";
    std::fprintf(stderr, "%s %s: %s\n", event.id.c_str(), word, event.text.c_str());
  }
  void clear() {
    if (shown_) std::fputs("\r\033[K", stderr);
    shown_ = false;
  }

 private:
  int total_;
  bool terminal_;
  bool shown_ = false;
};

class Campaign {
 public:
  explicit Campaign(const CampaignRequest& request) : request_(request) {
    plan_ = load_plan(request.plan_path);
    if (!request.rig_path.empty()) rig_ = load_rig_config(request.rig_path);
    if (!request.plant_path.empty()) plant_hash_ = fnv1a64(read_text(request.plant_path, 1u << 20));
    checked_ = check_plan(plan_, rig_);
    if (checked_.in_order.empty())
      throw Error(request.plan_path, "has no point that this rig can carry", "see imrig campaign check");
  }

  CampaignResult run() {
    const std::int64_t began_us = monotonic_us();
    if (request_.resume && !has_journal(request_.folder))
      throw Error(request_.folder, "holds no journal", "leave out --resume to begin a campaign there");
    if (request_.resume) past_ = read_past(request_.folder, rig_.bus.prefix);
    if (past_.state.began) require_same(past_.state.identity, identity(), request_.folder);
    FreshFolder folder(request_.folder, !request_.resume);
    part_ = count_log_parts(request_.folder);
    std::vector<CheckedPoint> left;
    for (const CheckedPoint& p : checked_.in_order)
      if (!past_.done(p.point.id)) left.push_back(p);
    CampaignResult result;
    if (left.empty()) {
      open_journal().ended("done", "");
      result.end = "done";
      result.points_done = static_cast<int>(checked_.in_order.size());
    } else {
      copy_inputs();
      measure(std::move(left), folder, result);
    }
    result.points_total = static_cast<int>(checked_.in_order.size());
    result.points_infeasible = static_cast<int>(checked_.infeasible.size());
    result.folder = request_.folder;
    result.wall_s = 1e-6 * static_cast<double>(monotonic_us() - began_us);
    return result;
  }

 private:
  JournalIdentity identity() const {
    return {plan_.name, plan_.hash, measurement_hash(rig_), plant_hash_,
            static_cast<int>(checked_.in_order.size())};
  }

  void copy_inputs() const {
    write_text_atomically(request_.folder + "/plan.toml", read_text(request_.plan_path));
    if (!request_.rig_path.empty())
      write_text_atomically(request_.folder + "/rig.toml", read_text(request_.rig_path));
  }

  Journal open_journal() {
    if (!past_.state.began) {
      fs::remove(journal_path(request_.folder));  // at most a torn first line
      return Journal::begin(request_.folder, identity(), part_);
    }
    Journal journal = Journal::resume(request_.folder, past_.state, part_);
    for (const std::string& id : past_.withdrawn)
      journal.point_withdrawn(id, "its record is not whole in the log");
    for (const DonePoint& p : past_.recovered) journal.point_done(p, true);
    return journal;
  }

  RigRequest processes() const {
    RigRequest r;
    r.folder = request_.folder + "/processes";
    r.rig = rig_;
    r.rig_path = request_.rig_path;
    r.rig_copy = request_.folder + "/rig.toml";
    r.plant_path = request_.plant_path;
    r.pace = request_.pace;
    r.seed = request_.seed;
    r.private_ports = !request_.plant_path.empty() && request_.rig_path.empty();
    r.rig_runs = request_.plant_path.empty();
    r.recorder_out = log_part_path(request_.folder, part_);
    return r;
  }

  RunnerConfig runner_config(std::vector<CheckedPoint> left, const RigProcesses& rig) const {
    RunnerConfig c;
    c.rig = rig.rig();  // with the times that its processes wait
    c.plan = plan_;
    c.config_hash =
        static_cast<std::int64_t>(fnv1a64(fmt::format("{:x} {:x}", plan_.hash, measurement_hash(rig_))));
    c.points = std::move(left);
    c.points_total = static_cast<int>(checked_.in_order.size());
    c.first_record_number = past_.highest_number + 1;
    c.first_profile_id =
        static_cast<int>(random_id() % 1'000'000) * 1000 + 1;  // no mistaking an earlier client's profile
    c.holder = random_id();
    c.instance = random_id();
    c.pid = static_cast<std::int32_t>(::getpid());
    c.recorder_pid = rig.pid_of("imrig-recorder");
    return c;
  }

  void measure(std::vector<CheckedPoint> left, FreshFolder& folder, CampaignResult& result) {
    RigProcesses rig(processes(), stop_asked);
    if (stop_asked()) {
      result.end = "stopped";
      result.reason = "stopped by the operator before it began";
      return;
    }
    const auto bus = open_lcm_bus(rig.rig().bus);
    Runner runner(runner_config(std::move(left), rig));
    Journal journal = open_journal();
    folder.keep();
    Progress progress(static_cast<int>(checked_.in_order.size()));
    SessionHooks hooks;
    hooks.stop_asked = stop_asked;
    hooks.broken = [&] { return rig.fallen(); };
    hooks.progress = [&](const Runner& r) { progress(r); };
    hooks.event = [&](const RunnerEvent& e) { progress(e); };
    const RunnerEnd end = run_session(runner, *bus, journal, hooks);
    progress.clear();
    rig.stop();
    if (end == RunnerEnd::kFailed && !runner.connected()) {  // a rig that is not there is bad input: nothing was begun
      folder.discard();
      throw Error("imrig campaign run", runner.end_reason());
    }
    result.end = end_word(end);
    result.reason = runner.end_reason();
    result.points_done = runner.tally().done;
    result.points_failed = runner.tally().failed;
    result.points_stalled = runner.tally().stalled;
    result.points_tripped = runner.tally().tripped;
    result.lost_blocks = runner.lost_blocks();
  }

  const CampaignRequest& request_;
  Plan plan_;
  RigConfig rig_;
  std::uint64_t plant_hash_ = 0;
  CheckedPlan checked_;
  Past past_;
  int part_ = 0;  // of the event log that this run writes
};

}  // namespace

CampaignResult run_campaign(const CampaignRequest& request) {
  catch_stop_signals();
  return Campaign(request).run();
}

}  // namespace imrig
