#pragma once
// What the running estimators take from a model: base parameters with their doubts, how both resistances follow
// temperature and slip, iron loss, saturation. A parameter without an interval counts as known to kNominalSigma.
// Temperature coefficients come from the model's R_s and R_r maps or its heating effects; without them copper's
// and aluminium's, 1/(234.5 + T) and 1/(225 + T) (IEC 60034-2-1).

#include <cstdint>
#include <string>

#include "estimators/model/effects/effect_list.h"
#include "estimators/model/model.h"
#include "estimators/online/r_r_observer/rotor_resistance.h"

namespace imrig::est {

inline constexpr double kNominalSigma = 0.05;

struct MotorKnowledge {
  int pole_pairs = 2;
  MachineParameters<double> base;
  MachineParameters<double> sigma;  // relative, one sigma each
  SharedVector<double> shared;      // with the effects
  bool has_effects = false;         // that change the current
  double R_s_reference_C = 25.0, R_s_per_K = 0.0;
  double R_1_ohm = 0.0, k_6_ohm_s = 0.0, k_6_sigma = 0.0;  // sigma in ohm s
  double R_1_reference_C = 25.0, R_1_per_K = 0.0;
  double eddy_S = 0.0, hysteresis_S_rad_s = 0.0, iron_place = 1.0;
  MagneticCurve saturation;

  double R_s_ohm(double stator_C) const;    // NaN: at the reference
  double stator_C(double R_s_ohm) const;    // and back
  double rotor_C(double R_1_ohm) const;
  double iron_S(double w_e_rad_s) const;
  RotorCircuit circuit(double R_s_ohm, double R_r_near_ohm, double w_e_rad_s) const;
};

// Throws Error where the model lacks a base parameter.
MotorKnowledge knowledge_of(const Model& model);

}  // namespace imrig::est
