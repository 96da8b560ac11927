#pragma once
// A physical effect beyond the base machine: one header in this folder, its line in registry.cc, its test.
// The core (plant/drive.h, plant/plant.cc) knows hooks only; each hook's default is the identity, and an
// effect that is absent costs nothing. Effects are constant objects: what changes with time lives in their
// own states, which the integrator carries.

#include <complex>
#include <cstddef>
#include <string>
#include <vector>

namespace imrig::plant {

struct Currents {
  std::complex<double> s, r;  // A, into the winding, T circuit
};

struct Temperatures {
  double stator_C = 25.0, rotor_C = 25.0, iron_C = 25.0, ambient_C = 25.0;  // winding, cage, iron and frame
};

struct Resistances {
  double R_s = 0.0, R_r = 0.0;  // ohm, T circuit
  double G_iron = 0.0;          // S, across the rotor's flux linkage, T circuit: carries G_iron dpsi_r/dt
  std::complex<double> R_s_conj = 0.0;  // ohm, stator asymmetry: the drop is R_s i_s + R_s_conj conj(i_s)
};

// A branch at the stator's terminals, beside the winding: its current, and how fast that changes,
// rate + (xx, xy; xy, yy) v_s.
struct Shunt {
  std::complex<double> i = 0.0;         // A
  std::complex<double> rate = 0.0;      // A/s, without voltage
  double xx = 0.0, xy = 0.0, yy = 0.0;  // 1/H
};

// Voltage along the rotor's bars as it answers their current: R i_bar + R_conj conj(i_bar) + v_0, stator
// frame. Ladders keep their inner currents in v_0; an asymmetric cage has its second harmonic of the rotor's
// angle in R_conj.
struct RotorDrop {
  double R = 0.0;                     // ohm
  std::complex<double> R_conj = 0.0;  // ohm
  std::complex<double> v_0 = 0.0;     // V
};

// How the shaft hands the load over. Rigid: one mass, the generator turns with the motor.
struct Coupling {
  bool rigid = true;
  double w_generator = 0.0;         // rad/s
  double torque_on_motor_Nm = 0.0;  // where it is not rigid: instead of the generator's torque
  double heat_W = 0.0;              // of its damping
};

// Which way the shaft is taken to move over a stretch, for friction with a jump at rest. By the speed's sign
// where nobody decides; else fixed over the stretch (plant/sticking_integrator.h).
enum class Motion { kBySpeed, kForward, kBackward, kResting };

// Heat as it arises, W. Only effects that ask for it (kReadsLosses) read it, after everything else is
// known.
struct Losses {
  double stator_copper_W = 0.0, rotor_copper_W = 0.0, iron_W = 0.0, stray_W = 0.0, friction_W = 0.0;
};

// What a hook may look at. Fields are filled in the order in which they stand; a hook sees those before its
// own place.
struct Conditions {
  double n_p = 1.0;                   // pole pairs of the motor
  double L_m = 0.0, L_ls = 0.0;       // H, T circuit, the file's
  double dc_link_V = 0.0;             // as it is over this stretch
  double cycle_s = 0.0;               // of an averaged inverter; 0 where every switching instant is followed
  std::complex<double> psi_s, psi_r;  // Wb, stator frame, T circuit
  double w_mech = 0.0, angle = 0.0;   // rad/s, rad
  double psi_d = 0.0, psi_q = 0.0, psi_f = 0.0;  // Wb, generator, rotor frame
  double R_r_nominal = 0.0;                      // ohm, the file's; R.R_r over it is how the cage has changed
  Temperatures temperature;                      // after temperatures()
  Currents i;                                    // after currents()
  Resistances R;                                 // after resistances()
  Shunt shunt;                                   // after shunt(); its current is in i.s, not in the winding
  RotorDrop drop;                                // after rotor_drop()
  std::complex<double> dpsi_r, i_bar;            // V; A, rotor current without the iron's part
  double torque_Nm = 0.0;                        // air gap
  Coupling coupling;                             // after coupling()
  Motion motion = Motion::kBySpeed;
  double generator_Nm =
      0.0;               // the generator's torque on its own shaft, negative where it brakes positive speed
  double drag_Nm = 0.0;  // after drag_Nm()
  std::complex<double> v_s;  // V, after applied_voltage()
  Losses losses;             // after losses(); filled where an effect reads them and for powers() only
};

// Sign of the speed for friction with a jump, as the stretch has it.
inline double sense(const Conditions& at) {
  if (at.motion == Motion::kBySpeed) return at.w_mech > 0.0 ? 1.0 : at.w_mech < 0.0 ? -1.0 : 0.0;
  return at.motion == Motion::kForward ? 1.0 : at.motion == Motion::kBackward ? -1.0 : 0.0;
}

// Physical values on their way to the converters, after the voltage filter, before gain, offset and noise.
struct Measured {
  double i[3], v[3];   // A, V
  double encoder_rad;  // within the turn
  double stator_C;
};

// How one branch of the T circuit saturates: incremental inductance from the linear one down to
// saturated_ratio of it, around a smooth knee.
struct SaturationLaw {
  double saturated_ratio = 1.0;  // 1: stays linear
  double knee = 1.0;             // Wb, air gap and teeth; A, leakage
  double softness = 0.5;         // 0 sharp .. 1
};

struct MagneticLaws {
  SaturationLaw main, stator_leakage, rotor_leakage, teeth;
  double leakage_in_teeth = 0.0;  // share of the stator's leakage flux that passes the teeth
};

struct Parameter {
  std::string name, unit;
  double value;
};

class Effect {
 public:
  enum Hook : unsigned {
    kCurrents = 1,
    kResistances = 2,
    kAppliedVoltage = 4,
    kDrag = 8,
    kStates = 16,
    kMeasured = 32,
    kTemperatures = 64,
    kRotorDrop = 128,
    kCoupling = 256,
    kLosses = 512,
    kEnergy = 1024,
    kShunt = 2048,
    kReadsLosses = 4096  // no function: its derivatives() read Conditions::losses
  };

