#include "rig/recorder/stream_watch.h"

#include <array>
#include <imrig_msg/ack_t.hpp>
#include <imrig_msg/heartbeat_t.hpp>
#include <imrig_msg/samples_t.hpp>

#include "rig/bus/channels.h"
#include "rig/bus/guarded_decode.h"

namespace imrig {

namespace {

constexpr char kCampaign[] = "campaign";
constexpr std::int64_t kLateAtMost = 64;         // further back, the sender has begun anew
constexpr std::int64_t kJumpAtMost = 100000000;  // further on, likewise

// utime and seq follow the fingerprint in every type.
std::optional<std::int64_t> seq_of(Bytes data) {
  constexpr std::size_t kSeqAt = 16;
  if (data.size() < kSeqAt + 8) return std::nullopt;
  std::uint64_t seq = 0;
  for (std::size_t k = kSeqAt; k < kSeqAt + 8; ++k) seq = (seq << 8) | data[k];
  return static_cast<std::int64_t>(seq);
}

std::string sender(std::string_view name, std::int32_t process, std::int64_t instance) {
  if (process == imrig_msg::heartbeat_t::CAMPAIGN) return kCampaign;
  return std::string(name) + " " + std::to_string(instance);
}

std::string stream_of(std::string_view name, Bytes data) {
  if (name == channel::kSamples) {
    const auto m = guarded_decode<imrig_msg::samples_t>(data);
    return m ? sender(name, 0, m->boot_id) : "";
  }
  if (name == channel::kHeartbeat) {
    const auto m = guarded_decode<imrig_msg::heartbeat_t>(data);
    return m ? sender(name, m->process, m->instance) : "";
  }
  if (name == channel::kAck) {
    const auto m = guarded_decode<imrig_msg::ack_t>(data);
    return m ? sender(name, m->process, m->process) : "";
  }
  for (const char* one : {channel::kRecord, channel::kDataset, channel::kCampaignStatus}) {
    if (name == one) return kCampaign;
  }
  for (const char* one : {channel::kBridgeStatus, channel::kDynoStatus, channel::kBridgeLease,
                          channel::kDynoLease, channel::kEstimate, channel::kMotorEstimate}) {
    if (name == one) return one;
  }
  return "";
}

}  // namespace

std::optional<StreamPlace> stream_place(std::string_view name, Bytes data) {
  const auto seq = seq_of(data);
  if (!seq) return std::nullopt;
  std::string stream = stream_of(name, data);
  if (stream.empty()) return std::nullopt;
  return StreamPlace{std::move(stream), *seq};
}

std::int64_t StreamWatch::see(const StreamPlace& place) {
  const auto [found, first] = streams_.try_emplace(place.stream);
  Stream& stream = found->second;
  ++stream.received;
  // Differences modulo 2^64: absurd numbers do no harm.
  const auto ahead = static_cast<std::int64_t>(static_cast<std::uint64_t>(place.seq) -
                                               static_cast<std::uint64_t>(stream.next));
  const auto next = static_cast<std::int64_t>(static_cast<std::uint64_t>(place.seq) + 1);
  if (first) {
    stream.next = next;
    return 0;
  }
  if (ahead < 0 && ahead >= -kLateAtMost && place.seq > kLateAtMost) {  // late, or twice
    if (stream.lost == 0) return 0;
    --stream.lost;
    return -1;
  }
  stream.next = next;
  if (ahead < 0 || ahead > kJumpAtMost) {
    ++stream.restarts;
    return 0;
  }
  stream.lost += ahead;
  return ahead;
}

}  // namespace imrig
