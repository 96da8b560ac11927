#pragma once
// The operating conditions of a record: by what its error may depend.
//   f        fundamental of the voltage vector (of the current where there is no voltage)
//   slip     1 - n_p w_M / (2 pi f), means over the record
//   psi_s    (v - R_s i) / (j w) of the fundamentals       T = (3/2) n_p Im(psi_s* i_s)
// NaN where it has no meaning or cannot be had: no single frequency, no R_s, no measured temperature.

#include "rig/data/record.h"

namespace imrig {

struct Conditions {
  double f_Hz = kMissing;  // signed: positive turns a, b, c
  double v_V = kMissing;   // rms over the record of |v|, star-equivalent peak phase voltage
  double slip = kMissing;
  double i_A = kMissing;        // rms over the record of |i|, peak
  double psi_Wb = kMissing;     // |psi_s|, peak
  double torque_Nm = kMissing;  // measured shaft torque where there is one, else the air-gap torque
  double stator_C = kMissing;
  double speed_rad_s = kMissing;
};

// Of a table of points: each condition's mean over the points.
// R_s_ohm: star-equivalent stator resistance; NaN if unknown, then psi_Wb and the air-gap torque stay NaN.
Conditions conditions_of(const Record& record, int pole_pairs, double R_s_ohm = kMissing);
Conditions conditions_of(const SteadyPoint& point, int pole_pairs, double R_s_ohm = kMissing);

// Complex fundamental of a vector signal and its frequency.
struct Fundamental {
  double f_Hz = kMissing;  // NaN where the signal has no single frequency
  SpaceVector amplitude;   // at the first sample
  double share = 0.0;      // of the signal's mean square that is the fundamental, 0..1
};
Fundamental fundamental_of(const std::vector<SpaceVector>& x, double sample_time_s);

// R_s of the data set's dc records, V = R_s I averaged over them; NaN if there are none.
double dc_resistance_ohm(const DataSet& data);

}  // namespace imrig
