#pragma once
// How fast the emulator's clock runs: in real time, N times as fast, or as fast as it can. Sample k is due at
// origin + k T / N on the host's monotonic clock. In real time the origin never moves: who is late catches
// up. At pace N the time spent waiting for credit is no debt: the origin moves.

#include <cstdint>
#include <string>

namespace imrig::plant {

struct Pace {
  enum class Kind { kRealtime, kTimes, kMax };
  Kind kind = Kind::kRealtime;
  double times = 1.0;  // of kTimes
  bool waits_for_credit() const { return kind != Kind::kRealtime; }
};

// "realtime", a number above 0 and up to 10000, or "max". Throws Error.
Pace parse_pace(const std::string& word);

class PaceClock {
 public:
  PaceClock(const Pace& pace, std::int64_t sample_time_ns);
  // Sample `index` is due now; later ones follow from there.
  void start(std::int64_t now_us, std::int64_t index);
  // How many samples from `index` on may be taken by now; at most `most`.
  int due(std::int64_t now_us, std::int64_t index, int most) const;
  // When sample `index` is due, us; never in the future at pace max.
  std::int64_t due_us(std::int64_t index) const;
  // The device waited for credit at `index` until now (pace N: no debt).
  void waited(std::int64_t now_us, std::int64_t index);

 private:
  Pace pace_;
  double us_per_sample_;
  std::int64_t origin_us_ = 0;
  std::int64_t origin_index_ = 0;
};

}  // namespace imrig::plant
