#pragma once
// Which messages of a stream never arrived, by the seq that every message carries. A stream is what one
// sender numbers: a channel, on shared channels one instance or process, for samples one boot of the device;
// a campaign numbers all its messages in one sequence, whatever the channel. Commands only rise and are no
// stream; what imrig import wrote cannot be lost on the way.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "rig/bus/bytes.h"

namespace imrig {

// A message's place: the stream, and its number there.
struct StreamPlace {
  std::string stream;
  std::int64_t seq = 0;
};

// name is without prefix ("SAMPLES"). Nothing for channels that are no stream and for malformed messages.
std::optional<StreamPlace> stream_place(std::string_view name, Bytes data);

class StreamWatch {
 public:
  struct Stream {
    std::int64_t next = 0;
    std::int64_t received = 0;
    std::int64_t lost = 0;      // not arrived so far
    std::int64_t restarts = 0;  // the numbers began anew
  };

  // How many messages turn out missing with this one; -1 when one that was taken for lost has come late.
  std::int64_t see(const StreamPlace& place);
  const std::map<std::string, Stream>& streams() const { return streams_; }

 private:
  std::map<std::string, Stream> streams_;
};

}  // namespace imrig
