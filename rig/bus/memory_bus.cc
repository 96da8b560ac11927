#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <utility>

#include "rig/bus/bus.h"

namespace imrig {

namespace {
struct MemoryMessage {
  std::string channel;
  std::vector<std::uint8_t> data;
};
using Inbox = std::deque<std::shared_ptr<const MemoryMessage>>;
}  // namespace

// Buses of one hub may live on different threads.
class MemoryHub {
 public:
  int join() {
    const std::lock_guard lock(mutex_);
    inboxes_[++last_];
    return last_;
  }
  void leave(int member) {
    const std::lock_guard lock(mutex_);
    inboxes_.erase(member);
  }
  void publish(std::string channel, Bytes data) {
    const auto message =
        std::make_shared<const MemoryMessage>(MemoryMessage{std::move(channel), {data.begin(), data.end()}});
    const std::lock_guard lock(mutex_);
    for (auto& [member, inbox] : inboxes_) inbox.push_back(message);
    arrived_.notify_all();
  }
  Inbox take(int member, int timeout_ms) {
    std::unique_lock lock(mutex_);
    Inbox& inbox = inboxes_[member];
    arrived_.wait_for(lock, std::chrono::milliseconds(std::max(timeout_ms, 0)),
                      [&] { return !inbox.empty(); });
    return std::exchange(inbox, {});
  }

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::map<int, Inbox> inboxes_;
  int last_ = 0;
};

namespace {

class MemoryBus final : public Bus {
 public:
  MemoryBus(std::shared_ptr<MemoryHub> hub, const std::string& prefix)
      : hub_(std::move(hub)), prefix_(prefix + "_") {}
  ~MemoryBus() override {
    if (member_ != 0) hub_->leave(member_);
  }
  MemoryBus(const MemoryBus&) = delete;
  MemoryBus& operator=(const MemoryBus&) = delete;

  void publish_raw(const std::string& name, Bytes data) override { hub_->publish(prefix_ + name, data); }

  void subscribe_raw(const std::string& name, RawHandler handler) override {
    if (member_ == 0) member_ = hub_->join();  // nothing piles up for a bus that only publishes
    handlers_.emplace_back(name == "*" ? name : prefix_ + name, std::move(handler));
  }

  int wait(int timeout_ms) override {
    if (member_ == 0) return 0;
    int handled = 0;
    for (const auto& message : hub_->take(member_, timeout_ms)) {
      bool wanted = false;
      for (std::size_t k = 0; k < handlers_.size(); ++k) {  // a handler may subscribe
        if (handlers_[k].first != "*" && handlers_[k].first != message->channel) continue;
        const RawHandler handler = handlers_[k].second;
        handler(message->channel, message->data);
        wanted = true;
      }
      handled += wanted ? 1 : 0;
    }
    return handled;
  }

 private:
  std::shared_ptr<MemoryHub> hub_;
  int member_ = 0;  // none before the first subscription
  std::string prefix_;
  std::vector<std::pair<std::string, RawHandler>> handlers_;
};

}  // namespace

std::shared_ptr<MemoryHub> make_memory_hub() { return std::make_shared<MemoryHub>(); }

std::unique_ptr<Bus> open_memory_bus(std::shared_ptr<MemoryHub> hub, const std::string& prefix) {
  return std::make_unique<MemoryBus>(std::move(hub), prefix);
}

}  // namespace imrig
