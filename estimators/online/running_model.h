#pragma once
// The loaded model driven by the measured voltage and speed, sample by sample, and how far the measured current is
// from what it draws. Stator frame, flux states (base_machine.h, effect_machine.h), Heun's rule on straight lines
// between samples: (w h)^2/6 of the impedance, 9e-5 at 60 Hz and 60 us. The voltage is late by its filter and the
// current has passed the same filter, which a machine at constant speed does not notice.
//   residual   rms of |i - i_model| over about 0.2 s, forgetting exponentially
// The flux begins at zero; what that does dies with L_m/R_r, and only after kSettled of these there is a residual.

#include <cmath>
#include <complex>
#include <cstdint>
#include <memory>
#include <optional>

#include "estimators/model/effects/effect_machine.h"
#include "estimators/online/motor_knowledge.h"

namespace imrig::est {

class RunningModel {
 public:
  static constexpr double kWindow_s = 0.2, kSettled = 6.0;

  explicit RunningModel(const MotorKnowledge& motor);

  void restart() {
    x_ = {};
    begun_ = false;
    seen_s_ = square_ = 0.0;
  }
  // One sample: V, A, electrical rad/s, deg C (NaN: not measured).
  void take(std::complex<double> v, std::complex<double> i, double w_r, double stator_C, double h);
  // A; NaN until the start is forgotten.
  double residual_rms_A() const { return seen_s_ > settle_s_ ? std::sqrt(square_) : kUnknown_A; }

 private:
  static constexpr double kUnknown_A = std::numeric_limits<double>::quiet_NaN();
  using State = EffectState<double>;
  State derivative(const State& x, std::complex<double> v, double w_r) const;
  std::complex<double> current(const State& x, std::complex<double> v, double w_r) const;

  BaseMachine<double> base_;
  std::unique_ptr<EffectMachine<double>> machine_;  // where the model has effects
  Instant at_;
  State x_;
  double settle_s_, seen_s_ = 0.0, square_ = 0.0;
  std::complex<double> v_;
  double w_r_ = 0.0;
  bool begun_ = false;
};

// Current phasor that the model draws in steady state at a voltage on the real axis (peak), supply and rotor speed
// (electrical rad/s; w_e > 0). Without effects in closed form; with them Newton's method on the derivative in the
// supply's frame. Nothing where that does not settle.
class SteadyModel {
 public:
  explicit SteadyModel(const MotorKnowledge& motor);
  std::optional<std::complex<double>> current(double v_peak_V, double w_e, double w_r, double stator_C) const;

 private:
  MotorKnowledge motor_;
  std::unique_ptr<EffectMachine<double>> machine_;
};

}  // namespace imrig::est
