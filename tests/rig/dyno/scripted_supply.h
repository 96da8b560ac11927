#pragma once
// A libmodbus TCP server that can do what a good supply does not: answer late, be another device, refuse
// writes, be switched at its front panel. Counts requests. One client at a time, as small devices have it.

#include <modbus/modbus.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace imrig::test {

class ScriptedSupply {
 public:
  // registers: address and word, in place before the first connection.
  ScriptedSupply(int port, const std::vector<std::pair<int, std::uint16_t>>& registers) : port_(port) {
    context_ = modbus_new_tcp("127.0.0.1", port);
    listener_ = modbus_tcp_listen(context_, 4);
    if (listener_ < 0) throw std::runtime_error(modbus_strerror(errno));
    map_ = modbus_mapping_new(0, 0, 1200, 0);
    for (const auto& [address, word] : registers) map_->tab_registers[address] = word;
    thread_ = std::thread([this] { run(); });
  }
  ~ScriptedSupply() {
    stop_ = true;
    thread_.join();
    modbus_close(context_);
    ::close(listener_);
    modbus_mapping_free(map_);
    modbus_free(context_);
  }
  ScriptedSupply(const ScriptedSupply&) = delete;
  ScriptedSupply& operator=(const ScriptedSupply&) = delete;

  std::string url() const { return "tcp://127.0.0.1:" + std::to_string(port_); }
  void poke(int address, std::uint16_t word) {
    const std::lock_guard lock(mutex_);
    map_->tab_registers[address] = word;
  }
  std::uint16_t peek(int address) const {
    const std::lock_guard lock(mutex_);
    return map_->tab_registers[address];
  }
  // The addresses written so far, in order.
  std::vector<int> writes() const {
    const std::lock_guard lock(mutex_);
    return writes_;
  }

  std::atomic<int> delay_next_ms = 0;        // the next reply comes so late, once
  std::atomic<bool> hung = false;            // takes requests, never answers
  std::atomic<bool> deaf_to_writes = false;  // says yes, changes nothing
  std::atomic<int> refuse_write = -1;        // this address gets an exception
  std::atomic<int> connections = 0;
  std::atomic<int> requests = 0;

 private:
  bool waits(int fd) {
    pollfd p{fd, POLLIN, 0};
    while (!stop_) {
      if (::poll(&p, 1, 20) > 0) return true;
    }
    return false;
  }

  void run() {
    while (waits(listener_)) {
      int listener = listener_;
      if (modbus_tcp_accept(context_, &listener) < 0) continue;
      ++connections;
      serve();
      modbus_close(context_);
    }
  }

  void serve() {
    std::uint8_t request[MODBUS_TCP_MAX_ADU_LENGTH];
    while (waits(modbus_get_socket(context_))) {
      const int n = modbus_receive(context_, request);
      if (n < 0) return;
      if (n == 0) continue;
      ++requests;
      const int late_ms = delay_next_ms.exchange(0);
      std::this_thread::sleep_for(std::chrono::milliseconds(late_ms));
      if (!hung) answer(request, n);
    }
  }

  void answer(const std::uint8_t* request, int n) {
    const int address = request[8] << 8 | request[9];
    const bool write = request[7] == 6 || request[7] == 16;
    const std::lock_guard lock(mutex_);
    if (write) writes_.push_back(address);
    if (write && address == refuse_write) {
      modbus_reply_exception(context_, request, MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE);
      return;
    }
    const std::vector<std::uint16_t> before(map_->tab_registers, map_->tab_registers + 1200);
    modbus_reply(context_, request, n, map_);
    if (write && deaf_to_writes) std::copy(before.begin(), before.end(), map_->tab_registers);
  }

  int port_;
  modbus_t* context_ = nullptr;
  modbus_mapping_t* map_ = nullptr;
  int listener_ = -1;
  mutable std::mutex mutex_;
  std::vector<int> writes_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace imrig::test
