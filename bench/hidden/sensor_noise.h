#pragma once
// Noise of the sensors that is not what a data sheet says: stronger or weaker, coloured, heavy-tailed, or
// declared wrongly. What is not white and Gaussian takes the place of most of the plant's own noise.

#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace imrig::bench {

struct NoiseFlavour {
  std::string name;
  double scale = 1.0;     // of the machine's noise
  double declared = 1.0;  // declared over true sigma
  double colour = 0.0;    // pole of the noise from one sample of 60 us to the next
  bool heavy = false;     // Student's t of four degrees of freedom

  bool own() const { return colour > 0.0 || heavy; }
  // The plant keeps this share of white noise, so that its converters go on dithering; the rest is flavoured.
  double white_share() const { return own() ? 0.4 : 1.0; }
};

const std::vector<NoiseFlavour>& noise_flavours();

// One channel's noise of unit variance.
class FlavouredNoise {
 public:
  FlavouredNoise(const NoiseFlavour& flavour, std::uint64_t seed) : flavour_(flavour), bits_(seed) {}
  double next();

 private:
  NoiseFlavour flavour_;
  std::mt19937_64 bits_;
  std::normal_distribution<double> normal_;
  std::student_t_distribution<double> heavy_{4.0};
  double state_ = 0.0;
};

}  // namespace imrig::bench
