#pragma once
// Quantile of Student's t distribution for two-sided 95 % intervals: exact table for few degrees of freedom,
// then the Cornish-Fisher expansion (Abramowitz and Stegun 26.7.5), good to 1e-4 from 30 on.

#include <array>
#include <cstddef>

namespace imrig::est {

inline constexpr double kNormal975 = 1.959963984540054;

inline double student_t_975(double degrees_of_freedom) {
  static constexpr std::array<double, 30> kTable{
      12.7062, 4.3027, 3.1824, 2.7764, 2.5706, 2.4469, 2.3646, 2.3060, 2.2622, 2.2281,
      2.2010,  2.1788, 2.1604, 2.1448, 2.1314, 2.1199, 2.1098, 2.1009, 2.0930, 2.0860,
      2.0796,  2.0739, 2.0687, 2.0639, 2.0595, 2.0555, 2.0518, 2.0484, 2.0452, 2.0423};
  if (degrees_of_freedom < 1.0) return kTable[0];
  const auto whole = static_cast<std::size_t>(degrees_of_freedom);
  if (whole <= kTable.size()) return kTable[whole - 1];
  constexpr double z = kNormal975;
  const double n = degrees_of_freedom;
  return z + (z * z * z + z) / (4.0 * n) +
         (5.0 * z * z * z * z * z + 16.0 * z * z * z + 3.0 * z) / (96.0 * n * n);
}

}  // namespace imrig::est
