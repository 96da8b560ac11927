#pragma once
// Decoding of untrusted datagrams. LCM's generated C++ decoders believe the lengths inside a message: one
// datagram with a valid fingerprint and an array length of -1 throws std::length_error, a huge length reads
// past the datagram. Here every length is checked against the datagram's size before the decoder sees it.
// Decoded is only what
//   - has the type's fingerprint and 1 in the version field (the third field of every bus type),
//   - has exactly the size that its lengths ask for, with every length within the limit its .lcm file states,
//   - holds strings that end in NUL at their stated length and nowhere before.
// Numbers are not judged: NaN, unknown constants and absurd values pass, their readers decide.

#include <exception>
#include <optional>
#include <type_traits>

#include "rig/bus/bytes.h"

namespace imrig_msg {
class samples_t;
class series_t;
class points_t;
class record_t;
class remark_t;
class dataset_t;
class campaign_status_t;
}  // namespace imrig_msg

namespace imrig {

namespace guard {

inline constexpr std::int32_t kMaxTextBytes = 4096;  // of one string, its NUL included

// Fingerprint, version field, and at least the three first fields.
bool head_fits(Bytes data, std::int64_t fingerprint);

// True when the datagram's size is exactly what its length fields ask for. Types of fixed size need no walk.
template <class Message>
bool layout_fits(Bytes data) {
  static_assert(std::is_trivially_copyable_v<Message>,
                "a type with lengths inside needs its own walk in guarded_decode.cc");
  static const auto size = static_cast<std::size_t>(Message{}.getEncodedSize());
  return data.size() == size;
}
template <>
bool layout_fits<imrig_msg::samples_t>(Bytes data);
template <>
bool layout_fits<imrig_msg::series_t>(Bytes data);
template <>
bool layout_fits<imrig_msg::points_t>(Bytes data);
template <>
bool layout_fits<imrig_msg::record_t>(Bytes data);
template <>
bool layout_fits<imrig_msg::remark_t>(Bytes data);
template <>
bool layout_fits<imrig_msg::dataset_t>(Bytes data);
template <>
bool layout_fits<imrig_msg::campaign_status_t>(Bytes data);

}  // namespace guard

// Into a message that is kept: its arrays' memory is used again. False, and the message worthless, when the bytes
// are not exactly one well-formed message of this type. Never throws.
template <class Message>
bool guarded_decode_into(Bytes data, Message& message) {
  try {
    if (!guard::head_fits(data, Message::getHash()) || !guard::layout_fits<Message>(data)) return false;
    const int size = static_cast<int>(data.size());
    return message.decode(data.data(), 0, size) == size;
  } catch (const std::exception&) {
    return false;
  }
}

// The message, or nothing when the bytes are not exactly one well-formed message of this type. Never throws.
template <class Message>
std::optional<Message> guarded_decode(Bytes data) {
  std::optional<Message> message(std::in_place);
  if (!guarded_decode_into(data, *message)) message.reset();
  return message;
}

}  // namespace imrig
