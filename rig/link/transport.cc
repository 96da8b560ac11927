#include "rig/link/transport.h"

#include "rig/base/error.h"
#include "rig/base/url.h"
#include "rig/link/serial_transport.h"
#include "rig/link/udp_transport.h"

namespace imrig {

namespace {
constexpr char kForms[] =
    "wanted is udp://HOST:PORT, udp-listen://HOST:PORT or serial:///dev/NAME?baud=NUMBER";

void only_option(const Url& url, const std::string& key) {
  for (const auto& [name, value] : url.options) {
    if (name != key) throw Error("link '" + url.text + "'", "option '" + name + "' is unknown", kForms);
  }
}
}  // namespace

std::unique_ptr<Transport> open_transport(const std::string& text) {
  const Url url = parse_url(text);
  if (url.scheme == "serial" && !url.path.empty()) {
    only_option(url, "baud");
    return open_serial(url);
  }
  const bool listens = url.scheme == "udp-listen";
  if ((!listens && url.scheme != "udp") || url.host.empty())
    throw Error("link '" + text + "'", "no such link", kForms);
  only_option(url, "");
  if (!listens && url.port == 0) throw Error("link '" + text + "'", "port 0 is nobody's", kForms);
  return open_udp(url, listens);
}

}  // namespace imrig
