#include "rig/dyno/modbus_wire.h"

#include <fmt/format.h>
#include <modbus/modbus.h>

#include <cerrno>
#include <filesystem>

#include "rig/base/error.h"
#include "rig/base/url.h"

namespace imrig {

struct ModbusWire::Context {
  modbus_t* modbus = nullptr;
  bool open = false;

  ~Context() {
    if (open) modbus_close(modbus);
    modbus_free(modbus);
  }
};

namespace {

[[noreturn]] void wrong(const std::string& url, const std::string& what) {
  throw Error(fmt::format("Modbus address '{}'", url), what,
              "tcp://127.0.0.1:PORT or rtu:///dev/ttyUSB1?baud=115200&unit=1");
}

modbus_t* new_context(const Url& url) {
  const bool tcp = url.scheme == "tcp" && !url.host.empty() && url.port > 0;
  const bool rtu = url.scheme == "rtu" && !url.path.empty();
  if (!tcp && !rtu) wrong(url.text, "neither TCP nor RTU");
  for (const auto& [key, value] : url.options) {
    if (key != "unit" && (key != "baud" || tcp)) wrong(url.text, fmt::format("unknown option '{}'", key));
  }
  if (tcp) return modbus_new_tcp_pi(url.host.c_str(), std::to_string(url.port).c_str());
  if (!std::filesystem::exists(url.path)) wrong(url.text, "no such device file");
  return modbus_new_rtu(url.path.c_str(), static_cast<int>(url.option_or("baud", 115200, 300, 4000000)), 'N',
                        8, 1);
}

}  // namespace

ModbusWire::ModbusWire(const std::string& text, int response_ms) : context_(std::make_unique<Context>()) {
  const Url url = parse_url(text);
  const auto unit = static_cast<int>(url.option_or("unit", 1, 1, 247));
  modbus_t* modbus = new_context(url);
  if (modbus == nullptr) wrong(text, modbus_strerror(errno));
  context_->modbus = modbus;
  const auto seconds = static_cast<std::uint32_t>(response_ms / 1000);
  const auto rest_us = static_cast<std::uint32_t>(response_ms % 1000 * 1000);
  modbus_set_slave(modbus, unit);
  modbus_set_error_recovery(modbus, MODBUS_ERROR_RECOVERY_NONE);
  modbus_set_response_timeout(modbus, seconds, rest_us);
  modbus_set_byte_timeout(modbus, seconds, rest_us);
}

ModbusWire::~ModbusWire() = default;

bool ModbusWire::connect() {
  close();
  context_->open = modbus_connect(context_->modbus) == 0;
  if (!context_->open) error_ = modbus_strerror(errno);
  return context_->open;
}

void ModbusWire::close() {
  if (context_->open) modbus_close(context_->modbus);
  context_->open = false;
}

WireResult ModbusWire::told(int done, std::size_t wanted) {
  if (done == static_cast<int>(wanted)) return WireResult::kDone;
  const int code = done < 0 ? errno : EMBBADDATA;
  error_ = modbus_strerror(code);
  return code > MODBUS_ENOBASE && code <= EMBXGTAR ? WireResult::kRefused : WireResult::kLost;
}

WireResult ModbusWire::read(int address, std::span<std::uint16_t> words) {
  if (!context_->open) return WireResult::kLost;
  modbus_flush(context_->modbus);
  return told(modbus_read_registers(context_->modbus, address, static_cast<int>(words.size()), words.data()),
              words.size());
}

WireResult ModbusWire::write(int address, std::span<const std::uint16_t> words) {
  if (!context_->open) return WireResult::kLost;
  modbus_flush(context_->modbus);
  const int n = static_cast<int>(words.size());
  return told(n == 1 ? modbus_write_register(context_->modbus, address, words[0])
                     : modbus_write_registers(context_->modbus, address, n, words.data()),
              words.size());
}

}  // namespace imrig
