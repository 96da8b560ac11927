#pragma once
// Steady stretches of a record whose shaft torque was measured. The torque there is judged as a balance,
//   T_shaft = T_airgap(psi_s, i_s measured) - friction - stray load loss,
// psi_s from the measured voltage, so that neither the slip nor R_r decides it: what is left over is a loss
// between air gap and shaft, or the transducer. Where the speed moves, the rotor's inertia takes its share;
// nobody knows it, so such stretches count less, or not at all.

#include <cstddef>
#include <string>
#include <vector>

#include "estimators/model/frame_record.h"

namespace imrig::est {

struct TorqueWindow {
  std::size_t from = 0, to = 0;    // samples of the frame
  double mean_Nm = 0.0;            // measured
  double samples = 0.0;            // that were measured
  double noise_Nm = 0.0;           // one sigma of that mean, as the samples scatter from one to the next
  double hidden_Nm = 0.0;          // what a drift of the speed may hide
  double apparent_Nm = 0.0;        // (3/2) n_p |v| |i| / w_e
  double power_Nm = 0.0;           // (3/2) n_p Re(v i*) / w_e, and
  double copper_Nm_per_ohm = 0.0;  // what each ohm of R_s takes of it: what is left is the air gap's, roughly
  double sigma_Nm = 0.0;           // of the balance, all told
};

// torque_Nm: of the series, by its samples; `thinned` of them are one sample of the frame. Windows hold whole
// periods of the supply. Empty where there is no field or the shaft stands still.
std::vector<TorqueWindow> torque_windows(const std::vector<double>& torque_Nm, const FrameRecord& frame,
                                         int thinned);

// Fills sigma_Nm: what a torque bridge and a power meter are good for beside noise. range_Nm: of the bridge,
// by what it has shown elsewhere; declared_Nm: one sigma of its sample, NaN where nothing is known.
void weigh(std::vector<TorqueWindow>& windows, double range_Nm, double declared_Nm);

// What the bridge must reach at least: what it showed, and a good part of what the terminals' power could
// make. 0 without windows.
double torque_range_Nm(const std::vector<TorqueWindow>& windows);

// Whether a measured torque can be the shaft's at all: over the windows it must follow the air gap's by a
// factor near one, with friction, and R_s as the windows have it where they are many and differ; R_s_ohm is
// rough. What is wrong (sign, unit, scale, nothing but zeros), or empty.
std::string torque_contradiction(const std::vector<const TorqueWindow*>& windows, double R_s_ohm);

}  // namespace imrig::est
