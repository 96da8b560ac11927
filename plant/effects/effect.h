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

struct Resistances {
  double R_s = 0.0, R_r = 0.0;  // ohm, T circuit
  double G_iron = 0.0;          // S, across the rotor's flux linkage, T circuit: carries G_iron dpsi_r/dt
};

// What a hook may look at. Fields are filled in the order in which they stand; a hook sees those before its
// own place.
struct Conditions {
  std::complex<double> psi_s, psi_r;             // Wb, stator frame, T circuit
  double w_mech = 0.0, angle = 0.0;              // rad/s, rad
  double psi_d = 0.0, psi_q = 0.0, psi_f = 0.0;  // Wb, generator, rotor frame
  Currents i;                                    // after currents()
  Resistances R;                                 // after resistances()
  std::complex<double> v_s;                      // V, after applied_voltage()
  std::complex<double> dpsi_r, i_bar;            // V; A, rotor current without the iron's part
  double torque_Nm = 0.0;                        // air gap
  double drag_Nm = 0.0;                          // after drag()
};

// Physical values on their way to the converters, after the voltage filter, before gain, offset and noise.
struct Measured {
  double i[3], v[3];   // A, V
  double encoder_rad;  // within the turn
  double stator_C;
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
    kMeasured = 32
  };

  virtual ~Effect() = default;
  virtual std::string name() const = 0;
  virtual unsigned hooks() const = 0;  // which of the functions below it overrides
  virtual std::vector<Parameter> parameters() const = 0;

  // own: the effect's states. Each hook changes its last argument.
  virtual void currents(const Conditions&, const double* /*own*/, Currents&) const {}
  virtual void resistances(const Conditions&, const double* /*own*/, Resistances&) const {}
  // With gates on only: v is what the inverter was asked for, after its limit.
  virtual void applied_voltage(const Conditions&, const double* /*own*/, std::complex<double>& /*v*/) const {}
  // Adds to the torque that brakes positive speed. It must take energy from the shaft, never give it.
  virtual void drag(const Conditions&, const double* /*own*/, double& /*torque_Nm*/) const {}
  virtual std::size_t states() const { return 0; }
  virtual void initial(double* /*own*/) const {}
  virtual void derivatives(const Conditions&, const double* /*own*/, double* /*d_own*/) const {}
  virtual void measured(const Conditions&, const double* /*own*/, Measured&) const {}
};

}  // namespace imrig::plant
