#pragma once
// Parameters mapped to operating conditions (Proca and Keyhani 2002, section V), from the steady phasors of all
// records (steady_phasor.h), which see the secant inductances that the maps are about:
//   L_m(I_d) = L_0 below the knee, k_1 I_d^2 + k_2 I_d + k_3 above it, joined continuously     (11)
//   L_l(I)   = k_4 I + k_5                                                                      (12)
//   R_r      = kappa (R_1(T) + k_6 w_s)                                                         (13)
// or, in place of k_6 w_s, the bend of deep_bar.h.
// L_m from no-load records (from slips below the slip rule where there are none): there an error of L_l matters
// least. L_l where the main flux does not saturate (map within 3 % of L_0) and the load current makes it seen.
// R_r from slips above the slip rule, less what the iron takes. kappa = (L_mT/L_r)^2 over its unsaturated value
// (T circuit, equal leakages): the same cage seen through a saturated main flux; 1 at small flux.
// A function of the rotor flux's current alone cannot follow a machine whose air gap saturates: under load the
// same I_d goes with less saturation. What that leaves is told (load_misfit).

#include <map>
#include <string>
#include <vector>

#include "estimators/fit/losses/core_loss.h"
#include "estimators/fit/maps/locked_sweep.h"
#include "estimators/fit/maps/resistance_line.h"
#include "estimators/fit/maps/steady_phasor.h"
#include "estimators/model/model.h"

namespace imrig::est {

struct MagnetizingMap {
  Parameter L_0;            // H
  Parameter k_1, k_2, k_3;  // H/A^2, H/A, H
  double knee_A = kMissing;
  double lowest_A = kMissing, highest_A = kMissing;  // of I_d in the records
  double misfit = kMissing;                          // rms, relative
  double load_misfit = kMissing;                     // mean of measured over map, less one, of loaded saturated points
  bool known() const { return L_0.known(); }
  double at(double I_d_A) const;  // held at the ends beyond the records
};

struct LeakageMap {
  Parameter k_4, k_5;  // H/A, H; k_4 without value: constant
  double lowest_A = kMissing, highest_A = kMissing;
  double misfit = kMissing;
  bool known() const { return k_5.known(); }
  double at(double I_A) const;  // peak; held at the ends beyond the records
};

struct RotorMap {
  Parameter R_1;  // ohm, unsaturated, at reference_C of the winding
  Parameter per_K;
  Parameter k_6;  // ohm s
  DeepBar bar;    // where the sweep shows it: then in k_6's place
  double reference_C = kMissing;
  double misfit = kMissing;
  bool known() const { return R_1.known(); }
  double at(double w_s, double stator_C, double kappa = 1.0) const;
  // What the slip frequency adds to an R_1.
  double skin_ohm(double w_s, double R_1) const;
};

// One steady window with what the maps make of it.
struct MapPoint {
  SteadyPhasor phasor;
  CircuitState state;  // with the mapped R_s, L_l, R_c
  double kappa = 1.0;
  double L_l_H = kMissing;              // where it can be told
  bool for_L_m = false, for_L_l = false, for_R_r = false;
  std::string left_out;                 // why it is in no map
};

struct ParameterMaps {
  std::string failure;
  ResistanceLine R_s;
  MagnetizingMap L_m;
  LeakageMap L_l;
  RotorMap R_r;
  LockedResult locked;
  CoreLossResult core;
  std::vector<MapPoint> points;
  std::vector<std::string> notes;
};

struct MapOptions {
  double slip_rule = 0.02;
  double R_s_fallback = kMissing;  // where no DC record is
  double L_m_given = kMissing;     // where no running record tells it
  double L_l_start = kMissing;     // of the transient fits; NaN: a tenth of the no-load inductance
};

// used: the records that may be fitted (hold-out left out). DC results as measured.
ParameterMaps map_parameters(const DataSet& data, const std::vector<std::size_t>& used,
                             const std::vector<ResistancePoint>& dc, const MapOptions& options);

// kappa of an inverse-gamma L_m against the unsaturated one.
double rotor_share(double L_m, double L_m_unsaturated, double L_l);

}  // namespace imrig::est
