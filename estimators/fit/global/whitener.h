#pragma once
// From what measurement noise does to a simulation's error to errors that are white with unit variance.
//
// The model is driven by measured voltage and speed on straight lines between samples, so their noise passes
// through it and colours the error:
//   x[k+1] = F x[k] + (h/2) (F b n[k] + b n[k+1]) + c d[k],   r[k] = C x[k] + m[k]
// x: error of (psi_s, psi_r), n: voltage noise, d: speed noise (j psi_r d on the rotor flux), m: current
// noise, C = (1, -1)/L_l. With n[k] as a third state this is a linear system, and the innovations of its
// Kalman filter are white: feeding the error r through the filter whitens it, and feeding the columns of its
// Jacobian through the same filter makes least squares the maximum of the likelihood. The initial flux is a
// parameter, so the filter starts with certainty.
//
// Where the voltage jumps, nobody knows where between two samples it did: the flux behind it is uncertain by
// |dv| h/sqrt(12), h the series' own sample time, and the sample itself by what thinning smooths away.
// Complex variances are those of both components together.

#include <Eigen/Core>
#include <algorithm>
#include <complex>
#include <cstdint>
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
    Eigen::Matrix2cd F;      // of the fluxes
    Eigen::Vector2cd input;  // from the voltage noise of this sample
    Eigen::Vector3cd K;
    double weight = 1.0;  // 1/sigma of each component of the innovation
  };
  const Step& step(std::size_t k) const { return steps_[number_[k]]; }
  std::complex<double> output(std::complex<double> stator, std::complex<double> rotor) const {
    return inverse_leakage_ * (stator - rotor);
  }
  // Mean square of the error (both components) that noise alone leaves, over the judged samples: A^2.
  double noise_power_A2() const { return noise_power_; }
  // What may come to it where voltages always jump at the same place between two samples (a generator's steps
  // do): the flux is off by |dv| h/2 then, each time.
  double edge_power_A2() const { return edge_power_; }
  // Variance of that mean square over many records like this one, A^4: slow noise leaves few independent
  // samples.
  double noise_power_variance() const { return noise_power_variance_; }

 private:
  std::vector<Step> steps_;
  std::vector<std::uint32_t> number_;  // of the step that each sample takes
  double inverse_leakage_;
  double noise_power_ = 0.0, edge_power_ = 0.0, noise_power_variance_ = 0.0;
};

}  // namespace imrig::est
