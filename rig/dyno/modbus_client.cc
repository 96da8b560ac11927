#include "rig/dyno/modbus_client.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "rig/base/clock.h"
#include "rig/dyno/supply_session.h"

namespace imrig {

namespace {

using std::chrono::milliseconds;
constexpr milliseconds kFirstWait{200};
constexpr milliseconds kLongestWait{2000};

}  // namespace

class ModbusClient::Impl {
 public:
  Impl(const ModbusClientConfig& config, const RegisterMap& map)
      : map_(map), wire_(config.url, config.response_ms), session_(wire_, map_), poll_(config.poll_ms) {
    thread_ = std::thread([this] { run(); });
  }

  ~Impl() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    wake_.notify_all();
    thread_.join();
  }

  void order(const SupplyOrder& order) {
    const std::lock_guard lock(mutex_);
    order_ = order;
  }

  SupplyReport report() const {
    const std::lock_guard lock(mutex_);
    return report_;
  }

  std::string trouble() const {
    const std::lock_guard lock(mutex_);
    return trouble_;
  }

 private:
  void run() {
    milliseconds wait = kFirstWait;
    while (!pause(milliseconds(0))) {
      if (begin()) {
        wait = kFirstWait;
        while (exchange()) {
          if (pause(poll_)) return;
        }
      }
      wire_.close();
      if (pause(wait)) return;
      wait = std::min(2 * wait, kLongestWait);
    }
  }

  // True when it is time to stop.
  bool pause(milliseconds time) {
    std::unique_lock lock(mutex_);
    return wake_.wait_for(lock, time, [this] { return stop_; });
  }

  bool begin() {
    if (!wire_.connect()) {
      note_failure(SessionResult::kLost, wire_.last_error());
      return false;
    }
    const SessionResult result = session_.begin();
    if (result != SessionResult::kDone) {
      note_failure(result, session_.trouble());
      return false;
    }
    const std::lock_guard lock(mutex_);
    if (connections_++ > 0) ++report_.reconnects;
    return true;
  }

  bool exchange() {
    SupplyOrder order;
    SupplyReport report;
    {
      const std::lock_guard lock(mutex_);
      order = order_;
      report = report_;
    }
    const SessionResult result = session_.exchange(order, monotonic_us(), report);
    if (result != SessionResult::kDone) {
      note_failure(result, session_.trouble());
      return false;
    }
    report.link = SupplyLink::kUp;
    report.wrong_device = false;
    report.heard_steady_us = monotonic_us();
    const std::lock_guard lock(mutex_);
    report_ = report;
    trouble_ = report.mismatch ? "the supply's registers do not hold what was written" : "";
    return true;
  }

  void note_failure(SessionResult result, const std::string& trouble) {
    const std::lock_guard lock(mutex_);
    ++report_.read_errors;
    report_.link = report_.heard_steady_us > 0 ? SupplyLink::kSilent : SupplyLink::kAbsent;
    report_.wrong_device = result == SessionResult::kWrongDevice;
    trouble_ = trouble;
  }

  const RegisterMap map_;
  ModbusWire wire_;        // the thread's
  SupplySession session_;  // the thread's
  const milliseconds poll_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  SupplyOrder order_;  // under mutex_, as all below
  SupplyReport report_;
  std::string trouble_;
  std::int64_t connections_ = 0;
  bool stop_ = false;
  std::thread thread_;
};

ModbusClient::ModbusClient(const ModbusClientConfig& config, const RegisterMap& map)
    : impl_(std::make_unique<Impl>(config, map)) {}
ModbusClient::~ModbusClient() = default;
void ModbusClient::order(const SupplyOrder& order) { impl_->order(order); }
SupplyReport ModbusClient::report() const { return impl_->report(); }
std::string ModbusClient::trouble() const { return impl_->trouble(); }

}  // namespace imrig
