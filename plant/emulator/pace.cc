#include "plant/emulator/pace.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "rig/base/error.h"

namespace imrig::plant {

Pace parse_pace(const std::string& word) {
  if (word == "realtime") return {Pace::Kind::kRealtime, 1.0};
  if (word == "max") return {Pace::Kind::kMax, 1.0};
  double times = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), times);
  if (error != std::errc() || end != word.data() + word.size() || !(times > 0.0 && times <= 10000.0)) {
    throw Error("--pace '" + word + "'", "is no pace",
                "wanted is realtime, max, or a number above 0 and up to 10000");
  }
  return {Pace::Kind::kTimes, times};
}

PaceClock::PaceClock(const Pace& pace, std::int64_t sample_time_ns)
    : pace_(pace), us_per_sample_(static_cast<double>(sample_time_ns) * 1e-3 / pace.times) {}

void PaceClock::start(std::int64_t now_us, std::int64_t index) {
  origin_us_ = now_us;
  origin_index_ = index;
}

std::int64_t PaceClock::due_us(std::int64_t index) const {
  if (pace_.kind == Pace::Kind::kMax) return origin_us_;
  return origin_us_ +
         static_cast<std::int64_t>(std::ceil(static_cast<double>(index - origin_index_) * us_per_sample_));
}

int PaceClock::due(std::int64_t now_us, std::int64_t index, int most) const {
  if (pace_.kind == Pace::Kind::kMax) return most;
  const auto until =
      origin_index_ + static_cast<std::int64_t>(static_cast<double>(now_us - origin_us_) / us_per_sample_);
  return static_cast<int>(std::clamp<std::int64_t>(until + 1 - index, 0, most));
}

void PaceClock::waited(std::int64_t now_us, std::int64_t index) {
  if (pace_.kind == Pace::Kind::kTimes && due_us(index) < now_us) start(now_us, index);
}

}  // namespace imrig::plant
