#include "estimators/model/output.h"

#include "rig/base/error.h"

namespace imrig::est {

SteadyPoint predict_point(const MachineParameters<double>& machine, int pole_pairs,
                          const SteadyPoint& measured) {
  if (!(measured.v_peak_V > 0.0) || !(measured.f_Hz >= 0.0) || !std::isfinite(measured.speed_rad_s)) {
    throw Error("operating point", "lacks voltage, frequency or speed",
                "the model needs all three to predict the rest");
  }
  const double w_e = 2.0 * kPi * measured.f_Hz;
  const auto state =
      steady_state(machine, pole_pairs, measured.v_peak_V, w_e, pole_pairs * measured.speed_rad_s);
  SteadyPoint out = measured;
  out.i_peak_A = state.current_A;
  out.p_in_W = state.p_in_W;
  out.power_factor = state.power_factor;
  out.q_var = state.q_var;
  out.torque_Nm = state.torque_Nm;
  out.p_out_W = state.p_mech_W;
  return out;
}

}  // namespace imrig::est
