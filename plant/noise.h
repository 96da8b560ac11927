#pragma once
// Normal random numbers whose bits depend on the seed alone: the standard fixes no std::normal_distribution.
// The ziggurat of 256 layers of equal area (Marsaglia and Tsang, Journal of Statistical Software 5(8), 2000),
// exact by rejection: a point in layer k at x, uniform up to its width x_k, stands where |x| < x_(k+1), 98.8
// % of the time; else it is accepted under exp(-x^2/2), and beyond the base's end R an exponential does for
// the tail. Layer, sign and 53 bits of x come from disjoint bits of one draw. Bits: xoshiro256++ (Blackman
// and Vigna, ACM Trans. Math. Software 47(4), 2021), its state filled from the seed by splitmix64.

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

namespace imrig::plant {

class Noise {
 public:
  explicit Noise(std::uint64_t seed) {
    for (std::uint64_t& word : state_) {
      std::uint64_t z = seed += 0x9e3779b97f4a7c15ull;
      z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9ull;
      z = (z ^ z >> 27) * 0x94d049bb133111ebull;
      word = z ^ z >> 31;
    }
  }

  double normal() {  // zero mean, variance one
    for (;;) {
      const std::uint64_t draw = bits();
      const std::size_t k = draw & (kLayers - 1);
      const double x = static_cast<double>(static_cast<std::int64_t>(draw) >> 10) * 0x1p-53 * layers.x[k];
      if (std::abs(x) < layers.x[k + 1]) return x;
      if (k == 0) return std::copysign(beyond(), x);
      if (layers.f[k] + uniform() * (layers.f[k + 1] - layers.f[k]) < std::exp(-0.5 * x * x)) return x;
    }
  }

  double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }  // [0, 1)

 private:
  static constexpr std::size_t kLayers = 256;
  static constexpr double kR = 3.6541528853610088;  // 256 layers of equal area end at the top

  struct Layers {
    std::array<double, kLayers + 1> x{}, f{};  // half widths from the base up, and the density there
    Layers() {
      const double base = std::exp(-0.5 * kR * kR);
      const double area = kR * base + std::sqrt(std::acos(-1.0) / 2.0) * std::erfc(kR / std::sqrt(2.0));
      x[0] = area / base, x[1] = kR, f[1] = base;
      for (std::size_t k = 2; k < kLayers; ++k) {
        f[k] = f[k - 1] + area / x[k - 1];
        x[k] = std::sqrt(-2.0 * std::log(f[k]));
      }
      f[kLayers] = 1.0;
    }
  };
  static inline const Layers layers;

  double beyond() {
    for (;;) {
      const double x = -std::log(1.0 - uniform()) / kR, y = -std::log(1.0 - uniform());
      if (2.0 * y > x * x) return kR + x;
    }
  }

  std::uint64_t bits() {
    auto& s = state_;
    const std::uint64_t result = std::rotl(s[0] + s[3], 23) + s[0], t = s[1] << 17;
    s[2] ^= s[0], s[3] ^= s[1], s[1] ^= s[2], s[0] ^= s[3], s[2] ^= t;
    s[3] = std::rotl(s[3], 45);
    return result;
  }

  std::array<std::uint64_t, 4> state_;
};

}  // namespace imrig::plant
