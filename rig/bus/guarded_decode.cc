#include "rig/bus/guarded_decode.h"

#include <algorithm>
#include <cstdint>
#include <type_traits>

namespace imrig::guard {

namespace {

// Fingerprint, utime, seq, version.
constexpr std::size_t kHeadBytes = 8 + 8 + 8 + 4;

// Big-endian, as LCM writes; the caller has checked the size.
template <class Integer>
Integer big_endian(const std::uint8_t* at) {
  std::make_unsigned_t<Integer> value = 0;
  for (std::size_t k = 0; k < sizeof(Integer); ++k)
    value = static_cast<decltype(value)>((value << 8) | at[k]);
  return static_cast<Integer>(value);
}

// Walks the fields behind the head. Once a length is wrong it stays wrong.
class Walk {
 public:
  explicit Walk(Bytes data) : data_(data), ok_(data.size() >= kHeadBytes) {}

  Walk& skip(std::size_t bytes) {
    ok_ = ok_ && bytes <= data_.size() - at_;
    if (ok_) at_ += bytes;
    return *this;
  }

  // A length field: low..high, else the walk ends.
  std::size_t length(std::int32_t low, std::int32_t high) {
    if (!ok_ || data_.size() - at_ < 4) return fail();
    const auto value = big_endian<std::int32_t>(data_.data() + at_);
    if (value < low || value > high) return fail();
    at_ += 4;
    return static_cast<std::size_t>(value);
  }

  // A length field that is 0 or n, and its columns.
  Walk& optional_columns(std::size_t n, std::size_t bytes_a_row) {
    const std::size_t rows = length(0, static_cast<std::int32_t>(n));
    ok_ = ok_ && (rows == 0 || rows == n);
    return skip(rows * bytes_a_row);
  }

  // A string: its length counts the NUL at its end, which must be the only one.
  Walk& text() {
    const std::size_t bytes = length(1, kMaxTextBytes);
    if (!ok_ || bytes > data_.size() - at_) {
      ok_ = false;
      return *this;
    }
    const auto field = data_.subspan(at_, bytes);
    ok_ = std::find(field.begin(), field.end(), std::uint8_t{0}) == field.end() - 1;
    return skip(bytes);
  }

  bool done() const { return ok_ && at_ == data_.size(); }

 private:
  std::size_t fail() {
    ok_ = false;
    return 0;
  }

  Bytes data_;
  std::size_t at_ = kHeadBytes;
  bool ok_;
};

constexpr std::size_t kInt32 = 4;
constexpr std::size_t kInt64 = 8;
constexpr std::size_t kFloat = 4;
constexpr std::size_t kDouble = 8;
constexpr std::int32_t kMaxSamples = 256;
constexpr std::int32_t kMaxRows = 500;

}  // namespace

bool head_fits(Bytes data, std::int64_t fingerprint) {
  return data.size() >= kHeadBytes && data.size() <= 0x7fffffff &&
         big_endian<std::int64_t>(data.data()) == fingerprint &&
         big_endian<std::int32_t>(data.data() + kHeadBytes - 4) == 1;
}

template <>
bool layout_fits<imrig_msg::samples_t>(Bytes data) {
  Walk walk(data);
  walk.skip(3 * kInt64 + 4 * kInt32).skip(3 * kFloat + 2 * kInt32 + kFloat);
  const std::size_t n = walk.length(1, kMaxSamples);
  return walk.skip(n * (6 * 2 + kInt32)).done();
}

template <>
bool layout_fits<imrig_msg::series_t>(Bytes data) {
  Walk walk(data);
  walk.skip(kInt32 + kInt64 + 2 * kDouble);
  const std::size_t n = walk.length(1, kMaxRows);
  walk.skip(n * 2 * kDouble).optional_columns(n, 2 * kDouble);  // currents, voltages
  walk.optional_columns(n, kDouble)
      .optional_columns(n, kDouble)
      .optional_columns(n, kDouble);                                      // speed, torque, stator
  return walk.optional_columns(n, kInt32).optional_columns(n, 1).done();  // segment, gates
}

template <>
bool layout_fits<imrig_msg::points_t>(Bytes data) {
  Walk walk(data);
  walk.skip(kInt32);
  const std::size_t n = walk.length(1, kMaxRows);
  return walk.skip(n * 10 * kDouble).done();
}

template <>
bool layout_fits<imrig_msg::record_t>(Bytes data) {
  Walk walk(data);
  walk.skip(2 * kInt32).text().text().text();                    // id, kind, campaign
  walk.skip(kInt64 + 2 * kInt32 + 5 * kDouble + kInt32).text();  // repeat_of
  return walk.skip(kInt32 + kInt64).done();
}

template <>
bool layout_fits<imrig_msg::remark_t>(Bytes data) {
  return Walk(data).skip(kInt32).text().done();
}

template <>
bool layout_fits<imrig_msg::dataset_t>(Bytes data) {
  return Walk(data).text().skip(2 * kInt32 + 7 * kDouble).done();
}

template <>
bool layout_fits<imrig_msg::campaign_status_t>(Bytes data) {
  return Walk(data).skip(5 * kInt32).text().text().done();
}

}  // namespace imrig::guard
