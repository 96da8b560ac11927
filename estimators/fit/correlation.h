#pragma once
// Correlation of the records' parameters with their operating conditions, (10) and Table I of Proca and Keyhani
// 2002:
//   C_xy = sum (x_k - x)(y_k - y) / ((N - 1) sigma_x sigma_y)
// over the records that speak for the parameter. The paper's conditions are I_d, I_q (stator current along and
// across the rotor flux), I and w_s; the winding's temperature and the elapsed time stand beside them. The
// strongest partner is looked for among the paper's four and, separately, among all.

#include <array>
#include <string>
#include <vector>

#include "estimators/fit/identify.h"
#include "estimators/fit/maps/parameter_maps.h"

namespace imrig::est {

inline constexpr std::array<const char*, 6> kConditionNames{"I_d", "I_q", "I", "w_s", "stator_C", "time_s"};
inline constexpr std::size_t kPaperConditions = 4;

struct CorrelationRow {
  std::string parameter;  // L_m, R_r, L_l
  std::size_t records = 0;
  std::array<double, 6> value{};  // NaN where a condition does not vary or is not known
  int strongest = -1;        // among the paper's four; -1: none
  int strongest_of_all = -1;
};

// C_xy of two equally long lists; NaN with less than three values or without variation.
double correlation(const std::vector<double>& x, const std::vector<double>& y);

// Which records count: those the model was made from, or all whose computed covariance tells the parameter,
// those too that only the slip rule left out.
enum class Kept { kAsUsed, kByCovariance };

// Rows in the order L_m, R_r, L_l; a parameter with less than three records has no values.
std::vector<CorrelationRow> correlation_table(const std::vector<RecordResult>& records,
                                              const std::vector<MapPoint>& points, Kept kept = Kept::kAsUsed);

}  // namespace imrig::est
