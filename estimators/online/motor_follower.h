#pragma once
// Everything that follows the motor sample by sample beside the operating point: the rotor observer, the joint
// filter, the resting motor, the stator's resistance, the loaded model. What they have found is kept as of every
// kEvery-th sample of the device's clock, so that it does not depend on how the samples are cut into blocks, and an
// estimate need not wait for the newest samples to be worked off: it takes what was found kEvery samples ago or
// more, and says how old that is.
//
//   R_s   the model's; at the thermocouple's temperature where there is one,
//           R_s(T) = R_s_ref (1 + alpha (T - T_ref));
//         a direct current measures it (standing_motor.h) and sets that line's level from then on

#include <array>
#include <memory>
#include <optional>

#include "estimators/online/joint_filter.h"
#include "estimators/online/motor_knowledge.h"
#include "estimators/online/quantity.h"
#include "estimators/online/r_r_observer/r_r_observer.h"
#include "estimators/online/running_model.h"
#include "estimators/online/sample_intake.h"
#include "estimators/online/standing_motor.h"

namespace imrig::est {

enum class StatorSource { kModel = 0, kThermocouple = 1, kDirect = 2 };

struct Findings {
  std::int64_t next_index = 0;  // as of the sample before
  RotorResistanceStatus rotor_status = RotorResistanceStatus::kNotSteady;
  Quantity R_r_ohm, R_1_ohm;
  StatorSource R_s_source = StatorSource::kModel;
  Quantity R_s_ohm, stator_C;
  Quantity joint_R_r_ohm, joint_R_s_ohm, joint_L_m_H;
  StandingMotor::Kind standing = StandingMotor::Kind::kNone;
  std::array<Quantity, 4> standing_parameters;  // R_s, R_r, L_l, L_m
  double simulated_rms_A = kUnknown;
};

struct FollowerConfig {
  MotorKnowledge motor;
  double current_gain_sigma = 0.002, voltage_gain_sigma = 0.002;  // relative, of the sensors
  double least_slip = 0.02;
  double settle_s = 0.5;  // of R_1
  bool voltage_held = true;
  bool observe = true, joint = true, simulate = true;  // what runs
};

class MotorFollower {
 public:
  static constexpr std::int64_t kEvery = 256;

  explicit MotorFollower(const FollowerConfig& config);
  // Consecutive samples, at most Chunk::kMost; anything that is not is a gap.
  void take(const SampleBlock& block);
  // Of the operating point's window that has just ended, for a rig whose sensors' zeros were never seen.
  void suggest_zero(std::complex<double> v_V, std::complex<double> i_A) { intake_.suggest_zero(v_V, i_A); }
  // The newest findings that rest on samples before the index alone.
  const Findings& before(std::int64_t index) const;
  std::int64_t dropouts() const { return intake_.dropouts(); }

 private:
  static constexpr std::size_t kKept = 4;
  void work(const SampleBlock& block);
  void begin(const Chunk& chunk);
  void renew_stator(double stator_C, std::int64_t index);
  void measured_stator(const StandingMotor::Resistance& found, std::int64_t index);
  void found_rotor(const RotorEstimate& e);
  double rotor_sigma(const RotorEstimate& e) const;
  void keep(std::int64_t next_index);

  FollowerConfig config_;
  SampleIntake intake_;
  std::unique_ptr<RotorObserver> observer_;  // once the sample time is known
  JointFilter joint_;
  StandingMotor standing_;
  RunningModel model_;
  RotorCircuit circuit_;
  Findings now_;
  std::array<Findings, kKept> kept_{};
  std::size_t newest_ = 0;
  bool joint_running_ = false;
  std::int64_t boot_id_ = 0, joint_index_ = 0;
  double sample_time_s_ = 0.0, filter_s_ = -1.0;
  double stator_C_ = kUnknown, level_ = 1.0;  // of R_s against the model's line
  double level_sigma_ = 0.0, measured_at_C_ = kUnknown, w_e_ = 0.0;
};

}  // namespace imrig::est
