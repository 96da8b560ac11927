#include "plant/emulator/link_port.h"

#include <algorithm>
#include <optional>

#include "rig/link/device/codec.h"
#include "rig/link/device/frame.h"

namespace imrig::plant {

namespace {

constexpr int kMostDatagrams = 1000;  // at once; the samples must have their turn

std::string listening(const std::string& url) {
  return url.starts_with("udp://") ? "udp-listen://" + url.substr(6) : url;
}

std::optional<imrig_hello> hello_in(std::span<const std::uint8_t> frame) {
  if (frame.empty() || frame.size() > IMRIG_RECEIVE_MAX) return std::nullopt;
  std::vector<std::uint8_t> copy(frame.begin(), frame.end());
  const std::size_t n = imrig_frame_open(copy.data(), copy.size());
  imrig_hello hello;
  if (n == 0 || imrig_decode_hello(copy.data(), n, &hello) == 0) return std::nullopt;
  return hello;
}

}  // namespace

LinkPort::LinkPort(const std::string& url)
    : transport_(open_transport(listening(url))), in_(65536), out_(IMRIG_FRAME_MAX) {}

void LinkPort::receive(Firmware& firmware, std::int64_t now_ms) {
  for (int k = 0; k < kMostDatagrams; ++k) {
    const std::size_t n = transport_->read(in_);
    if (n == 0) return;
    const std::span<const std::uint8_t> bytes(in_.data(), n);
    if (transport_->from_stranger()) {
      hear_stranger(firmware, bytes, now_ms);
    } else {
      firmware.feed(bytes, now_ms);
    }
  }
}

// Only the hello of a stranger reaches the device, and only when the device takes it does the stranger become
// the host.
void LinkPort::hear_stranger(Firmware& firmware, std::span<const std::uint8_t> datagram,
                             std::int64_t now_ms) {
  while (!datagram.empty()) {
    const auto end = std::find(datagram.begin(), datagram.end(), std::uint8_t{0});
    if (end == datagram.end()) return;
    const auto size = static_cast<std::size_t>(end - datagram.begin());
    if (const auto hello = hello_in(datagram.first(size))) {
      const std::uint8_t zero = 0;  // ends whatever the host before it left unfinished
      firmware.feed({&zero, 1}, now_ms);
      firmware.feed(datagram.first(size + 1), now_ms);
      if (firmware.host_nonce() == hello->host_nonce) transport_->accept_sender();
      return;
    }
    datagram = datagram.subspan(size + 1);
  }
}

void LinkPort::send(Firmware& firmware) {
  while (firmware.has_output()) {
    const std::size_t n = firmware.take(out_);
    if (n == 0) return;
    if (!transport_->write({out_.data(), n})) ++unsent_;
  }
}

bool LinkPort::wait(int timeout_ms) { return transport_->wait(timeout_ms); }
std::string LinkPort::url() const { return transport_->url(); }

}  // namespace imrig::plant
