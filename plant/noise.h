#pragma once
// Normal random numbers whose bits depend on the seed alone: the standard fixes std::mt19937_64 but not
// std::normal_distribution. Marsaglia's polar method (Marsaglia and Bray, SIAM Review 6, 1964).

#include <cmath>
#include <cstdint>
#include <random>

namespace imrig::plant {

class Noise {
 public:
  explicit Noise(std::uint64_t seed) : bits_(seed) {}

  double normal() {  // zero mean, variance one
    if (spare_ready_) {
      spare_ready_ = false;
      return spare_;
    }
    double x, y, square;
    do {
      x = uniform();
      y = uniform();
      square = x * x + y * y;
    } while (square >= 1.0 || square == 0.0);
    const double factor = std::sqrt(-2.0 * std::log(square) / square);
    spare_ = y * factor;
    spare_ready_ = true;
    return x * factor;
  }

 private:
  double uniform() { return static_cast<double>(bits_() >> 11) * 0x1p-52 - 1.0; }  // [-1, 1)

  std::mt19937_64 bits_;
  double spare_ = 0.0;
  bool spare_ready_ = false;
};

}  // namespace imrig::plant
