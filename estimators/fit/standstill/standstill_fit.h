#pragma once
// Output-error fit of a standstill record: R_s, R_r, L_l, L_m (inverse-gamma) and three nuisances - both
// initial fluxes and a constant current, which holds both sensors' zeros - minimize sum (i_predicted - i)^2,
// the prediction driven by the measured voltage (standstill_response.h). No noise of the current enters the
// prediction, so it leaves no bias; white noise of the voltage does, sigma_v^2 h |G|^2 per sample with the
// H_2 norm
//   |G|^2 = (b_1^2 a_0 + b_0^2)/(2 a_0 a_1),   G = (b_1 s + b_0)/(s^2 + a_1 s + a_0),
// whose pull -H^-1 (N/2) sigma_v^2 h d|G|^2/dtheta is subtracted.
// Intervals: the record is cut into blocks, and the estimate without each block (one Gauss-Newton step) gives
// the jackknife covariance, Student's t with as many degrees of freedom as blocks less one; never less than
// white noise says. An R_s from elsewhere (a dc test) enters as one more measurement of ln R_s, weighed by
// both sigmas. Excitation: amplification_k = sqrt((J'J)^-1_kk sum i^2) is the relative change of parameter k
// by a misfit of the current of the same relative size in the worst pattern. Two tones give four numbers and
// are enough; one is not.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "estimators/fit/standstill/axis_record.h"
#include "estimators/model/convert.h"

namespace imrig::est {

inline constexpr std::size_t kStandstillParameters = 4;
inline constexpr std::array<const char*, kStandstillParameters> kStandstillNames{"R_s", "R_r", "L_l", "L_m"};

struct KnownResistance {
  double value_ohm = 0.0;
  double relative_sigma = 0.0;  // > 0; the sensors' gains included, which differ from axis to axis
};

struct StandstillFitOptions {
  Noise noise;  // of the data set; what is NaN is taken from the residual
  std::optional<MachineParameters<double>> nominal;  // one more start
  std::optional<KnownResistance> R_s;
  int blocks = 20;
  double most_amplification =
      100.0;  // above, a record cannot separate the parameter: 0.1 % of misfit moves it by 10 %
  double most_relative_sigma = 0.1;  // likewise
};

struct StandstillFit {
  std::string failure;  // empty when the fit stands
  MachineParameters<double> theta;
  std::array<double, kStandstillParameters>
      sigma{};  // relative, one sigma; widened to the normal's 95 % quantile
  std::array<double, kStandstillParameters> amplification{};  // see above
  std::array<double, kStandstillParameters> noise_bias{};     // relative, already subtracted
  // The T circuit with L_s = L_r, and the relative sigmas of its R_r, L_s, L_m.
  TCircuit t;
  double sigma_R_r_t = kMissing, sigma_L_s = kMissing, sigma_L_m_t = kMissing;
  double residual_A = kMissing;  // rms
  double current_A = kMissing;   // rms of the current that changes
  double nrmse = kMissing;
  double chi2_per_dof = kMissing;  // against the declared noise; NaN without it
  int iterations = 0;
};

StandstillFit fit_standstill(const AxisRecord& record, const StandstillFitOptions& options = {});

}  // namespace imrig::est
