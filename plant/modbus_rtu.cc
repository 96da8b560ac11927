// Modbus RTU on a serial line: one master, frames parted by silence. What fails its checksum is thrown away
// with everything behind it up to the next silence.

#include <fmt/format.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>

#include "plant/modbus_face.h"
#include "rig/base/error.h"

namespace imrig::plant {

namespace {

constexpr std::size_t kChecksum = 2;
constexpr std::uint32_t kWait_us =
    100000;  // how long the thread waits for a request before it looks whether to stop
constexpr std::uint32_t kByteSilence_us = 50000;  // within a frame
constexpr auto kPause = std::chrono::milliseconds(20);

class RtuServer : public ModbusWire {
 public:
  RtuServer(const std::string& url, const std::string& device, int baud, int unit, ModbusFace& face)
      : face_(face), url_(url), context_(modbus_new_rtu(device.c_str(), baud, 'N', 8, 1)) {
    if (!context_ || modbus_set_slave(context_.get(), unit) != 0 || modbus_connect(context_.get()) != 0) {
      throw Error("Modbus server", fmt::format("{}: {}", device, modbus_strerror(errno)), "a serial device");
    }
    modbus_set_error_recovery(context_.get(), MODBUS_ERROR_RECOVERY_NONE);
    modbus_set_indication_timeout(context_.get(), 0, kWait_us);
    modbus_set_byte_timeout(context_.get(), 0, kByteSilence_us);
    thread_ = std::thread([this] { run(); });
  }

  ~RtuServer() override {
    stop_ = true;
    thread_.join();
    modbus_close(context_.get());
  }

  std::string bound_url() const override { return url_; }

 private:
  void run() {
    std::uint8_t request[MODBUS_MAX_ADU_LENGTH];
    while (!stop_) {
      const int n = modbus_receive(context_.get(), request);
      if (n > 0) {
        face_.answer(context_.get(), {request, static_cast<std::size_t>(n)}, kChecksum);
      } else if (n < 0 && errno != ETIMEDOUT) {
        std::this_thread::sleep_for(kPause);
        modbus_flush(context_.get());
      }
    }
  }

  ModbusFace& face_;
  std::string url_;
  ModbusContext context_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace

std::unique_ptr<ModbusWire> serve_rtu(const std::string& url, const std::string& device, int baud, int unit,
                                      ModbusFace& face) {
  return std::make_unique<RtuServer>(url, device, baud, unit, face);
}

}  // namespace imrig::plant
