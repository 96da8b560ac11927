#pragma once
// R_s against the winding's temperature, from DC records at several temperatures (Proca and Keyhani 2002,
// figure 2):
//   R_s(T) = R_20 (1 + alpha (T - 20 C))
// a straight line by weighted least squares, its interval from record to record. The gains of the sensors scale
// R_20 and leave alpha alone.

#include <string>
#include <vector>

#include "estimators/model/model.h"

namespace imrig::est {

inline constexpr double kLeastSpread_C = 10.0;  // of the temperatures, for a slope

struct ResistancePoint {
  std::string record;
  double stator_C = kMissing;
  double R_s_ohm = kMissing;
  double sigma_ohm = kMissing;
};

struct ResistanceLine {
  std::string failure;  // why there is no line; empty when there is
  Parameter R_20;       // ohm
  Parameter alpha;      // 1/K, relative to R_20
  std::vector<ResistancePoint> points;
  double at(double stator_C) const;  // ohm; R_20 where the temperature is not known
  double sigma_at(double stator_C) const;  // without the gains
  double covariance[3] = {0.0, 0.0, 0.0};  // of (R_20, slope): vv, vs, ss
};

// gain_sigma: relative, of every impedance.
ResistanceLine resistance_line(const std::vector<ResistancePoint>& points, double gain_sigma);

}  // namespace imrig::est
