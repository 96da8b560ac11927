#include "rig/campaign/rig_view.h"

#include "rig/safety/trip.h"

namespace imrig {

using imrig_msg::bridge_status_t;
using imrig_msg::dyno_status_t;

namespace {

constexpr std::int64_t kStatusSilence_us = 3'000'000;
constexpr std::int64_t kRecorderSilence_us = 10'000'000;  // a slow disk is no fault

}  // namespace

std::int32_t RigView::trip() const {
  const std::int32_t b = bridge ? bridge->trip : 0;
  const std::int32_t d = dyno ? dyno->trip : 0;
  const bool follows = b == static_cast<std::int32_t>(Trip::kPeerTripped) && d != 0;
  return b != 0 && !follows ? b : d;
}

std::string RigView::missing() const {
  if (!bridge) return "imrig-bridge does not answer on the bus; start the rig with imrig up";
  if (bridge->link_state != bridge_status_t::LINK_UP || !watch.seen()) return "no DSP answers imrig-bridge";
  if (needs_dyno && !dyno) return "imrig-dyno does not answer on the bus; start the rig with imrig up";
  if (needs_dyno && dyno->link_state != dyno_status_t::LINK_UP)
    return "no excitation supply answers imrig-dyno";
  if (needs_recorder && !recorder) return "imrig-recorder does not acknowledge samples";
  return "";
}

std::string RigView::failed(std::int64_t now_us) const {
  if (now_us - bridge_us > kStatusSilence_us) return "imrig-bridge is silent";
  if (needs_dyno && now_us - dyno_us > kStatusSilence_us) return "imrig-dyno is silent";
  if (needs_recorder && now_us - recorder_us > kRecorderSilence_us) return "imrig-recorder is silent";
  if (bridge->link_state != bridge_status_t::LINK_UP) return "the DSP link is down";
  if (needs_dyno && dyno->link_state == dyno_status_t::LINK_ABSENT) return "the excitation supply is gone";
  if (watch.rebooted()) return "the DSP restarted";
  return "";
}

}  // namespace imrig
