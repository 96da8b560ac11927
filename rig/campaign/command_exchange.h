#pragma once
// One command on its way to bridge or dyno: sent, sent again with a new sequence when no answer comes or the
// refusal is a passing one (busy, stale), given up after a few tries.

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "rig/safety/command_result.h"
#include "rig/safety/lease_client.h"
#include "rig/safety/moment.h"

namespace imrig {

inline bool passing_refusal(CommandResult result) {
  return result == CommandResult::kBusy || result == CommandResult::kStale ||
         result == CommandResult::kNotNew;
}

inline std::string refusal_sentence(std::int32_t result) {
  if (result >= static_cast<std::int32_t>(CommandResult::kDeviceBase))
    return "refused by the device (code " +
           std::to_string(result - static_cast<std::int32_t>(CommandResult::kDeviceBase)) + ")";
  return std::string(result_name(static_cast<CommandResult>(result)));
}

template <class Command, class Status>
class CommandExchange {
 public:
  static constexpr std::int64_t kAnswer_us =
      1'500'000;                                     // steady time until an unanswered command is sent again
  static constexpr std::int64_t kPause_us = 50'000;  // after a passing refusal
  static constexpr int kTries = 6;

  void ask(const Command& command) {
    forget();
    wanted_ = command;
  }
  void forget() { *this = CommandExchange{}; }

  bool busy() const { return wanted_.has_value(); }
  const std::string& error() const { return error_; }  // of the last command; empty when it was carried out

  // What to publish now, if anything.
  std::optional<Command> step(LeaseClient& lease, Moment now) {
    if (!wanted_ || now.steady_us < not_before_us_) return std::nullopt;
    if (sent_us_ >= 0 && now.steady_us - sent_us_ < kAnswer_us) return std::nullopt;
    if (tries_ >= kTries) {
      wanted_.reset();
      if (error_.empty()) error_ = "no answer";
      return std::nullopt;
    }
    ++tries_;
    sent_us_ = now.steady_us;
    lease.sign(*wanted_, now);
    return wanted_;
  }

  void answer(const Status& status, Moment now) {
    if (!wanted_ || sent_us_ < 0) return;
    if (status.last_cmd_epoch != wanted_->lease_epoch || status.last_cmd_seq != wanted_->seq) return;
    const auto result = static_cast<CommandResult>(status.last_cmd_result);
    if (result == CommandResult::kPending) return;
    if (result == CommandResult::kDone) return forget();
    error_ = refusal_sentence(status.last_cmd_result);
    if (!passing_refusal(result)) return wanted_.reset();
    sent_us_ = -1;
    not_before_us_ = now.steady_us + kPause_us;
  }

 private:
  std::optional<Command> wanted_;
  std::int64_t sent_us_ = -1;
  std::int64_t not_before_us_ = 0;
  int tries_ = 0;
  std::string error_;
};

}  // namespace imrig
