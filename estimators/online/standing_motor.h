#pragma once
// What a profile tells while the shaft rests with the gates on.
//   direct current   R = sum Re(v i*) / sum |i|^2 over windows of kWindow_s. The rotor's flux lets R sink towards R_s
//                    by the factor q = exp(-kWindow_s R_r/L_m) from window to window, so R_s = (R - q R_before)/(1 - q);
//                    mean over the windows of a level whose tail is below kMostTail
//                    (Proca and Keyhani 2002 (1) waits instead)
//   tones            all four parameters by the joint filter with a wide prior, begun anew with each profile
// Both need the sensors' zeros from the rest before.

#include <complex>
#include <cstdint>
#include <optional>

#include "estimators/online/joint_filter.h"
#include "estimators/online/motor_knowledge.h"

namespace imrig::est {

class StandingMotor {
 public:
  static constexpr double kWindow_s = 0.2, kMostTail = 0.05, kLeast_A = 0.5;
  enum class Kind { kNone = 0, kDirect = 1, kTones = 2 };

  explicit StandingMotor(const MotorKnowledge& motor);

  // Gates off, a gap or a turning shaft: what runs ends here; what was found stays.
  void interrupt();
  struct Resistance {
    double ohm, relative_sigma;  // scatter of the windows; the sensors' gains come on top
  };
  // One sample at rest with the gates on. R_s where this sample completes a window of it.
  std::optional<Resistance> take(std::complex<double> v, std::complex<double> i, double h, std::int64_t index);

  Kind kind() const { return kind_; }
  // Of the newest profile of tones; nothing before the filter has one second of it.
  bool tones_known() const { return tones_s_ > kLeastTones_s; }
  MachineParameters<double> parameters() const { return filter_.parameters(); }
  MachineParameters<double> relative_sigma() const { return filter_.relative_sigma(); }
  std::int64_t tones_index() const { return tones_index_; }

 private:
  static constexpr double kLeastTones_s = 1.0, kChanging = 0.005, kAlternating = 0.1;  // shares of the current
  static constexpr double kWindowSigma = 0.005, kDecayDoubt = 0.2;  // of one window's R_s; of what is left of the tail
  struct Sums {
    double power = 0.0, square = 0.0, n = 0.0;
    std::complex<double> i;
  };
  std::optional<Resistance> close();
  void forget_level();

  JointFilter filter_;
  Kind kind_ = Kind::kNone;
  Sums sums_;
  bool running_ = false;
  double decay_, last_seen_ = 0.0, sum_ = 0.0;
  int windows_ = 0;  // in the sum
  double tones_s_ = 0.0;
  std::int64_t tones_index_ = 0;
};

}  // namespace imrig::est
