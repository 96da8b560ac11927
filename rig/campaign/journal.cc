#include "rig/campaign/journal.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "rig/base/error.h"
#include "rig/base/file.h"

namespace imrig {

namespace {

using nlohmann::json;

constexpr std::size_t kMostBytes = std::size_t{1} << 28;

std::string in_hex(std::uint64_t hash) { return fmt::format("{:016x}", hash); }

// One line of an existing journal. Throws json exceptions on anything that is not as written here.
class Replay {
 public:
  explicit Replay(JournalState& state) : state_(state) {}

  void line(const json& entry, bool first) {
    const auto event = entry.at("event").get<std::string>();
    if ((event == "start") != first) throw json::other_error::create(501, "start line out of place", nullptr);
    if (event == "start") start(entry);
    if (event == "begun") number(entry);
    if (event == "point") point(entry);
    if (event == "withdrawn") withdraw(entry.at("id").get<std::string>());
  }

 private:
  void start(const json& entry) {
    if (entry.at("version").get<int>() != 1) throw json::other_error::create(501, "not version 1", nullptr);
    JournalIdentity& id = state_.identity;
    id.plan = entry.at("plan").get<std::string>();
    id.plan_hash = hash(entry, "plan_hash");
    id.rig_hash = hash(entry, "rig_hash");
    id.plant_hash = hash(entry, "plant_hash");
    id.points = entry.at("points").get<int>();
  }

  static std::uint64_t hash(const json& entry, const char* key) {
    const auto text = entry.at(key).get<std::string>();
    if (text.size() != 16 || text.find_first_not_of("0123456789abcdef") != std::string::npos)
      throw json::other_error::create(501, "bad hash", nullptr);
    return std::stoull(text, nullptr, 16);
  }

  void number(const json& entry) {
    state_.highest_number = std::max(state_.highest_number, entry.at("number").get<int>());
  }

  void point(const json& entry) {
    DonePoint done;
    done.id = entry.at("id").get<std::string>();
    done.number = entry.at("number").get<int>();
    done.part = entry.at("part").get<int>();
    done.samples = entry.at("samples").get<std::int64_t>();
    withdraw(done.id);
    number(entry);
    state_.done.push_back(done);
  }

  void withdraw(const std::string& id) {
    std::erase_if(state_.done, [&](const DonePoint& p) { return p.id == id; });
  }

  JournalState& state_;
};

int open_for_append(const std::string& path, int flags) {
  const int fd = ::open(path.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC | flags, 0644);
  if (fd < 0) throw Error(path, std::string("cannot be written: ") + std::strerror(errno));
  return fd;
}

}  // namespace

std::string journal_path(const std::string& folder) { return folder + "/journal.jsonl"; }
std::string log_part_path(const std::string& folder, int part) {
  return fmt::format("{}/log-{:03}.lcm", folder, part);
}
int count_log_parts(const std::string& folder) {
  int part = 0;
  while (std::filesystem::exists(log_part_path(folder, part))) ++part;
  return part;
}
bool has_journal(const std::string& folder) { return std::filesystem::exists(journal_path(folder)); }

JournalState read_journal(const std::string& folder) {
  const std::string path = journal_path(folder);
  const std::string text = read_text(path, kMostBytes);
  JournalState state;
  Replay replay(state);
  int line = 0;
  for (std::size_t at = 0; at < text.size(); ++line) {
    const std::size_t end = text.find('\n', at);
    if (end == std::string::npos) {  // a line is whole once its newline is there
      state.torn = true;
      break;
    }
    try {
      replay.line(json::parse(text.begin() + static_cast<std::ptrdiff_t>(at),
                              text.begin() + static_cast<std::ptrdiff_t>(end)),
                  line == 0);
    } catch (const json::exception&) {
      throw Error(fmt::format("{}:{}", path, line + 1), "is no line of a campaign's journal",
                  "only the last line may be unfinished; take another folder");
    }
    at = end + 1;
    state.whole_bytes = static_cast<std::int64_t>(at);
  }
  state.began = state.whole_bytes > 0;
  return state;
}

void require_same(const JournalIdentity& then, const JournalIdentity& now, const std::string& folder) {
  const auto changed = [&](const std::string& what) {
    throw Error(folder, what + " has changed since this campaign began",
                "resume with the copies in the folder, or run into another folder");
  };
  if (then.plan_hash != now.plan_hash || then.plan != now.plan) changed("the plan");
  if (then.rig_hash != now.rig_hash) changed("the rig's configuration");
  if (then.plant_hash != now.plant_hash) changed("the plant");
  if (then.points != now.points) changed("the number of feasible points");
}

Journal Journal::begin(const std::string& folder, const JournalIdentity& id, int part) {
  Journal journal(open_for_append(journal_path(folder), O_CREAT | O_EXCL), part);
  journal.write_line(json{
      {"event", "start"},
      {"version", 1},
      {"plan", id.plan},
      {"plan_hash", in_hex(id.plan_hash)},
      {"rig_hash", in_hex(id.rig_hash)},
      {"plant_hash", in_hex(id.plant_hash)},
      {"points", id.points},
      {"part", part}}.dump());
  flush_folder(folder);
  return journal;
}

Journal Journal::resume(const std::string& folder, const JournalState& state, int part) {
  Journal journal(open_for_append(journal_path(folder), 0), part);
  if (::ftruncate(journal.fd_, state.whole_bytes) != 0)
    throw Error(journal_path(folder),
                std::string("cannot be cut to its last whole line: ") + std::strerror(errno));
  journal.write_line(json{{"event", "resume"}, {"part", journal.part_}}.dump());
  return journal;
}

Journal::Journal(Journal&& other) noexcept : fd_(other.fd_), part_(other.part_) { other.fd_ = -1; }

Journal::~Journal() {
  if (fd_ >= 0) ::close(fd_);
}

void Journal::write_line(const std::string& line) {
  const std::string text = line + "\n";
  std::size_t done = 0;
  while (done < text.size()) {
    const ssize_t wrote = ::write(fd_, text.data() + done, text.size() - done);
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote < 0) throw Error("journal.jsonl", std::string("cannot be written: ") + std::strerror(errno));
    done += static_cast<std::size_t>(wrote);
  }
  if (::fdatasync(fd_) != 0)
    throw Error("journal.jsonl", std::string("cannot be flushed to disk: ") + std::strerror(errno));
}

void Journal::record_begun(const std::string& id, int number) {
  write_line(json{{"event", "begun"}, {"id", id}, {"number", number}, {"part", part_}}.dump());
}

void Journal::point_done(const DonePoint& point, bool recovered) {
  json entry{{"event", "point"},
             {"id", point.id},
             {"number", point.number},
             {"part", point.part},
             {"samples", point.samples}};
  if (recovered) entry["recovered"] = true;
  write_line(entry.dump());
}

void Journal::point_withdrawn(const std::string& id, const std::string& why) {
  write_line(json{{"event", "withdrawn"}, {"id", id}, {"why", why}}.dump());
}

void Journal::point_retried(const std::string& id, int attempt, const std::string& why) {
  write_line(json{{"event", "retried"}, {"id", id}, {"attempt", attempt}, {"why", why}}.dump());
}

void Journal::point_failed(const std::string& id, const std::string& why) {
  write_line(json{{"event", "failed"}, {"id", id}, {"why", why}}.dump());
}

void Journal::ended(const std::string& how, const std::string& why) {
  write_line(json{{"event", "ended"}, {"how", how}, {"why", why}}.dump());
}

}  // namespace imrig
