#pragma once
// The rig's configuration file (rig.toml, version 1): what every process of one rig must agree on. docs/rig-configuration.md lists it.

#include <cstdint>
#include <limits>
#include <string>

namespace imrig {

struct BusConfig {
  std::string url = "udpm://239.255.76.77:7790?ttl=0&recv_buf_size=4194304";  // rigs are kept apart by port
  std::string prefix = "IMRIG";
};

// Nominal motor: for predictions, limits and the identification's bounds. Inverse-gamma circuit, per phase of the equivalent star.
struct MotorConfig {
  std::string name = "motor";
  int pole_pairs = 2;
  double rated_voltage_V = 220.0;    // line to line, rms
  double rated_frequency_Hz = 60.0;
  double rated_current_A = 14.0;     // line, rms
  double rated_speed_rpm = 1750.0;
  double rated_power_W = 3730.0;
  double R_s_ohm = 0.39;
  double R_r_ohm = 0.22;
  double L_l_H = 0.006;
  double L_m_H = 0.068;
  double friction_Nm = 0.5;          // no-load torque at rated speed, for predictions
  double J_kgm2 = 0.05;              // whole shaft
};

struct LimitsConfig {
  double current_A = 35.0;        // |stator current vector|, peak
  double voltage_V = 230.0;       // peak phase voltage a profile may ask for
  double speed_rpm = 3000.0;      // |mechanical|
  double stator_C = 130.0;
  int link_silence_ms = 500;      // bridge trips after this much wall time without a frame
  int device_watchdog_ms = 300;   // device trips after this much time without the bridge
  int lease_ms = 2000;            // a lease lasts so long without a renewal
  int peer_silence_ms = 2000;     // bridge and dyno trip when the other's heartbeat is missing while the rig runs
  double max_lost_blocks = 100;   // then kSamplesLost
};

struct BridgeConfig {
  std::string link = "udp://127.0.0.1:47010";  // or serial:///dev/ttyUSB0?baud=3000000
  int credit_blocks = 64;                      // how far a device that can wait may run ahead of the slowest follower
};

struct DynoConfig {
  std::string link = "tcp://127.0.0.1:15020";  // or rtu:///dev/ttyUSB1?baud=115200&unit=1
  std::string register_map = "riden_rd6006";   // models/registers/NAME.toml, or a path
  double max_V = 60.0;
  double max_A = 5.0;
  double ramp_V_per_s = 100.0;
  double ramp_A_per_s = 10.0;
  int response_ms = 300;
  int poll_ms = 20;
};

// Nominal load generator, for torque set-points: T = (3/2) p E^2 R / (w |Z|^2) with E = w k i_f; see docs/rig-configuration.md.
struct GeneratorConfig {
  int pole_pairs = 2;
  double flux_per_field_A_Wb = 0.35;   // peak stator flux linkage per ampere of field current
  double L_s_H = 0.012;
  double R_a_ohm = 0.4;
  double R_load_ohm = 12.0;            // resistor box, per phase
  double R_field_ohm = 20.0;
};

// Declared accuracy of the sensors, one sigma, relative; goes into every interval.
struct AccuracyConfig {
  double current_gain = 0.002;
  double voltage_gain = 0.002;
};

struct RigConfig {
  BusConfig bus;
  MotorConfig motor;
  LimitsConfig limits;
  BridgeConfig bridge;
  DynoConfig dyno;
  GeneratorConfig generator;
  AccuracyConfig accuracy;
  std::uint64_t hash = 0;  // of the file's text
};

// Throws Error: missing file, unknown key, value out of range.
RigConfig load_rig_config(const std::string& path);
RigConfig parse_rig_config(const std::string& text, const std::string& name);
// TOML that parse_rig_config reads back to the same values.
std::string to_toml(const RigConfig& config);

}  // namespace imrig
