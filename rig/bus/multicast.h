#pragma once
// LCM's own complaints are many lines on stderr, and some URLs it accepts never deliver anything. So the URL
// and the route are checked first.

#include <string>

namespace imrig {

// The URL to hand to LCM: udpm://GROUP:PORT with ttl and recv_buf_size. The kernel's default receive buffer
// loses most of a burst, so a URL that names none gets 4 MiB, the size that lost nothing when it was
// measured. Throws Error: no such URL, group outside 224.0.0.0/4, port 0, unknown option, or no route to the
// group (and how to add one).
std::string checked_lcm_url(const std::string& url);

}  // namespace imrig
