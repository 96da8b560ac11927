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
#include "estimators/model/frame_record.h"

namespace imrig::est {

inline constexpr int kCircuit = 4;                        // R_s, R_r, L_l, L_m
inline constexpr int kLinear = 4;                         // complex: psi_s(0), psi_r(0), epsilon, offset
inline constexpr int kUnknowns = kCircuit + 2 * kLinear;  // real and imaginary parts one after the other

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
  // steps: integration steps per sample, the same at every theta so that the error is smooth. faults: look
  // for those of the voltage channels.
  RecordProblem(const FrameRecord& record, int steps, bool faults);

  const FrameRecord& record() const { return record_; }
  std::size_t judged() const { return record_.size() - record_.judged_from; }
  int steps() const { return steps_; }
  double signal() const;  // sum |i|^2 over the judged samples
  // The unknowns behind the circuit: initial fluxes, and the voltage's faults where they can be told.
  const std::vector<int>& linear_unknowns() const { return linear_unknowns_; }

  // The error with the best linear unknowns.
  double error(const MachineParameters<double>& theta) const;

  // rows: where not null, gets the rows of the judged samples.
  Linearization linearize(const MachineParameters<double>& theta,
                          std::vector<SampleRows>* rows = nullptr) const;

 private:
  using Coefficients = Eigen::Matrix<std::complex<double>, kLinear, 1>;
  struct Responses {
    std::vector<std::complex<double>> driven;
    std::vector<Eigen::Matrix<std::complex<double>, kLinear, 1>> linear;  // per sample
    Coefficients best;
  };
  Responses responses(const MachineParameters<double>& theta) const;

  const FrameRecord& record_;
  int steps_;
  FrameRecord mirrored_, offset_;  // the record with its voltage replaced by v* and by a constant, in the
                                   // frame; empty where not used
  std::vector<int> linear_unknowns_;
};

}  // namespace imrig::est
