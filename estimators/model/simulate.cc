#include "estimators/model/simulate.h"

namespace imrig::est {

int steps_per_sample(const MachineParameters<double>& p, const FrameRecord& record) {
  double fastest = 0.0;
  for (const double w_r : record.w_r)
    fastest = std::max(fastest, std::max(std::abs(w_r), std::abs(w_r - record.w_k)));
  const double rate = (p.R_s + p.R_r) / p.L_l + p.R_r / p.L_m + fastest + std::abs(record.w_k);
  const double steps = std::ceil(rate * record.sample_time_s / kMaxRateStep);
  return static_cast<int>(std::clamp(steps, 1.0, 1000.0));
}

}  // namespace imrig::est
