#pragma once
// The least-squares problem of one record: minimize e = sum |i_hat(k; theta, c) - i(k)|^2 over the circuit
// theta = (R_s, R_r, L_l, L_m) and the initial fluxes c = (psi_s(0), psi_r(0)), equations (5) and (6) of
// Proca and Keyhani 2002 with both fluxes unknown. The machine is linear in c: i_hat = i_driven(theta) +
// h_s(theta) c_s + h_r(theta) c_r, so c is solved for exactly at each theta (variable projection, Golub and
// Pereyra 1973), and the gradient of the reduced error in theta is the partial one (the derivative in c
// vanishes). Motion and derivatives are those of sampled_machine.h: exact, no differences, no steps.

#include <Eigen/Core>
#include <array>
#include <vector>

#include "estimators/model/sampled_machine.h"

namespace imrig::est {

inline constexpr int kCircuit = 4;                        // R_s, R_r, L_l, L_m
inline constexpr int kLinear = 4;                         // complex: psi_s(0), psi_r(0), epsilon, offset
inline constexpr int kUnknowns = kCircuit + 2 * kLinear;  // real and imaginary parts one after the other

using Normal = Eigen::Matrix<double, kUnknowns, kUnknowns>;
using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;
using Signal = std::vector<std::complex<double>>;

// Around a point: unknowns in the order above, SI units; errors in A.
struct Linearization {
  double error = 0.0;       // A^2
  FluxState<double> start;  // the best initial fluxes there
  Normal normal;            // J' J
  Unknowns gradient;        // J' r, half the gradient of the error
};

// J column by column, one entry a sample, zero where it is not judged. The columns of c are those of its
// real parts; the imaginary part's is j times as large.
struct RecordColumns {
  std::array<Signal, kCircuit + kLinear> by;
  Signal residual;  // judged samples only
  Signal psi_r;     // Wb
};

class RecordProblem {
 public:
  // faults: look for those of the voltage channels. R_s: it is one of the unknowns.
  RecordProblem(const FrameRecord& record, bool faults, bool R_s);

  const FrameRecord& record() const { return record_; }
  SpeedRange speeds() const { return speeds_; }
  std::size_t judged() const { return record_.size() - record_.judged_from; }
  double signal() const;  // sum |i|^2 over the judged samples
  // The unknowns behind the circuit: initial fluxes, and the voltage's faults where they can be told.
  const std::vector<int>& linear_unknowns() const { return linear_unknowns_; }

  // The error with the best linear unknowns.
  double error(const MachineParameters<double>& theta) const;

  // Rows and columns of R_s stay zero where it is no unknown, unless columns are asked for.
  Linearization linearize(const MachineParameters<double>& theta, RecordColumns* columns = nullptr) const;

 private:
  using Coefficients = std::array<std::complex<double>, kLinear>;
  struct Responses {
    std::vector<std::array<std::complex<double>, kLinear + 1>> current;  // driven, and by each of c
    Coefficients best{};
  };
  Responses responses(const MachineParameters<double>& theta) const;
  template <int C>
  Responses responses_of(const MachineParameters<double>& theta) const;
  template <int C>
  Linearization linearize_from(int first, const MachineParameters<double>& theta, const Responses& response,
                               RecordColumns* columns) const;

  const FrameRecord& record_;
  SpeedRange speeds_;
  bool R_s_;
  Signal mirrored_, offset_;  // v* and a constant, in the frame; empty where not used
  std::vector<int> linear_unknowns_;
};

}  // namespace imrig::est
