#pragma once
// The DSP's firmware in the emulator: the C99 device of rig/link/device exactly as a board would run it, with
// the plant's converters before it and the plant's inverter behind it. What the device computes from sample k
// acts from sample k+1 on, so the step that leads from sample k to k+1 still runs on the command computed
// from sample k-1.
//
// The plant's inverter has one gate signal: a DC segment with an open leg is driven with that leg at the
// middle of the other two, which carries no current in a motor at rest with equal phases.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "plant/plant.h"
#include "rig/link/device/imrig_device.h"

namespace imrig::plant {

class Firmware {
 public:
  Firmware(const Plant& plant, std::int64_t boot_id, bool waits_for_credit);

  void feed(std::span<const std::uint8_t> bytes, std::int64_t now_ms);
  void tick(std::int64_t now_ms);
  bool has_output() const;
  // The next frame, 0 bytes when there is none. buffer: at least IMRIG_FRAME_MAX bytes.
  std::size_t take(std::span<std::uint8_t> buffer);

  bool welcomed() const;            // a host has said hello
  std::int64_t host_nonce() const;  // of the host it listens to
  bool may_sample() const;          // a host is there and has granted the next sample where that matters
  std::int64_t next_index() const;

  InverterCommand command() const;    // for the plant's next step
  void sample(const RawSample& raw);  // what that step's end showed

 private:
  std::unique_ptr<imrig_device> device_;
  imrig_command acting_ = {};  // over the step that comes
  imrig_command next_ = {};    // over the step after it
};

}  // namespace imrig::plant
