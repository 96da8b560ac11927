// The bus over LCM's UDP multicast. LCM's own header is included here and nowhere else.

#include <lcm/lcm.h>
#include <poll.h>

#include <cstring>
#include <exception>
#include <list>
#include <utility>

#include "rig/base/error.h"
#include "rig/bus/bus.h"
#include "rig/bus/multicast.h"
#include "rig/bus/replay.h"

namespace imrig {

namespace {

// One wait ends after so many messages even when more keep coming.
constexpr int kMaxHandledPerWait = 65536;

// LCM takes channel names as regular expressions.
std::string literally(const std::string& name) {
  std::string pattern;
  for (const char c : name) {
    if (std::string_view(R"(\^$.|?*+()[]{})").find(c) != std::string_view::npos) pattern += '\\';
    pattern += c;
  }
  return pattern;
}

struct Subscription {
  Bus::RawHandler handler;
  std::exception_ptr* thrown;
};

// LCM is C: no exception may pass through it. wait() throws it again.
void call_handler(const lcm_recv_buf_t* message, const char* channel, void* user) {
  // A datagram that ends inside its channel name leaves LCM with a negative size, which arrives here as 4 GB.
  if (message->data_size > LCM_MAX_MESSAGE_SIZE) return;
  // Every LCM instance that begins to listen asks itself this; all others on the port hear it.
  if (std::strcmp(channel, "LCM_SELF_TEST") == 0) return;
  const auto* subscription = static_cast<const Subscription*>(user);
  try {
    subscription->handler(channel,
                          Bytes(static_cast<const std::uint8_t*>(message->data), message->data_size));
  } catch (...) {
    if (*subscription->thrown == nullptr) *subscription->thrown = std::current_exception();
  }
}

lcm_t* open_lcm(const std::string& url) {
  lcm_t* lcm = lcm_create(checked_lcm_url(url).c_str());
  if (lcm == nullptr) throw Error("bus " + url, "LCM cannot open it");
  return lcm;
}

class LcmBus final : public Bus {
 public:
  explicit LcmBus(const BusConfig& config) : prefix_(config.prefix + "_"), lcm_(open_lcm(config.url)) {}
  ~LcmBus() override { lcm_destroy(lcm_); }
  LcmBus(const LcmBus&) = delete;
  LcmBus& operator=(const LcmBus&) = delete;

  void publish_raw(const std::string& name, Bytes data) override {
    // The result says nothing: LCM reports success whatever became of the datagram. Receivers count gaps by
    // seq.
    lcm_publish(lcm_, (prefix_ + name).c_str(), data.data(), static_cast<unsigned>(data.size()));
  }

  void subscribe_raw(const std::string& name, RawHandler handler) override {
    subscriptions_.push_back({std::move(handler), &thrown_});
    const std::string pattern = name == "*" ? ".*" : literally(prefix_ + name);
    lcm_subscription_t* made = lcm_subscribe(lcm_, pattern.c_str(), call_handler, &subscriptions_.back());
    if (made == nullptr) {
      throw Error("bus", "LCM cannot listen to " + pattern, "a firewall may hold multicast back");
    }
    lcm_subscription_set_queue_capacity(made, 0);  // unlimited; the default of 30 drops the newest
  }

  int wait(int timeout_ms) override {
    int handled = 0;
    while (handled < kMaxHandledPerWait && readable(handled == 0 ? timeout_ms : 0) && lcm_handle(lcm_) == 0) {
      ++handled;
      if (thrown_ != nullptr) std::rethrow_exception(std::exchange(thrown_, nullptr));
    }
    return handled;
  }

  int fd() const override { return lcm_get_fileno(lcm_); }

 private:
  // False also when a signal came: the caller looks at its stop flag.
  bool readable(int timeout_ms) {
    pollfd wanted = {lcm_get_fileno(lcm_), POLLIN, 0};
    return ::poll(&wanted, 1, timeout_ms) > 0 && (wanted.revents & POLLIN) != 0;
  }

  std::string prefix_;
  lcm_t* lcm_;
  std::list<Subscription> subscriptions_;  // LCM keeps their addresses
  std::exception_ptr thrown_;
};

}  // namespace

std::unique_ptr<Bus> open_lcm_bus(const BusConfig& config) { return std::make_unique<LcmBus>(config); }

Player open_lcm_player(const BusConfig& config) {
  const std::shared_ptr<lcm_t> lcm(open_lcm(config.url), lcm_destroy);
  return [lcm](const std::string& channel, Bytes data) {
    lcm_publish(lcm.get(), channel.c_str(), data.data(), static_cast<unsigned>(data.size()));
  };
}

}  // namespace imrig
