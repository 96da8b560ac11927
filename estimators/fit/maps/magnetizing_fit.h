#pragma once
// The fit of (11): for a given knee the map is linear in L_0, b, c,
//   L_m = L_0 + b max(0, I_d - knee) + c max(0, I_d - knee)^2,
// so k_1 = c, k_2 = b - 2 c knee, k_3 = L_0 - b knee + c knee^2; the knee is scanned and then refined.

#include "estimators/fit/maps/parameter_maps.h"

namespace imrig::est {

struct MagnetizingSample {
  double I_d_A = 0.0;
  double L_m_H = 0.0;
  double relative_sigma = 1e-3;
  std::size_t record = 0;
};

// Without value when there are too few samples. gain_sigma: relative.
MagnetizingMap fit_magnetizing(const std::vector<MagnetizingSample>& samples, double gain_sigma);

}  // namespace imrig::est
