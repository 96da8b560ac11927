#pragma once
// The other actuator's heartbeat, as bridge and dyno watch it.
//
// A peer counts once it has been seen. From then on, while we are active (motor driven, excitation on), its
// trip, its silence, its goodbye and its restart stop us. While we are not active nothing about it stops us,
// so the two can be reset in any order; a peer that says goodbye then is forgotten. A heartbeat that is old,
// from the future or repeated (a replayed log) is no sign of life.

#include <cstdint>
#include <imrig_msg/heartbeat_t.hpp>

#include "rig/safety/moment.h"
#include "rig/safety/trip.h"

namespace imrig {

class PeerWatch {
 public:
  // peer: heartbeat_t::DYNO in the bridge, heartbeat_t::BRIDGE in the dyno. silence_us:
  // LimitsConfig::peer_silence_ms * 1000.
  PeerWatch(std::int32_t peer, std::int64_t silence_us);

  // Every heartbeat of the bus; those of other processes are passed over.
  void on_heartbeat(const imrig_msg::heartbeat_t& heartbeat, Moment now);

  // active: the motor is driven or the excitation is on, or is about to be. required: a peer that was never
  // seen counts as silent. Returns kNone, kPeerTripped or kPeerSilent; kNone whenever not active.
  Trip check(Moment now, bool active, bool required = false);

  // A silent peer is forgotten, as if never seen: what an explicit reset does, so that a rig can go on
  // without it.
  void forget_if_silent(Moment now);

  bool seen() const { return instance_ != 0; }
  bool silent(Moment now) const;                 // seen, and then not heard for the silence time
  std::int32_t state() const { return state_; }  // heartbeat_t's constant, of the last one

 private:
  std::int32_t peer_;
  std::int64_t silence_us_;
  std::int64_t instance_ = 0;  // 0: not seen
  std::int64_t seq_ = 0;
  std::int32_t state_ = 0;
  std::int64_t heard_us_ = 0;  // steady
  bool leaving_ = false;
  bool restarted_ = false;  // since the last check while not active
};

}  // namespace imrig
