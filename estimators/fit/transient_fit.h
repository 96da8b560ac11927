#pragma once
// Output-error fit of one record: L_m, R_r, L_l (and R_s where nobody knows it) with both initial fluxes as
// unknowns, inside the bounds of Proca and Keyhani 2002, section III-B: 10 to 300 % of nominal, initial flux
// within 200 % of the saturation value. NLopt's SLSQP with exact derivatives (record_problem.h) finds the
// constrained minimum of the error over ln(theta); Gauss-Newton steps then bring it to a small part of a
// standard deviation. A fit that did not settle, or whose parameter lies on a bound, says so.

#include <array>
#include <string>
#include <vector>

#include "estimators/fit/transient_noise.h"

namespace imrig::est {

inline constexpr double kBoundFlux = 2.0;

struct TransientOptions {
  MachineParameters<double> nominal;  // bounds are relative to it; its R_s is the value used, unless fit_R_s
  std::vector<MachineParameters<double>>
      starts;  // tried in order of their error, best first; the nominal is always one of them
  bool bounds_move =
      false;  // the nominal is itself a guess from data: a bound that is hit is moved, up to three times
  bool fit_R_s = false;
  Noise noise;                      // declared; see transient_noise.h
  double saturation_flux_Wb = 0.5;  // for the bound of the initial fluxes
};

struct TransientFit {
  std::string failure;  // empty when it converged
  MachineParameters<double> theta;
  FluxState<double> start;  // Wb, in the frame, at the first sample
  std::array<bool, kCircuit> on_bound{};
  std::array<double, kCircuit>
      sensitivity{};  // S_y / I of (7)-(8) over the record: what a tenth of y moves the current
  bool flux_on_bound = false;
  TransientNoise noise;          // covariance and bias of theta; the bias is already subtracted
  double nrmse = kMissing;       // rms of the residual over rms of the current
  double residual_A = kMissing;  // rms per component
  int evaluations = 0;
};

TransientFit fit_transient(const FrameRecord& record, const TransientOptions& options);

}  // namespace imrig::est
