#pragma once
// What a physical effect of the fitted model says about itself, and the hooks by which it changes the base
// machine. One effect is one header beside this one: a class template over the scalar (double or ceres::Jet)
// with a static description and those hooks that it needs; the others are the identity. effect_list.h names
// them all, effect_machine.h puts them together.
//
// Parameters of an effect are
//   amplitudes  that vanish (take their neutral value) when the effect is absent: what a score test asks for
//   shapes      exponents, corners, places: without meaning while the amplitudes are neutral, so they are
//               scanned in a test and fitted afterwards
//   constants   references that are taken from the data once and never fitted
// and amplitudes that belong to each record by itself (a phase, a temperature nobody measures) are local.

#include <complex>
#include <cstddef>
#include <span>

#include "estimators/model/complex_pair.h"
#include "estimators/model/effects/saturation_law.h"
#include "estimators/model/effects/scalar.h"

namespace imrig::est {

enum class Role { kAmplitude, kShape, kConstant };

struct EffectParameter {
  const char* name;
  const char* unit;
  Role role;
  double neutral;  // of a shape: its usual value
  double low, high;
  double scale;                       // a change of this size matters to an engineer
  std::span<const double> scan = {};  // of a shape: values to try
  bool only_in_reach = false;         // of a shape: bounds are not nature's, they only keep a search in reach
  double start = 0.0;  // of a shape: where a search begins that frees it, if it stands outside its bounds
};

// One way to put an effect into numbers: which of its parameters are free. From plain to rich.
struct EffectForm {
  const char* name;
  std::span<const std::size_t> shared;  // of EffectInfo::shared
  bool local = false;                   // and those of EffectInfo::local
  bool richer = false;  // holds the form before it as a special case, to be tried once that is accepted
};

// Where an effect can be seen at all.
enum class Needs { kSeries, kAnything, kTorque };

struct EffectInfo {
  const char* name;
  const char* sentence;  // the physics, for people
  const char* equation;
  const char* source;
  const char* experiment;  // what separates it from its twins
  Needs needs;
  std::span<const EffectForm> forms;
  std::span<const EffectParameter> shared;      // one value for the motor
  std::span<const EffectParameter> local = {};  // one value a record
  const char* alike = "";                       // physics outside the library with the same equation
  bool correction = false;                      // of a sensor: never claimed, and not counted in the library
};

inline constexpr double kUnknown_C = -1e9;  // no temperature was measured

// Where a machine is in its record at one instant.
struct Instant {
  double w_k = 0.0;                       // speed of the frame, electrical rad/s
  std::complex<double> turn = 1.0;        // exp(j theta_k): from the frame to the stationary frame
  std::complex<double> rotor_turn = 1.0;  // exp(j (theta_r - theta_k)): from the rotor's frame to the frame
  std::complex<double> voltage_rate =
      0.0;  // dv/dt of the measured voltage in the stationary frame, V/s, seen in the frame
  double stator_C = kUnknown_C;  // measured winding temperature
  double sample_time_s = 0.0;    // over which what drives the motor is a mean
  std::complex<double> current = 0.0;  // measured, in the frame
  bool has_current = false;
  double speed_bend = 0.0;   // and again, rad/s^3
  double speed_rate = 0.0;   // of the measured speed, electrical rad/s^2
  double speed_sigma = 0.0;  // of a held speed that was rounded, electrical rad/s
};

// Stator current and rotor current (into the rotor's resistance), A: the gradients of the magnetic energy.
template <class T>
struct Currents {
  Cx<T> stator, rotor;
};

// Conductances of the iron at the stator flux and at the rotor flux, 1/ohm.
template <class T>
struct Iron {
  T at_stator{}, at_rotor{};
};

// How the iron bends away from the linear circuit (saturated_iron.h).
template <class T>
struct IronBends {
  struct Law {
    T extra{}, exponent{1.0}, bend{}, psi_ref_Wb{1.0}, onset{};
    SaturationCurve<T> curve() const { return {extra, exponent, bend, psi_ref_Wb, onset}; }
  };
  Law main{}, leakage{};
  bool main_live = false, leakage_live = false;
  T place{}, rotor_share{};

  IronBends<double> values() const {
    const auto law = [](const Law& l) {
      return IronBends<double>::Law{value_of(l.extra), value_of(l.exponent), value_of(l.bend),
                                    value_of(l.psi_ref_Wb), value_of(l.onset)};
    };
    return {law(main), law(leakage), main_live, leakage_live, value_of(place), value_of(rotor_share)};
  }
};

// Identity of every hook.
template <class T>
struct EffectLaw {
  // Electrical rotor speed, rad/s, from the measured one.
  void speed(T&, const Instant&) const {}
  // Voltage at the winding, V, from the measured one.
  void voltage(Cx<T>&, const Cx<T>& /*i_s*/, const Instant&) const {}
  // Once, when the machine is put together.
  void bend(IronBends<T>&) const {}
  // Factors on R_s and R_r.
  void stator_resistance(T&, const Instant&) const {}
  void rotor_resistance(T&, const Instant&) const {}
  // What multiplies R_s beside the current: A.
  void stator_asymmetry(Cx<T>&, const Cx<T>& /*i*/, const Instant&) const {}
  // Likewise R_r.
  void rotor_asymmetry(Cx<T>&, const Cx<T>& /*i_r*/, const Instant&) const {}
  void iron(Iron<T>&, const Instant&) const {}
  // Factor on R_r from the rotor flux and current, and w_r - w_k.
  void skin(T&, const Cx<T>& /*psi_r*/, const Cx<T>& /*i_r*/, const T& /*slip*/) const {}
  // The current of a deep layer: the bar's current less what the top carries (psi_r sees R_r (1 + rise)).
  void layer(T& /*rise*/, T& /*corner_rad_s*/) const {}
  // Shaft torque lost, N m; w_M mechanical; i at the terminals.
  void lost_torque(T&, const T& /*w_M*/, const Cx<T>& /*i_r*/, const Cx<T>& /*i*/) const {}
  // Current as the sensors show it.
  void measured_current(Cx<T>&, const Instant&) const {}
  // Shaft torque likewise, N m.
  void measured_torque(T&) const {}
};

// x -> factor x exp(-2 j theta_k) of a conjugated vector: a negative sequence, seen in the frame.
template <class T>
Cx<T> negative_sequence(const Cx<T>& factor, const Cx<T>& x, const Instant& at) {
  const std::complex<double> back = std::conj(at.turn * at.turn);
  return factor * conj(x) * Cx<T>(T(back.real()), T(back.imag()));
}

}  // namespace imrig::est
