#pragma once
// Fundamental phasors of the steady parts of a record. Over a window of n samples, with Hann weights g_k and
// the supply's frequency w_e refined until the phase of the voltage stands still between the window's halves,
//   X = sum g_k x_k exp(-j w_e t_k) / sum g_k,   V = (1 + j w_e tau_v) X_v,   I = X_i
// tau_v being the time constant of the filter that the voltage channels passed and the currents did not: for a
// phasor it is undone exactly. The rig's inverter holds its mean voltage from sample to sample; the filter's
// answer to such steps, sampled, lags by h^2/(12 tau_v) more than its answer to a sinusoid (1.9 us at 60 us and
// 160 us: 1.4 mrad at 120 Hz), which is undone too: (1 - a z)/((1 - a) z) (1 - z)/(j w h), z = exp(-j w h),
// a = exp(-h/tau_v). Offsets, negative sequence and harmonics fall into the window's zeros. At
// standstill the current may also swing along one axis; then X is twice the part that turns forward, which
// obeys the same impedance.
//   circuit (inverse gamma):  psi_r = (V - R_s I)/(j w_e) - L_l I,   I_d + j I_q = I |psi_r| / psi_r
//   L_m = |psi_r| / I_d,      R_r = w_s |psi_r| / (I_q - w_e |psi_r| / R_c),   w_s = w_e - w_r
// Source: Proca and Keyhani 2002 (9) without its division by the slip.

#include <complex>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "rig/data/record.h"

namespace imrig::est {

struct SteadyPhasor {
  std::size_t record = 0;  // index in the data set
  double w_e = 0.0;        // electrical rad/s, positive
  double w_r = 0.0;        // electrical, counted in the direction of the field
  std::complex<double> v;  // V, peak, at the motor's terminals
  std::complex<double> i;  // A, peak
  double stator_C = kMissing;
  double time_s = kMissing;      // middle of the window on the device's clock; of imported files within the record
  double samples = 0.0;          // that the window's weights come to, for the noise of a mean
  double slip_sigma = kMissing;  // of w_e - w_r, rad/s, from the scatter of the speed within the window
  bool last = false;             // the record's last steady window

  double slip_rad_s() const { return w_e - w_r; }
  double input_W() const { return 1.5 * (v * std::conj(i)).real(); }
};

// What a phasor says once R_s and L_l are given.
struct CircuitState {
  double psi_r_Wb = kMissing;
  double I_d_A = kMissing;  // stator current along the rotor flux
  double I_q_A = kMissing;  // across it
  double L_m_H = kMissing;
  double R_r_ohm = kMissing;  // NaN where there is no slip to speak of
};
CircuitState circuit_state(const SteadyPhasor& phasor, double R_s, double L_l,
                           double R_c = std::numeric_limits<double>::infinity());

// The steady windows of a running record: before a voltage step (where the record names its segments) and the
// last part. A window whose halves differ by more than 0.5 % in voltage or admittance or by 0.2 % in speed is left out.
// Empty when nothing is steady, the series cannot be used, or the shaft stands still.
std::vector<SteadyPhasor> running_phasors(const DataSet& data, std::size_t record);

// The phasor of a record at standstill (kind locked_sweep), from its second half on or all of it; nothing when
// the shaft moves or there is no single frequency.
std::vector<SteadyPhasor> standing_phasors(const DataSet& data, std::size_t record);

}  // namespace imrig::est
