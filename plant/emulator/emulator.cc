#include "plant/emulator/emulator.h"

#include <algorithm>
#include <utility>

namespace imrig::plant {

namespace {
constexpr int kBatch = 256;                    // samples a turn: 15 ms of 60 us
constexpr std::int64_t kNobody_us = 100'000;   // nobody has said hello yet
constexpr std::int64_t kNoCredit_us = 10'000;  // the watchdog must be looked after
constexpr std::int64_t kSleep_us = 1'000;      // in real time samples are taken about once a millisecond
}  // namespace

Emulator::Emulator(Plant plant, LinkPort port, const Pace& pace, std::int64_t boot_id)
    : plant_(std::move(plant)),
      port_(std::move(port)),
      pace_(pace),
      clock_(pace, plant_.sample_time_ns()),
      firmware_(plant_, boot_id, pace.waits_for_credit()) {}

int Emulator::take_samples(int most) {
  int taken = 0;
  for (; taken < most && firmware_.may_sample(); ++taken) {
    firmware_.sample(plant_.step(firmware_.command()));
    if (firmware_.has_output()) port_.send(firmware_);
  }
  return taken;
}

void Emulator::count_lateness(std::int64_t now_us) {
  if (pace_.kind == Pace::Kind::kRealtime && now_us - clock_.due_us(firmware_.next_index()) > kLate_us) {
    ++counters_.missed_deadlines;
  }
}

std::int64_t Emulator::turn(std::int64_t now_us) {
  port_.receive(firmware_, now_us / 1000);
  firmware_.tick(now_us / 1000);
  if (!firmware_.welcomed()) return kNobody_us;
  if (!started_) {
    started_ = true;
    clock_.start(now_us, firmware_.next_index());
  }
  count_lateness(now_us);
  const int due = clock_.due(now_us, firmware_.next_index(), kBatch);
  const int taken = take_samples(due);
  port_.send(firmware_);
  if (due > 0 && !firmware_.may_sample()) {
    clock_.waited(now_us, firmware_.next_index());
    return kNoCredit_us;
  }
  if (taken == kBatch) return 0;
  return std::max(clock_.due_us(firmware_.next_index()) - now_us, kSleep_us);
}

void Emulator::wait(std::int64_t us) {
  if (us > 0) port_.wait(static_cast<int>((us + 999) / 1000));
}

EmulatorCounters Emulator::counters() const {
  EmulatorCounters counters = counters_;
  counters.unsent_frames = port_.unsent_frames();
  return counters;
}

}  // namespace imrig::plant
