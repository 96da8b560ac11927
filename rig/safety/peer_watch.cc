#include "rig/safety/peer_watch.h"

namespace imrig {

using imrig_msg::heartbeat_t;

PeerWatch::PeerWatch(std::int32_t peer, std::int64_t silence_us) : peer_(peer), silence_us_(silence_us) {}

void PeerWatch::on_heartbeat(const heartbeat_t& heartbeat, Moment now) {
  if (heartbeat.process != peer_ || heartbeat.instance == 0) return;
  if (!in_time(heartbeat.host_utime, silence_us_ / 1000, now)) return;
  if (heartbeat.instance == instance_ && heartbeat.seq <= seq_) return;
  if (instance_ != 0 && heartbeat.instance != instance_) restarted_ = true;
  instance_ = heartbeat.instance;
  seq_ = heartbeat.seq;
  state_ = heartbeat.state;
  heard_us_ = now.steady_us;
  leaving_ = heartbeat.state == heartbeat_t::STOPPING;
}

Trip PeerWatch::check(Moment now, bool active, bool required) {
  if (!active) {
    restarted_ = false;
    if (leaving_) *this = PeerWatch(peer_, silence_us_);
    return Trip::kNone;
  }
  if (!seen()) return required ? Trip::kPeerSilent : Trip::kNone;
  if (state_ == heartbeat_t::TRIPPED) return Trip::kPeerTripped;
  return leaving_ || restarted_ || silent(now) ? Trip::kPeerSilent : Trip::kNone;
}

bool PeerWatch::silent(Moment now) const { return seen() && now.steady_us - heard_us_ >= silence_us_; }

void PeerWatch::forget_if_silent(Moment now) {
  if (silent(now)) *this = PeerWatch(peer_, silence_us_);
}

}  // namespace imrig
