#include "rig/dyno/supply_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace imrig {

namespace {

constexpr std::array kPolled = {Role::kSetV,   Role::kSetA,       Role::kOutV,           Role::kOutA,
                                Role::kOutput, Role::kProtection, Role::kConstantCurrent};
constexpr std::array kWritten = {Role::kSetV, Role::kSetA, Role::kOutput};
constexpr int kMaxBlock = 125;
constexpr int kUnequalPolls = 2;                      // then the registers do not hold what was written
constexpr std::int64_t kRewriteEvery_us = 1'000'000;  // set-points may live in memory that wears

}  // namespace

SupplySession::SupplySession(ModbusWire& wire, const RegisterMap& map) : wire_(wire), map_(map) {
  plan_blocks();
}

// Registers next to each other are read in one request.
void SupplySession::plan_blocks() {
  std::vector<Block> all;
  for (const Role role : kPolled) {
    if (const Register* r = map_.find(role)) all.push_back({r->address, r->words()});
  }
  std::ranges::sort(all, {}, &Block::address);
  for (const Block& next : all) {
    const bool joins = !blocks_.empty() && blocks_.back().address + blocks_.back().count == next.address &&
                       blocks_.back().count + next.count <= kMaxBlock;
    if (joins) {
      blocks_.back().count += next.count;
    } else {
      blocks_.push_back(next);
    }
  }
}

bool SupplySession::lost(const std::string& what) {
  trouble_ = fmt::format("{}: {}", what, wire_.last_error());
  return false;
}

bool SupplySession::read_all() {
  for (const Block& block : blocks_) {
    std::array<std::uint16_t, kMaxBlock> words{};
    const auto n = static_cast<std::size_t>(block.count);
    if (wire_.read(block.address, std::span(words).first(n)) != WireResult::kDone) {
      return lost(fmt::format("reading register {}", block.address));
    }
    for (std::size_t i = 0; i < n; ++i) held_[block.address + static_cast<int>(i)] = words[i];
  }
  return true;
}

SessionResult SupplySession::check_identity() {
  const Register* identity = map_.find(Role::kIdentity);
  if (identity == nullptr) return SessionResult::kDone;
  for (int attempt = 0; attempt < 2; ++attempt) {
    std::array<std::uint16_t, 2> words{};
    if (wire_.read(identity->address, std::span(words).first(static_cast<std::size_t>(identity->words()))) !=
        WireResult::kDone) {
      lost("reading the identity");
      return SessionResult::kLost;
    }
    const auto found = static_cast<long long>(identity->decode(words.data()));
    if (std::ranges::find(map_.identities, found) != map_.identities.end()) return SessionResult::kDone;
    trouble_ = fmt::format("another device answers: identity {} is no {}", found, map_.name);
  }
  return SessionResult::kWrongDevice;
}

bool SupplySession::arm_watchdog() {
  const Register* enable = map_.find(Role::kWatchdogEnable);
  const Register* seconds = map_.find(Role::kWatchdogSeconds);
  if (enable == nullptr) return true;
  if (seconds != nullptr && !write_at(seconds->address, seconds->encode(map_.watchdog_s))) return false;
  return write_at(enable->address, enable->encode(1.0));
}

SessionResult SupplySession::begin() {
  held_.clear();
  taken_ = true;
  unequal_polls_ = 0;
  if (const SessionResult identity = check_identity(); identity != SessionResult::kDone) return identity;
  if (!arm_watchdog() || !taken_ || !read_all()) return SessionResult::kLost;
  if (written_.empty()) take_what_is_held();
  return SessionResult::kDone;
}

void SupplySession::take_what_is_held() {
  for (const Role role : kWritten) {
    if (const Register* r = map_.find(role)) {
      for (int i = 0; i < r->words(); ++i) written_[role].push_back(held_[r->address + i]);
    }
  }
}

SupplySession::Words SupplySession::wanted(Role role, double value) const {
  const Register* r = map_.find(role);
  return r == nullptr ? Words{} : r->encode(value);
}

bool SupplySession::differs(Role role, const Words& words) const {
  const auto found = written_.find(role);
  return found != written_.end() && found->second != words;
}

// True unless the connection is lost; what the supply does not take is noted.
bool SupplySession::write_at(int address, const Words& words) {
  const WireResult result = wire_.write(address, words);
  if (result == WireResult::kLost) return lost(fmt::format("writing register {}", address));
  Words back(words.size());
  if (result == WireResult::kDone && wire_.read(address, back) != WireResult::kDone) {
    return lost(fmt::format("reading back register {}", address));
  }
  if (result == WireResult::kRefused || back != words) {
    taken_ = false;
    trouble_ = fmt::format("register {} does not take what is written", address);
  }
  return true;
}

