#include "plant/modbus_server.h"

#include <algorithm>
#include <new>

#include "plant/modbus_face.h"
#include "rig/base/error.h"
#include "rig/base/url.h"

namespace imrig::plant {

ModbusFace::ModbusFace(const RidenRatings& ratings)
    : registers_(ratings), mapping_(modbus_mapping_new(0, 0, RidenRegisters::kCount, 0)) {
  if (!mapping_) throw std::bad_alloc();
}

bool ModbusFace::answer(modbus_t* context, std::span<const std::uint8_t> request, std::size_t trailing) {
  const auto header = static_cast<std::size_t>(modbus_get_header_length(context));
  if (request.size() < header + trailing + 1) return false;
  const ModbusRequest wanted = read_request(request.subspan(header, request.size() - header - trailing));
  ModbusException exception;
  {
    const std::lock_guard lock(mutex_);
    exception = registers_.carry_out(wanted);
    std::ranges::copy(registers_.words(), mapping_->tab_registers);
  }
  // A write's values are in the mapping already: libmodbus writes them a second time and echoes them.
  return exception == ModbusException::kNone
             ? modbus_reply(context, request.data(), static_cast<int>(request.size()), mapping_.get()) >= 0
             : modbus_reply_exception(context, request.data(), static_cast<unsigned>(exception)) >= 0;
}

ExcitationCommand ModbusFace::command() const {
  const std::lock_guard lock(mutex_);
  return registers_.command();
}

void ModbusFace::set_readback(const ExcitationReadback& readback) {
  const std::lock_guard lock(mutex_);
  registers_.set_readback(readback);
}

class ModbusServer::Impl {
 public:
  Impl(const std::string& url, const RidenRatings& ratings) : face_(ratings) {
    const Url parsed = parse_url(url);
    for (const auto& [key, value] : parsed.options) {
      if (parsed.scheme != "rtu" || (key != "baud" && key != "unit")) wrong(url);
    }
    if (parsed.scheme == "tcp" && !parsed.host.empty()) {
      wire_ = serve_tcp(parsed.host, parsed.port, face_);
    } else if (parsed.scheme == "rtu" && !parsed.path.empty()) {
      wire_ = serve_rtu(url, parsed.path, static_cast<int>(parsed.option_or("baud", 115200, 300, 4000000)),
                        static_cast<int>(parsed.option_or("unit", 1, 1, 247)), face_);
    } else {
      wrong(url);
    }
  }
  ModbusFace& face() { return face_; }
  std::string bound_url() const { return wire_->bound_url(); }

 private:
  [[noreturn]] static void wrong(const std::string& url) {
    throw Error("Modbus server", "'" + url + "' is no address to serve",
                "tcp://127.0.0.1:PORT or rtu:///dev/pts/N?baud=115200&unit=1");
  }

  ModbusFace face_;
  std::unique_ptr<ModbusWire> wire_;  // last: its thread uses the face
};

ModbusServer::ModbusServer(const std::string& url, const RidenRatings& ratings)
    : impl_(std::make_unique<Impl>(url, ratings)) {}
ModbusServer::~ModbusServer() = default;
std::string ModbusServer::bound_url() const { return impl_->bound_url(); }
ExcitationCommand ModbusServer::command() const { return impl_->face().command(); }
void ModbusServer::set_readback(const ExcitationReadback& readback) { impl_->face().set_readback(readback); }

}  // namespace imrig::plant
