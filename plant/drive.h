#pragma once
// The continuous part of the plant as one ordinary differential equation. States: stator and rotor flux
// linkage (stator frame, T circuit), shaft speed and angle, generator fluxes, then the states of the effects.
//   d psi_s/dt = v_s - R_s i_s
//   d psi_r/dt = -R_r i_r + j n_p w psi_r          (with iron: see rotor_flow in drive.cc)
//   T = -(3/2) n_p Im(conj(psi_r) i_bar),   J dw/dt = T + T_generator - T_drag,   d theta/dt = w
// Held over a stretch: what is at the stator's terminals, and the field's voltage.

#include <array>
#include <complex>
#include <cstddef>

#include "plant/effects/effect_set.h"
#include "plant/generator.h"
#include "plant/magnetic_circuit.h"
#include "plant/plant_config.h"
#include "plant/t_circuit.h"

namespace imrig::plant {

inline constexpr std::size_t kMaxStates = 64;
using State = std::array<double, kMaxStates>;  // the first Drive::size() count
enum StateIndex : std::size_t {
  kPsiS = 0,
  kPsiR = 2,
  kSpeed = 4,
  kAngle = 5,
  kPsiD = 6,
  kPsiQ = 7,
  kPsiF = 8,
  kOwn = 9
};

// Who decides the stator's voltage.
struct Terminals {
  enum class Kind {
    kInverter,  // v_s from the switched inverter
    kClamped,   // v_s from three conducting diodes
    kPair,  // two phases conduct: v_s gives the component across `axis`, the third phase's axis; along it the
            // current stays as it is
    kOpen   // nothing conducts: the current stays as it is, zero
  };
  Kind kind = Kind::kOpen;
  std::complex<double> v_s = 0.0;   // V
  std::complex<double> axis = 1.0;  // unit vector
};

class Drive {
 public:
  struct Flow {
    Conditions at;
    std::complex<double> dpsi_s;
    Generator::Flow generator;
  };
  // What one evaluation leaves for the next one nearby. With it the currents are within
  // MagneticCircuit::kFollowed_A of those without; without saturation it changes no bit.
  struct Memory {
    MagneticCircuit::Known magnetics;
    const double* held =
        nullptr;  // rates of all states, from which slow effects take theirs; null: their own
    Flow flow;    // room to work in
  };

  explicit Drive(const PlantConfig& config);
  std::size_t size() const { return kOwn + effects_.states(); }
  State initial() const;
  double sample_s() const { return sample_s_; }  // nominal

  Flow flow(const State& x) const;
  void derivatives(const double* x, double* dx) const;  // size() each
  void derivatives(const double* x, double* dx, Memory& memory) const;
  // The same in parts, for who has use for them: what the state alone decides, what shaft and field's voltage
  // and what the stator's terminals add to it (both need settle()), and the rates of all states (needs all).
  void settle(const double* x, MagneticCircuit::Known* near, Flow& flow) const;
  void turn(const double* x, Flow& flow) const { turn(x, flow, shaft); }
  void connect(const double* x, Flow& flow) const;
  void rates(const double* x, Flow& flow, double* dx, const double* held = nullptr) const;
  std::complex<double> stator_current(const State& x) const;
  // Moves psi_s, at the same rotor flux, to where the stator's current is i_s.
  void set_stator_current(State& x, std::complex<double> i_s) const;
  const double* own(const State& x, const EffectSet::Slot& slot) const { return &x[kOwn + slot.offset]; }

  const EffectSet& effects() const { return effects_; }
  // Heat by place, effects included.
  Losses losses(const Conditions& at, const State& x) const { return losses(at, &x[kOwn]); }
  // Energy in the motor's magnetic circuit and in what the effects add to it.
  double magnetic_J(const Conditions& at, const State& x) const;
  const MagneticCircuit& magnetics() const { return magnetics_; }
  const Generator& generator() const { return generator_; }
  // What holds a resting shaft, and what pulls at it there, Nm.
  double break_away_Nm() const { return break_away_Nm_; }
  double pull_at_rest_Nm(const State& x, const Flow& now) const;
  bool shaft_is_held() const { return mechanics_.locked || mechanics_.held_speed_rpm; }

  Terminals terminals;
  Motion shaft = Motion::kBySpeed;  // decided for a stretch
  double field_V = 0.0;
  double dc_link_V = 0.0;  // for effects
  double cycle_s = 0.0;

 private:
  struct Sensitivity {  // d i_s = Jacobian d psi_s + along d psi_r, real components
    double ss, st, ts, tt;
    std::complex<double> along;
  };
  // Which hooks are overridden: none but the shaft's drag, with a straight magnetic circuit; none that bends
  // currents, stands beside the winding or bends the shaft; any.
  enum class Shape { kBare, kUsual, kAny };
  template <class F>
  void shaped(F&& f) const;
  template <Shape>
  void settle_as(const double* x, MagneticCircuit::Known* near, Flow& flow) const;
  template <Shape>
  void turn_as(const double* x, Flow& flow, Motion as) const;
  template <Shape>
  void connect_as(const double* x, Flow& flow) const;
  template <Shape>
  void other_rates(const double* x, Flow& flow, double* dx, const double* held) const;
  static void flux_rates(const Flow& now, double* dx);
  template <Shape>
  void derivatives_as(const double* x, double* dx, Memory& memory) const;
  template <Shape>
  void set_currents(const double* own, MagneticCircuit::Known* near, Conditions& at) const;
  Currents currents(const Conditions& at, const double* own) const;
  void turn(const double* x, Flow& flow, Motion as) const;
  template <Shape>
  void rotor_flow(Conditions& at, const double* own) const;
  Losses losses(const Conditions& at, const double* own) const;
  std::complex<double> diodes_voltage(const Conditions& at, const double* own) const;
  std::complex<double> holding_voltage(const Conditions& at, const double* own) const;
  std::complex<double> stator_drop(const Conditions& at) const;
  Sensitivity sensitivity(const Conditions& at, const double* own) const;

  TCircuit circuit_;
  MagneticCircuit magnetics_;
  Generator generator_;
  MechanicsConfig mechanics_;
  EffectSet effects_;
  Shape shape_;
  Resistances base_;
  double sample_s_;
  double per_J_;  // 1/(kg m^2)
  double n_p_, L_m_, L_ls_;
  double break_away_Nm_ = 0.0;
};

}  // namespace imrig::plant
