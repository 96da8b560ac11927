#pragma once
// Addresses of wires: "tcp://127.0.0.1:15020", "rtu:///dev/ttyUSB1?baud=115200&unit=1". SCHEME://HOST:PORT or
// SCHEME:///PATH, then ?KEY=NUMBER&KEY=NUMBER. Numbers are whole and at least 0.

#include <map>
#include <string>

namespace imrig {

struct Url {
  std::string text;  // as given, for messages
  std::string scheme;
  std::string host;  // empty for a path
  int port = 0;      // 0..65535
  std::string path;  // with its leading slash; empty for a host
  std::map<std::string, long> options;

  // The option's value, or the fallback; throws Error when it lies outside low..high.
  long option_or(const std::string& key, long fallback, long low, long high) const;
};

// Throws Error when the text is no such address.
Url parse_url(const std::string& text);

}  // namespace imrig
