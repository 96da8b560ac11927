#pragma once
// The least-squares problem of one record: minimize e = sum |i_hat(k; theta, c) - i(k)|^2 over the circuit
// theta = (R_s, R_r, L_l, L_m) and the initial fluxes c = (psi_s(0), psi_r(0)), equations (5) and (6) of
// Proca and Keyhani 2002 with both fluxes unknown. The machine is linear in c: i_hat = i_driven(theta) +
// h_s(theta) c_s + h_r(theta) c_r, so c is solved for exactly at each theta (variable projection, Golub and
// Pereyra 1973), and the gradient of the reduced error in theta is the partial one (the derivative in c
// vanishes). Derivatives in theta come from ceres::Jet through the integration itself: exact for the discrete
// model, no differences.

#include <Eigen/Core>
#include <vector>

#include "estimators/model/base_machine.h"
#include "estimators/model/predict.h"

namespace imrig::est {

inline constexpr int kCircuit = 4;   // R_s, R_r, L_l, L_m
inline constexpr int kUnknowns = 8;  // and the real and imaginary parts of psi_s(0), psi_r(0)

using Normal = Eigen::Matrix<double, kUnknowns, kUnknowns>;
using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;

// Around a point: unknowns in the order above, SI units; errors in A.
struct Linearization {
  double error = 0.0;       // A^2
  FluxState<double> start;  // the best initial fluxes there
  Normal normal;            // J' J
  Unknowns gradient;        // J' r, half the gradient of the error
};

// One judged sample: two real rows of J, and the residual.
struct SampleRows {
  Unknowns real;
  Unknowns imaginary;
  std::complex<double> residual;
};

class RecordProblem {
 public:
  // steps: integration steps per sample, the same at every theta so that the error is smooth.
  RecordProblem(const FrameRecord& record, int steps) : record_(record), steps_(steps) {}

  const FrameRecord& record() const { return record_; }
  std::size_t judged() const { return record_.size() - record_.judged_from; }
  int steps() const { return steps_; }
  double signal() const;  // sum |i|^2 over the judged samples

  // The error with the best initial fluxes.
  double error(const MachineParameters<double>& theta) const;

  // rows: where not null, gets the rows of the judged samples.
  Linearization linearize(const MachineParameters<double>& theta,
                          std::vector<SampleRows>* rows = nullptr) const;

 private:
  const FrameRecord& record_;
  int steps_;
};

}  // namespace imrig::est