bool SupplySession::write_one(Role role, const Words& words) {
  if (!differs(role, words)) return true;
  written_[role]
      .clear();  // not known until the write is through: after a lost connection it is written again
  if (!write_at(map_.find(role)->address, words)) return false;
  written_[role] = words;
  return true;
}

// Neighbours go in one request, so that voltage and current change together; else the one that falls goes
// first.
bool SupplySession::write_setpoints(const Words& volts, const Words& amps) {
  const Register* v = map_.find(Role::kSetV);
  const Register* a = map_.find(Role::kSetA);
  const bool both = differs(Role::kSetV, volts) && differs(Role::kSetA, amps);
  if (both && v->address + v->words() == a->address) {
    Words joined = volts;
    joined.insert(joined.end(), amps.begin(), amps.end());
    written_[Role::kSetV].clear();
    written_[Role::kSetA].clear();
    if (!write_at(v->address, joined)) return false;
    written_[Role::kSetV] = volts;
    written_[Role::kSetA] = amps;
    return true;
  }
  const bool amps_fall = both && a->decode(amps.data()) < value(Role::kSetA, 0.0);
  if (amps_fall) return write_one(Role::kSetA, amps) && write_one(Role::kSetV, volts);
  return write_one(Role::kSetV, volts) && write_one(Role::kSetA, amps);
}

// On: set-points first. Off: the output first.
bool SupplySession::write_changes(const SupplyOrder& order) {
  const Words output = wanted(Role::kOutput, order.output_on ? 1.0 : 0.0);
  if (!order.output_on && !write_one(Role::kOutput, output)) return false;
  if (!write_setpoints(wanted(Role::kSetV, order.set_V), wanted(Role::kSetA, order.set_A))) return false;
  return write_one(Role::kOutput, output);
}

bool SupplySession::holds(Role role, const Words& words) const {
  const int address = map_.find(role)->address;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (held_.at(address + static_cast<int>(i)) != words[i]) return false;
  }
  return true;
}

void SupplySession::judge(std::int64_t now_us) {
  const bool equal =
      std::ranges::all_of(written_, [this](const auto& w) { return holds(w.first, w.second); });
  unequal_polls_ = equal ? 0 : taken_ ? unequal_polls_ + 1 : std::max(unequal_polls_ + 1, kUnequalPolls);
  if (unequal_polls_ >= kUnequalPolls && now_us - rewritten_us_ >= kRewriteEvery_us) {
    rewritten_us_ = now_us;
    note_what_is_held();
  }
}

// Registers that lastingly differ from what was written are written anew with the next order. An output that
// went off is not: the supply may have had its reason, and to switch on again is the core's to decide.
void SupplySession::note_what_is_held() {
  for (auto& [role, words] : written_) {
    const Register& r = *map_.find(role);
    if (role == Role::kOutput && value(Role::kOutput, 0.0) == 0.0) continue;
    words.assign(static_cast<std::size_t>(r.words()), 0);
    for (int i = 0; i < r.words(); ++i) words[static_cast<std::size_t>(i)] = held_.at(r.address + i);
  }
}

double SupplySession::value(Role role, double fallback) const {
  const Register* r = map_.find(role);
  if (r == nullptr) return fallback;
  std::array<std::uint16_t, 2> words{};
  for (int i = 0; i < r->words(); ++i) words[static_cast<std::size_t>(i)] = held_.at(r->address + i);
  return r->decode(words.data());
}

SessionResult SupplySession::exchange(const SupplyOrder& order, std::int64_t now_us, SupplyReport& report) {
  taken_ = true;
  if (!write_changes(order) || !read_all()) return SessionResult::kLost;
  judge(now_us);
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  report.mismatch = unequal_polls_ >= kUnequalPolls;
  report.held_V = value(Role::kSetV, 0.0);
  report.held_A = value(Role::kSetA, 0.0);
  report.out_V = value(Role::kOutV, kNone);
  report.out_A = value(Role::kOutA, kNone);
  report.output_on = value(Role::kOutput, 0.0) != 0.0;
  report.protection = static_cast<std::int64_t>(value(Role::kProtection, 0.0));
  report.constant_current = value(Role::kConstantCurrent, 0.0) != 0.0;
  report.as_written = unequal_polls_ == 0;
  report.order_number = order.number;
  return SessionResult::kDone;
}

}  // namespace imrig
