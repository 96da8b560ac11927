#pragma once
// The whole online estimator as one core: raw samples in, one estimate per window of the operating point out, and
// one every kLongest_s where no window ends (a resting motor, gates off, a low frequency).
//   flux     psi_s = (V - R_s I)/(j w_e),  psi_r = psi_s - L_l I         torque  (3/2) n_p Im(psi_s* I)
//   R_r      R_1 + k_6 |w_s| at this window's slip and at any other (rotor_tracker.h)
//   model    the phasor it draws at the window's V, w_e, w_r, and its misfit by condition (condition_table.h)
// Depends on nothing but the samples and their order: any cut into blocks gives the same bits. Allocates when the
// sample time becomes known, never per sample.

#include <functional>
#include <vector>

#include "estimators/online/condition_table.h"
#include "estimators/model/steady_state.h"
#include "estimators/online/motor_follower.h"
#include "estimators/online/operating_point.h"

namespace imrig::est {

struct MotorEstimate {
  OperatingPoint point;
  bool window = true;  // false: between two windows, the point tells boot, indices and utime alone
  double sample_time_s = 0.0;
  std::int64_t missing_samples = 0;
  Quantity frequency_Hz, slip, voltage_V, current_A, phi_rad, input_power_W;
  Quantity stator_flux_Wb, rotor_flux_Wb, torque_Nm;
  Findings findings;
  Quantity R_r_here_ohm, R_r_elsewhere_ohm, rotor_C;
  double w_elsewhere_rad_s = 0.0;
  Quantity model_current_A, model_phi_rad, residual_share;
  Condition condition;
  std::int32_t windows_here = 0;
  Quantity residual_here, drift_here;
};

struct EstimatorConfig {
  FollowerConfig follower;
  OperatingPointConfig point;  // pole pairs and held voltage are the follower's
  double w_elsewhere_rad_s = 12.566;  // electrical slip frequency at which R_r is predicted
};

class Estimator {
 public:
  using Sink = std::function<void(const MotorEstimate&)>;
  static constexpr double kLongest_s = 0.5;

  Estimator(const EstimatorConfig& config, Sink sink);

  // Blocks in order. One that lies before what has been read, or is malformed, is passed over: false.
  bool feed(const SampleBlock& block);
  std::int64_t missing_samples() const { return missing_; }
  std::int64_t encoder_dropouts() const { return follower_.dropouts(); }

 private:
  static constexpr std::size_t kPiece = MotorFollower::kEvery;
  // Zeros of the sensors that a steady window has told, for the follower from the piece's sample `after` on.
  struct Zero {
    std::size_t after;
    SpaceVector voltage_V, current_A;
  };
  std::size_t feed_piece(const SampleBlock& piece, bool begins);
  bool feed_part(const SampleBlock& part);
  OperatingPoint without_window(const SampleBlock& last) const;
  MotorEstimate estimate(const OperatingPoint& point, bool window);
  void electrical(MotorEstimate& out) const;
  void rotor(MotorEstimate& out) const;
  void against_model(MotorEstimate& out);

  EstimatorConfig config_;
  Sink sink_;
  MotorFollower follower_;
  SteadyModel model_;
  ConditionTable conditions_;
  OperatingPoint closed_;
  bool has_closed_ = false;
  double sample_time_s_ = 0.0, stator_C_ = kUnknown;
  std::int64_t missing_ = 0, boot_id_ = 0;
  std::int64_t longest_ = 0;     // samples of kLongest_s
  std::int64_t told_index_ = 0;  // last sample of the last estimate
  std::vector<Zero> behind_;     // of the running piece
  OperatingPointEstimator point_;
};

}  // namespace imrig::est
