#pragma once
// The wire under the DSP link: UDP or a serial line, never blocking.
//
//   udp://127.0.0.1:47010                    host: sends to that address from a port of its own
//   udp-listen://127.0.0.1:47010             device: listens there (port 0: any free one), answers whom
//   accept_sender() chose serial:///dev/ttyUSB0?baud=3000000       both: raw 8N1 (115200 without ?baud);
//   works with pseudo-terminals
//
// A transport moves bytes, not frames: pieces may be lost, doubled or cut anywhere; frames are found by their
// 0x00.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace imrig {

class Transport {
 public:
  virtual ~Transport() = default;
  // Reads what is there without waiting: one datagram (buffer of 64 kB takes any), or what the line has. 0:
  // nothing there.
  virtual std::size_t read(std::span<std::uint8_t> buffer) = 0;
  // Sends whole frames without waiting. False: dropped (nobody to send to, buffers full). On a serial line
  // unsent bytes stay queued (up to 256 kB) and go out with the next read, write or wait.
  virtual bool write(std::span<const std::uint8_t> frames) = 0;
  // Waits until there is something to read, at most timeout_ms (0: only looks). True: there is.
  virtual bool wait(int timeout_ms) = 0;
  // For poll(2) with POLLIN beside other descriptors.
  virtual int fd() const = 0;
  // The address as bound: a port 0 is replaced by the real one.
  virtual std::string url() const = 0;

  // udp-listen: true when the last read came from another sender than the one answered now.
  virtual bool from_stranger() const { return false; }
  // udp-listen: from now on answer the sender of the last read. Call it once that sender has said a valid
  // hello.
  virtual void accept_sender() {}
};

// Throws Error: bad URL, port in use, no such device file, not a terminal, baud rate the system does not
// know.
std::unique_ptr<Transport> open_transport(const std::string& url);

}  // namespace imrig
