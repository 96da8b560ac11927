#include "rig/base/url.h"

#include <fmt/format.h>

#include <charconv>
#include <string_view>

#include "rig/base/error.h"

namespace imrig {

namespace {

constexpr std::size_t kMaxLength = 512;

[[noreturn]] void bad(const std::string& text, const std::string& what) {
  throw Error(fmt::format("address '{:.60}'", text), what,
              "wanted is SCHEME://HOST:PORT or SCHEME:///PATH, with ?KEY=NUMBER&... behind it");
}

long whole_number(const std::string& text, std::string_view digits, long high) {
  long value = -1;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc() || end != digits.data() + digits.size() || value < 0 || value > high) {
    bad(text, fmt::format("'{:.40}' is no whole number from 0 to {}", digits, high));
  }
  return value;
}

void parse_options(Url& url, std::string_view rest) {
  while (!rest.empty()) {
    const std::string_view pair = rest.substr(0, rest.find('&'));
    rest.remove_prefix(std::min(rest.size(), pair.size() + 1));
    const std::size_t equals = pair.find('=');
    if (equals == 0 || equals == std::string_view::npos)
      bad(url.text, fmt::format("'{:.40}' is no KEY=NUMBER", pair));
    const std::string key(pair.substr(0, equals));
    if (!url.options.emplace(key, whole_number(url.text, pair.substr(equals + 1), 1'000'000'000)).second) {
      bad(url.text, fmt::format("'{}' is given twice", key));
    }
  }
}

}  // namespace

long Url::option_or(const std::string& key, long fallback, long low, long high) const {
  const auto found = options.find(key);
  if (found == options.end()) return fallback;
  if (found->second < low || found->second > high) {
    bad(text, fmt::format("{} lies outside {} to {}", key, low, high));
  }
  return found->second;
}

Url parse_url(const std::string& text) {
  if (text.size() > kMaxLength) bad(text, "too long");
  Url url;
  url.text = text;
  const std::size_t mark = text.find("://");
  if (mark == 0 || mark == std::string::npos) bad(text, "no scheme");
  url.scheme = text.substr(0, mark);
  std::string_view rest = std::string_view(text).substr(mark + 3);
  if (const std::size_t question = rest.find('?'); question != std::string_view::npos) {
    parse_options(url, rest.substr(question + 1));
    rest = rest.substr(0, question);
  }
  if (rest.empty()) bad(text, "nothing behind the scheme");
  if (rest.front() == '/') {
    url.path = rest;
    return url;
  }
  const std::size_t colon = rest.rfind(':');
  if (colon == 0 || colon == std::string_view::npos) bad(text, "no port");
  url.host = rest.substr(0, colon);
  url.port = static_cast<int>(whole_number(text, rest.substr(colon + 1), 65535));
  return url;
}

}  // namespace imrig
