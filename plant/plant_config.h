#pragma once
// The plant's configuration file (models/plants/*.toml, version 1), read strictly: an unknown key or a value
// out of range is an Error. Every default below is the 2002 paper's set-up (Proca and Keyhani, section VII
// and Table II) or, where it is silent, a bench like it.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace imrig::plant {

class Effect;  // plant/effects/effect.h

// Per phase of the equivalent star, rotor as seen from the stator.
struct MachineConfig {
  std::string name = "motor";
  int pole_pairs = 2;
  // T circuit: L_s and L_r whole self-inductances, L_m mutual, R_r of the T circuit's rotor.
  double R_s_ohm = 0.0, R_r_ohm = 0.0, L_s_H = 0.0, L_r_H = 0.0, L_m_H = 0.0;
};

// Inverse-gamma parameters (leakage L_l on the stator side, L_m carries the rotor flux) to the T circuit with
// L_s = L_r, which looks the same from the terminals: L_s = L_l + L_m, L_mT = sqrt(L_m L_s), R_rT = R_r L_s /
// L_m.
MachineConfig machine_of_inverse_gamma(double R_s_ohm, double R_r_ohm, double L_l_H, double L_m_H,
                                       int pole_pairs);

struct MechanicsConfig {
  double J_kgm2 = 0.047;                 // motor, coupling and generator
  bool locked = false;                   // the shaft is held
  std::optional<double> held_speed_rpm;  // a stiff drive holds the shaft at this speed
};

struct InverterConfig {
  enum class Kind { kAveraged, kSwitching };  // mean of a cycle, or every switching instant
  enum class Limit { kCircle, kHexagon };     // what is asked beyond it is clipped (plant/inverter.h)
  double dc_link_V = 400.0;                   // nominal
  Kind kind = Kind::kAveraged;
  Limit limit = Limit::kCircle;
  std::int64_t carrier_ns = 0;    // cycle of the switching inverter; 0: the PWM time
  bool link_compensated = false;  // duties follow the link's true voltage, not its nominal one
  // The link (plant/dc_link.h); all zero: stiff.
  double source_ohm = 0.0, capacitor_F = 0.0;
  double ripple_V = 0.0, ripple_Hz = 360.0;  // amplitude; six-pulse rectifier at 60 Hz
  double brake_V = 0.0;                      // the brake chopper lets the link rise no further; 0: none
};

// Round-rotor synchronous generator with field winding on a resistor box (star); same shaft. dq model in the
// rotor's frame.
struct GeneratorConfig {
  bool coupled = true;
  int pole_pairs = 2;
  double flux_per_field_A_Wb = 0.338;  // peak stator flux linkage per ampere of field current
  double L_s_H = 0.0126;
  double R_a_ohm = 0.42;
  double R_load_ohm = 11.7;
  double R_field_ohm = 20.6;
  double L_field_H = 16.6;
  // Open-circuit characteristic: peak flux linkage of the air gap where it bends, and its slope far above as
  // a share of the air-gap line's; 1: straight.
  double saturated_ratio = 1.0, knee_Wb = 0.5, softness = 0.4;
  double L_leakage_H = 0.00126;  // of L_s
  // Rotational losses, from the shaft: core loss at this flux and speed, eddy currents' share of it; bearings
  // and fan.
  double core_loss_W = 0.0, core_psi_Wb = 0.5, core_rpm = 1800.0, core_eddy_share = 0.5;
  double friction_Nm = 0.0, windage_Nms2 = 0.0;
};

// DC supply of the field: constant voltage or constant current, whichever asks for less. The field current
// freewheels when it is off.
struct SupplyConfig {
  double max_V = 60.0;
  double max_A = 6.0;
  double slew_V_per_s = 1000.0;  // of the voltage set-point
  double kp_V_per_A = 800.0;     // current loop
  double ki_V_per_As = 16000.0;
};

struct SensorsConfig {
  bool ideal = false;  // no noise, no offset, exact gains, 16-bit converters over the same range
  int adc_bits = 12;
  double current_range_A = 40.0;  // +-
  double voltage_range_V = 400.0;
  double current_noise_A = 0.03;  // one sigma per sample
  double voltage_noise_V = 0.3;
  double gain_sigma = 0.001;  // relative, drawn once per channel and seed
  double offset_sigma_counts = 3.0;
  double voltage_filter_s = 160e-6;
  int encoder_counts_per_rev = 4096;
  double stator_C = 25.0;
  double encoder_loss = 0.0;    // probability that a count is missed
  double clock_ppm = 0.0;       // the converters' clock is slow by so much: steps are longer
  double clock_jitter_s = 0.0;  // one sigma of each sampling instant, within a quarter step
  double torque_gain = 1.0, torque_offset_Nm = 0.0;  // transducer in the shaft, seen in Observed only
};

struct IntegratorConfig {
  enum class Kind { kSundials, kRk4 };
  Kind kind = Kind::kSundials;
  double rtol = 1e-8;
  double atol = 1e-10;  // of each state in its SI unit
};

struct PlantConfig {
  std::string name = "plant";
  std::uint64_t seed = 1;  // of sensor gains, offsets and noise
  std::int64_t sample_time_ns = 60'000;
  std::int64_t pwm_time_ns = 240'000;
  MachineConfig machine;
  MechanicsConfig mechanics;
  InverterConfig inverter;
  GeneratorConfig generator;
  SupplyConfig supply;
  SensorsConfig sensors;
  IntegratorConfig integrator;
  std::vector<std::shared_ptr<const Effect>>
      effects;  // [effects.NAME] in the file; applied in the registry's order
};

// Throw Error: missing file, unknown key, value out of range, no possible machine.
PlantConfig load_plant_config(const std::string& path);
PlantConfig parse_plant_config(const std::string& text, const std::string& name);
// Throws Error where values that are each in range make no machine together, or one too fast for the sample
// time.
void validate(const PlantConfig& config);

}  // namespace imrig::plant
