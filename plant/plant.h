#pragma once
// The plant behind the DSP's wires: motor, load generator with its excitation supply, inverter, sensors.
// Equations: docs/plant.md. One step is one sample time of the analogue-to-digital converter. The clock is
// the step's index; time is index x sample time and is never accumulated. The same configuration and the same
// commands give the same bits.

#include <complex>
#include <cstdint>
#include <memory>

#include "plant/excitation.h"

namespace imrig::plant {

struct PlantConfig;
struct Powers;

// Phase voltages against the star point in V, held over the step; a common part is without effect. They are
// limited to the circle of radius V_dc/sqrt(3) or to the hexagon. With gates_on false all six switches are
// open and the freewheeling diodes decide.
struct InverterCommand {
  double v[3] = {0.0, 0.0, 0.0};
  bool gates_on = false;
};

// What the converters and the encoder counter hold at the end of the step: signed counts with zero in the
// middle of the range, phases a, b, c. Physical values: counts x SensorScale. The encoder counts on over
// turns and wraps modulo 2^32.
struct RawSample {
  std::int16_t i[3];
  std::int16_t v[3];
  std::int32_t encoder;
  float stator_C;
};

// Nominal scale of the counts (the real gain of a channel differs by its error).
struct SensorScale {
  double current_A_per_count;
  double voltage_V_per_count;
  double voltage_filter_s;  // time constant of the first-order filter before the voltage converters; 0: none
  int full_scale_counts;    // counts lie in [-full_scale, full_scale - 1]
  int encoder_counts_per_rev;
};

// The true state at the end of the last step, for tests and reports; no sensor sees it. Stator frame,
// amplitude-invariant vectors, T circuit.
struct Observed {
  std::int64_t index = 0;       // steps made
  std::complex<double> v_s;     // V, at the motor's terminals, as held over the step (gates off: at its end)
  std::complex<double> v_mean;  // V, mean over the step while the gates are on
  double dc_link_V = 0.0;       // over the step
  std::complex<double> i_s, i_r;      // A, into the winding
  std::complex<double> psi_s, psi_r;  // Wb
  double torque_Nm = 0.0;             // air-gap torque of the motor
  double load_Nm = 0.0;               // the generator's braking torque (positive against positive speed)
  double drag_Nm = 0.0;               // friction, against the motion
  double transducer_Nm = 0.0;  // what a torque transducer between motor and load shows, its errors included
  double w_mech_rad_s = 0.0;
  double speed_rpm = 0.0;
  double angle_rad = 0.0;  // of the shaft, [0, 2 pi)
  std::int64_t turns = 0;
  double generator_i_d_A = 0.0, generator_i_q_A = 0.0, field_A = 0.0, field_V = 0.0;
  double stator_C = 0.0;               // as the thermocouple has it
  double rotor_C = 0.0, iron_C = 0.0;  // as the effects have it
};

class Plant {
 public:
  // Throws Error on a configuration that is no machine (see validate in plant_config.h).
  explicit Plant(const PlantConfig& config);
  ~Plant();
  Plant(Plant&&) noexcept;
  Plant& operator=(Plant&&) noexcept;

  // Advances by one sample time and samples at its end. No allocation. Throws std::runtime_error should the
  // integrator fail. A command that is not finite opens the gates for the step.
  RawSample step(const InverterCommand& command);

  // Taken by the supply's next control period. Set-points that are not finite or negative count as zero; a
  // protection level that is not positive counts as none. Tripped protection keeps the output off until
  // output_on is withdrawn once.
  void set_excitation(const ExcitationCommand& command);
  ExcitationReadback excitation() const;

  const Observed& state() const;
  Powers powers() const;  // plant/powers.h
  SensorScale scale() const;
  std::int64_t index() const;  // steps made
  std::int64_t sample_time_ns() const;
  std::int64_t pwm_time_ns() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace imrig::plant