  virtual ~Effect() = default;
  virtual std::string name() const = 0;
  virtual unsigned hooks() const = 0;  // which of the functions below it overrides
  virtual std::vector<Parameter> parameters() const = 0;

  // Asked once when the plant is built: how the magnetic circuit bends (plant/magnetic_circuit.h). Not in
  // hooks().
  virtual void magnetics(MagneticLaws&) const {}
  // own: the effect's states. Each hook changes its last argument.
  virtual void currents(const Conditions&, const double* /*own*/, Currents&) const {}
  virtual void resistances(const Conditions&, const double* /*own*/, Resistances&) const {}
  // With gates on only: v is what the inverter was asked for, after its limit.
  virtual void applied_voltage(const Conditions&, const double* /*own*/, std::complex<double>& /*v*/) const {}
  // Torque that brakes positive speed. It must take energy from the shaft, never give it.
  virtual double drag_Nm(const Conditions&, const double* /*own*/) const { return 0.0; }
  // Torque up to which it holds a shaft at rest. Its drag_Nm() then has the sense of Conditions::motion.
  virtual double break_away_Nm() const { return 0.0; }
  virtual std::size_t states() const { return 0; }
  virtual void initial(double* /*own*/) const {}
  virtual void derivatives(const Conditions&, const double* /*own*/, double* /*d_own*/) const {}
  // Its states move so little in a sample (time constants of seconds) that a fixed step may hold their rates.
  virtual bool slow() const { return false; }
  virtual void measured(const Conditions&, const double* /*own*/, Measured&) const {}
  virtual void temperatures(const Conditions&, const double* /*own*/, Temperatures&) const {}
  virtual void rotor_drop(const Conditions&, const double* /*own*/, RotorDrop&) const {}
  // The part of the rotor's leakage inductance, H, that lives in the states of this effect instead of in
  // psi_r. The circuit's rotor leakage is reduced by it, so that the whole stays what the file says.
  virtual double rotor_leakage_H(double /*R_r_nominal*/) const { return 0.0; }
  // Bound on how fast its own states settle, 1/s; must not exceed what a fixed step follows.
  virtual double fastest_rate_per_s() const { return 0.0; }
  // The same where it depends on the motor's R_s and stator leakage (T circuit).
  virtual double settling_rate_per_s(double /*R_s_ohm*/, double /*L_ls_H*/) const {
    return fastest_rate_per_s();
  }
  virtual void coupling(const Conditions&, const double* /*own*/, Coupling&) const {}
  virtual void shunt(const Conditions&, const double* /*own*/, Shunt&) const {}
  virtual void losses(const Conditions&, const double* /*own*/, Losses&) const {}
  // Adds what this effect stores, or corrects the linear circuit's magnetic energy: J.
  virtual void energy(const Conditions&, const double* /*own*/, double& /*stored_J*/) const {}
};

}  // namespace imrig::plant
