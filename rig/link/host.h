#pragma once
// The host's side of the DSP link as a core: bytes in -> events, calls -> bytes out, time handed in. No I/O,
// no clock, no thread.
//
// Rule: hello every hello_period_us until welcomed (and again after silence); every request (segment, commit,
// order) is repeated with the same sequence every retry_us until its reply comes, or give_up_us is over;
// credit frames feed the device's watchdog four times per watchdog time. docs/dsp-link.md tells the exchange.
// Messages: rig/link/device/messages.h, lcmtypes/link.
//
// Typical use (bridge): loop { transport.read -> receive; take events; call upload, start, grant...;
// poll(now); write output }.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "rig/link/device/messages.h"
#include "rig/link/frame_reader.h"

namespace imrig {

struct LinkHostConfig {
  std::int64_t host_nonce = 0;  // random per process start: random_id()
  int watchdog_ms = 300;        // 20..2000
  double current_limit_A = 0;
  double speed_limit_rpm = 0;
  double stator_limit_C = 0;
  double voltage_limit_V = 0;
  std::int64_t hello_period_us = 200000;
  std::int64_t silence_us =
      500000;  // without a valid frame for so long the link is down and hello starts again
  std::int64_t retry_us = 50000;
  std::int64_t give_up_us = 2000000;
  // Samples granted but not yet received fit into so many blocks: Linux' default socket buffer
  // (net.core.rmem_max 212992) loses the 44th.
  int unread_blocks = 32;
};

// Results of a request beyond the device's own (rig/link/device/result.h, 0 done).
inline constexpr std::int32_t kLinkNoAnswer = -1;  // give_up_us passed without a reply
inline constexpr std::int32_t kLinkLost = -2;  // not welcomed, link silent, or the device rebooted meanwhile

struct LinkProfile {
  std::int32_t profile_id = 0;  // > 0
  std::int32_t at_end = 0;      // imrig_at_end
  std::vector<imrig_segment>
      segments;  // profile_id, position, seq, utime and segment_v1 are filled in by the host
};

struct LinkWelcome {
  imrig_welcome message;
  bool new_boot = false;  // first welcome, or another boot_id than before
};
struct LinkBlock {
  imrig_block message;
  std::int64_t lost_before = 0;  // blocks missing between this one and the one before it
};
struct LinkStatus {
  imrig_status message;
};
struct LinkAnswer {
  std::int64_t request = 0;  // what upload, start, stop, trip or clear returned
  std::int32_t result = 0;   // 0 done; > 0 the device's; < 0 kLink...
};
struct LinkDown {};  // silence_us passed without a valid frame
using LinkEvent = std::variant<LinkWelcome, LinkBlock, LinkStatus, LinkAnswer, LinkDown>;

class LinkHost {
 public:
  explicit LinkHost(const LinkHostConfig& config);

  // Bytes as they come off the wire, in pieces of any size. now_us: monotonic.
  void receive(std::span<const std::uint8_t> bytes, std::int64_t now_us);
  // Timers: hello, repeats, credits, silence. Call it at least every 10 ms.
  void poll(std::int64_t now_us);
  // Oldest event not yet taken.
  std::optional<LinkEvent> next_event();
  // Next packet of whole frames to write (at most 1,400 bytes; one datagram over UDP); false when there is
  // none.
  bool next_output(std::vector<std::uint8_t>& packet);

  // Requests; each returns a number that its LinkAnswer carries. Nothing is sent before poll(). The answer to
  // a request that cannot be sent (not welcomed) is kLinkLost. An upload cancels the upload before it
  // (kLinkLost). Trip cancels nothing but overtakes everything that waits.
  std::int64_t upload(const LinkProfile& profile);
  std::int64_t start(std::int32_t profile_id);
  std::int64_t stop(double ramp_s);
  std::int64_t trip();
  std::int64_t clear();

  // The device may take samples below this index. Only matters where it waits; is resent as keepalive. Never
  // moves backwards within one boot.
  void grant(std::int64_t until_index);

  bool up() const { return up_; }                                           // welcomed and not silent
  const std::optional<imrig_welcome>& welcome() const { return welcome_; }  // last one
  std::int64_t lost_blocks() const { return lost_blocks_; }                 // since construction
  std::int64_t bad_frames() const { return reader_.bad_frames() + undecodable_; }
  std::int64_t last_heard_us() const { return last_heard_us_; }  // last valid frame; 0 none
  std::int64_t next_index() const { return next_index_; }        // one past the last sample received

 private:
  struct Request {
    std::int64_t seq = 0;
    std::int64_t number = 0;  // of the public call
    std::vector<std::uint8_t> frame;
    std::int64_t first_sent_us = -1;
    std::int64_t last_sent_us = -1;
    bool of_upload = false;
  };
  struct Upload {
    std::int64_t number = 0;
    LinkProfile profile;
    std::size_t next = 0;  // segment to send next; segments.size(): the commit
    std::size_t replied = 0;
  };

  void on_frame(std::span<const std::uint8_t> payload, std::int64_t now_us);
  void on_welcome(const imrig_welcome& message);
  void on_status(const imrig_status& message);
  void on_block(const imrig_block& message);
  void on_reply(const imrig_reply& message);
  void finish_upload(std::int32_t result);
  void fail_all(std::int32_t result);
  void feed_upload();
  void give_up(std::int64_t now_us);
  void say_hello(std::int64_t now_us);
  void send_requests(std::int64_t now_us);
  void send_credit(std::int64_t now_us);
  std::int64_t order(std::int32_t action, std::int32_t profile_id, double ramp_s);
  void emit(std::span<const std::uint8_t> frame);

  LinkHostConfig config_;
  FrameReader reader_;
  std::deque<LinkEvent> events_;
  std::deque<std::vector<std::uint8_t>> output_;
  std::deque<Request> requests_;
  std::optional<Upload> upload_;
  std::optional<imrig_welcome> welcome_;
  bool up_ = false;
  std::int64_t seq_ = 0;          // frames
  std::int64_t request_seq_ = 0;  // requests, apart: the device remembers the last ones by number
  std::int64_t number_ = 0;
  std::int64_t next_block_ = 0;
  std::int64_t next_index_ = 0;
  std::int64_t lost_blocks_ = 0;
  std::int64_t undecodable_ = 0;
  std::int64_t last_status_seq_ = -1;
  std::int64_t last_heard_us_ = 0;
  std::int64_t last_hello_us_ = -1;
  std::int64_t last_credit_us_ = -1;
  std::int64_t granted_ = 0;  // by the caller
  std::int64_t credit_ = 0;   // told to the device
  bool credit_due_ = false;
};

}  // namespace imrig
