#pragma once
// The emulator's loop: plant, firmware and wire, one turn at a time. Time is handed in by the caller's clock.

#include <atomic>
#include <cstdint>
#include <functional>

#include "plant/emulator/link_port.h"
#include "plant/emulator/pace.h"
#include "plant/excitation.h"
#include "plant/firmware.h"
#include "plant/plant.h"

namespace imrig::plant {

struct EmulatorCounters {
  std::int64_t missed_deadlines =
      0;  // turns that began more than kLate_us after their sample was due, in real time
  std::int64_t unsent_frames = 0;
};

class Emulator {
 public:
  static constexpr std::int64_t kLate_us = 5000;

  Emulator(Plant plant, LinkPort port, const Pace& pace, std::int64_t boot_id);

  // One turn: hears the host, keeps the watchdog, takes the samples that are due (at most 256), tells the
  // host. Returns how long there is nothing to do but listen, us (0: go on at once). now_us: monotonic.
  std::int64_t turn(std::int64_t now_us);
  // Waits for the host to say something, at most so long.
  void wait(std::int64_t us);

  void set_excitation(const ExcitationCommand& command) { plant_.set_excitation(command); }
  ExcitationReadback excitation() const { return plant_.excitation(); }
  EmulatorCounters counters() const;

 private:
  int take_samples(int most);
  void count_lateness(std::int64_t now_us);

  Plant plant_;
  LinkPort port_;
  Pace pace_;
  PaceClock clock_;
  Firmware firmware_;
  bool started_ = false;
  EmulatorCounters counters_;
};

}  // namespace imrig::plant
