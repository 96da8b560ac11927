#include "rig/link/host.h"

#include <algorithm>

#include "rig/link/device/codec.h"
#include "rig/link/device/result.h"
#include "rig/link/frame_writer.h"

namespace imrig {

namespace {
constexpr std::size_t kPacketBytes = 1400;  // fits one Ethernet frame
constexpr std::size_t kUploadWindow =
    8;  // segments on their way at once; the device remembers IMRIG_REMEMBERED requests
}  // namespace

LinkHost::LinkHost(const LinkHostConfig& config) : config_(config) {}

std::optional<LinkEvent> LinkHost::next_event() {
  if (events_.empty()) return std::nullopt;
  LinkEvent event = std::move(events_.front());
  events_.pop_front();
  return event;
}

bool LinkHost::next_output(std::vector<std::uint8_t>& packet) {
  if (output_.empty()) return false;
  packet = std::move(output_.front());
  output_.pop_front();
  return true;
}

void LinkHost::emit(std::span<const std::uint8_t> frame) {
  if (output_.empty() || output_.back().size() + frame.size() > kPacketBytes) output_.emplace_back();
  output_.back().insert(output_.back().end(), frame.begin(), frame.end());
}

// ---- what comes in

void LinkHost::receive(std::span<const std::uint8_t> bytes, std::int64_t now_us) {
  reader_.feed(bytes, [&](std::span<const std::uint8_t> payload) { on_frame(payload, now_us); });
}

void LinkHost::on_frame(std::span<const std::uint8_t> payload, std::int64_t now_us) {
  bool understood = false;
  switch (imrig_type_of(payload.data(), payload.size())) {
    case IMRIG_TYPE_WELCOME: {
      imrig_welcome message;
      understood = imrig_decode_welcome(payload.data(), payload.size(), &message) != 0;
      if (understood) on_welcome(message);
      break;
    }
    case IMRIG_TYPE_BLOCK: {
      imrig_block message;
      understood = imrig_decode_block(payload.data(), payload.size(), &message) != 0;
      if (understood) on_block(message);
      break;
    }
    case IMRIG_TYPE_STATUS: {
      imrig_status message;
      understood = imrig_decode_status(payload.data(), payload.size(), &message) != 0;
      if (understood) on_status(message);
      break;
    }
    case IMRIG_TYPE_REPLY: {
      imrig_reply message;
      understood = imrig_decode_reply(payload.data(), payload.size(), &message) != 0;
      if (understood) on_reply(message);
      break;
    }
    default:
      break;
  }
  if (understood) {
    last_heard_us_ = now_us;
  } else {
    ++undecodable_;
  }
}

void LinkHost::on_welcome(const imrig_welcome& message) {
  if (message.host_nonce != config_.host_nonce) return;
  const bool new_boot = !welcome_ || welcome_->boot_id != message.boot_id;
  if (new_boot) {
    fail_all(kLinkLost);
    next_block_ = message.next_block;
    next_index_ = message.next_index;
    granted_ = credit_ = 0;
    last_status_seq_ = -1;
  }
  welcome_ = message;
  up_ = true;
  credit_due_ = true;
  events_.push_back(LinkWelcome{message, new_boot});
}

// One that is older than the last was doubled or overtaken on the way.
void LinkHost::on_status(const imrig_status& message) {
  if (!up_ || message.boot_id != welcome_->boot_id || message.seq <= last_status_seq_) return;
  last_status_seq_ = message.seq;
  events_.push_back(LinkStatus{message});
}

void LinkHost::on_block(const imrig_block& message) {
  if (!up_ || message.seq < next_block_) return;  // of another session, or doubled on the way
  const std::int64_t lost = message.seq - next_block_;
  lost_blocks_ += lost;
  next_block_ = message.seq + 1;
  next_index_ = message.first_index + message.n;
  events_.push_back(LinkBlock{message, lost});
}

void LinkHost::on_reply(const imrig_reply& message) {
  const auto found = std::find_if(requests_.begin(), requests_.end(),
                                  [&](const Request& r) { return r.seq == message.of_seq; });
  if (found == requests_.end()) return;  // answered before
  const Request request = std::move(*found);
  requests_.erase(found);
  if (!request.of_upload) {
    events_.push_back(LinkAnswer{request.number, message.result});
  } else if (message.result != IMRIG_DONE) {
    finish_upload(message.result);
  } else if (++upload_->replied > upload_->profile.segments.size()) {
    finish_upload(IMRIG_DONE);
  }
}

// ---- requests

void LinkHost::finish_upload(std::int32_t result) {
  std::erase_if(requests_, [](const Request& r) { return r.of_upload; });
  events_.push_back(LinkAnswer{upload_->number, result});
  upload_.reset();
}

void LinkHost::fail_all(std::int32_t result) {
  if (upload_) finish_upload(result);
  for (const Request& request : requests_) events_.push_back(LinkAnswer{request.number, result});
  requests_.clear();
}

std::int64_t LinkHost::upload(const LinkProfile& profile) {
  if (upload_) finish_upload(kLinkLost);
  upload_ = Upload{++number_, profile, 0, 0};
  if (!up_) {
    finish_upload(kLinkLost);
  } else if (profile.segments.empty() || profile.segments.size() > IMRIG_MAX_SEGMENTS ||
             profile.profile_id < 1) {
    finish_upload(IMRIG_MALFORMED);
  }
  return number_;
}

std::int64_t LinkHost::order(std::int32_t action, std::int32_t profile_id, double ramp_s) {
  ++number_;
  if (!up_) {
    events_.push_back(LinkAnswer{number_, kLinkLost});
    return number_;
  }
  const imrig_order message = {0, ++request_seq_, 1, action, profile_id, ramp_s};
  Request request;
  request.seq = message.seq;
  request.number = number_;
  request.frame = frame_of(imrig_encode_order, message);
  if (action == IMRIG_TRIP) {
    requests_.push_front(std::move(request));
  } else {
    requests_.push_back(std::move(request));
  }
  return number_;
}

std::int64_t LinkHost::start(std::int32_t profile_id) { return order(IMRIG_START, profile_id, 0.0); }
std::int64_t LinkHost::stop(double ramp_s) { return order(IMRIG_STOP, 0, ramp_s); }
std::int64_t LinkHost::trip() { return order(IMRIG_TRIP, 0, 0.0); }
std::int64_t LinkHost::clear() { return order(IMRIG_CLEAR, 0, 0.0); }

void LinkHost::grant(std::int64_t until_index) { granted_ = std::max(granted_, until_index); }

// Keeps a window of segments on the way; the commit goes once every segment has been answered.
void LinkHost::feed_upload() {
  if (!upload_) return;
  Upload& u = *upload_;
  const std::size_t n = u.profile.segments.size();
  while (u.next <= n && u.next - u.replied < kUploadWindow && (u.next < n || u.replied == n)) {
    Request request;
    request.seq = ++request_seq_;
    request.number = u.number;
    request.of_upload = true;
    if (u.next < n) {
      imrig_segment message = u.profile.segments[u.next];
      message.utime = 0;
      message.seq = request.seq;
      message.segment_v1 = 1;
      message.profile_id = u.profile.profile_id;
      message.position = static_cast<std::int32_t>(u.next);
      request.frame = frame_of(imrig_encode_segment, message);
    } else {
      const imrig_commit message = {
          0, request.seq, 1, u.profile.profile_id, static_cast<std::int32_t>(n), u.profile.at_end};
      request.frame = frame_of(imrig_encode_commit, message);
    }
    requests_.push_back(std::move(request));
    ++u.next;
  }
}

// ---- timers

void LinkHost::poll(std::int64_t now_us) {
  if (up_ && now_us - last_heard_us_ > config_.silence_us) {
    up_ = false;
    fail_all(kLinkLost);
    events_.push_back(LinkDown{});
  }
  say_hello(now_us);
  if (!up_) return;
  feed_upload();
  send_requests(now_us);
  send_credit(now_us);
}

void LinkHost::say_hello(std::int64_t now_us) {
  if (up_ || (last_hello_us_ >= 0 && now_us - last_hello_us_ < config_.hello_period_us)) return;
  last_hello_us_ = now_us;
  const imrig_hello message = {now_us,
                               ++seq_,
                               1,
                               config_.host_nonce,
                               config_.watchdog_ms,
                               config_.current_limit_A,
                               config_.speed_limit_rpm,
                               config_.stator_limit_C,
                               config_.voltage_limit_V};
  emit(frame_of(imrig_encode_hello, message));
}

void LinkHost::send_requests(std::int64_t now_us) {
  for (Request& request : requests_) {
    if (request.last_sent_us >= 0 && now_us - request.last_sent_us < config_.retry_us) continue;
    if (request.first_sent_us < 0) request.first_sent_us = now_us;
    request.last_sent_us = now_us;
    emit(request.frame);
  }
  give_up(now_us);
}

void LinkHost::give_up(std::int64_t now_us) {
  const auto too_old = [&](const Request& r) { return now_us - r.first_sent_us > config_.give_up_us; };
  if (std::any_of(requests_.begin(), requests_.end(),
                  [&](const Request& r) { return r.of_upload && too_old(r); })) {
    finish_upload(kLinkNoAnswer);
  }
  for (const Request& request : requests_) {
    if (too_old(request)) events_.push_back(LinkAnswer{request.number, kLinkNoAnswer});
  }
  std::erase_if(requests_, too_old);
}

void LinkHost::send_credit(std::int64_t now_us) {
  const std::int64_t period_us = config_.watchdog_ms * std::int64_t{1000} / 4;
  const std::int64_t unread = config_.unread_blocks * std::int64_t{IMRIG_BLOCK_SAMPLES};
  const std::int64_t seen =
      std::max(next_index_, welcome_->next_index);  // another host may have run it in between
  const std::int64_t credit = std::min(granted_, seen + unread);
  if (credit <= credit_ && !credit_due_ && now_us - last_credit_us_ < period_us) return;
  last_credit_us_ = now_us;
  credit_due_ = false;
  credit_ = std::max(credit_, credit);
  const imrig_credit message = {now_us, ++seq_, 1, credit_};
  emit(frame_of(imrig_encode_credit, message));
}

}  // namespace imrig
