#pragma once
// From what measurement noise does to a simulation's error to errors that are white with unit variance.
//
// The model is driven by measured voltage and speed, so their noise passes through it and colours the error:
//   x[k+1] = F x[k] + w[k],   r[k] = C x[k] + n[k],   x = error of (psi_s, psi_r), C = (1, -1)/L_l
// with w from voltage noise on psi_s and from speed noise, j psi_r dw, on psi_r. The innovations of that
// system's Kalman filter are white: feeding the error r through the filter whitens it, and feeding the
// columns of its Jacobian through the same filter makes least squares the maximum of the likelihood. The
// initial flux is a parameter, so the filter starts with certainty. Complex variances are those of both
// components together.

#include <Eigen/Core>
#include <complex>
#include <vector>

#include "estimators/fit/global/driven_record.h"
#include "estimators/model/base_machine.h"

namespace imrig::est {

// One sigma of each component of one sample of the series, star-equivalent; electrical speed.
struct NoiseLevels {
  double current_A = 0.0;
  double voltage_V = 0.0;
  double speed_rad_s = 0.0;
};

class Whitener {
 public:
  // theta: rough circuit of the machine; flux_Wb: rough size of the rotor flux.
  Whitener(const DrivenRecord& record, const MachineParameters<double>& theta, double flux_Wb,
           const NoiseLevels& noise);

  struct Step {
    Eigen::Matrix2cd F;
    Eigen::Vector2cd K;
    double weight = 1.0;  // 1/sigma of each component of the innovation
  };
  const Step& step(std::size_t k) const { return steps_[std::min(k / kHold, steps_.size() - 1)]; }
  std::complex<double> output(std::complex<double> stator, std::complex<double> rotor) const {
    return inverse_leakage_ * (stator - rotor);
  }
  // Mean square of the error (both components) that noise alone leaves, over the judged samples: A^2.
  double noise_power_A2() const { return noise_power_; }
  // Of the noise of the current channel alone.
  double current_power_A2() const { return current_power_; }

 private:
  static constexpr std::size_t kHold = 8;  // samples that share a step: the filter settles slowly
  std::vector<Step> steps_;
  double inverse_leakage_;
  double noise_power_ = 0.0;
  double current_power_ = 0.0;
};

}  // namespace imrig::est
