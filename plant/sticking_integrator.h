#pragma once
// Dry friction with its jump, on top of any integrator. Over a stretch the sense of the friction's torque is
// fixed, so that what is integrated stays smooth; where the speed runs through zero the stretch is cut at
// that moment, found by bracketing. At zero speed the shaft rests as long as no more than the break-away
// torque pulls at it: then speed and angle do not change by a bit, and the friction's torque is what holds
// the balance. It is asked at the start of every stretch, so a shaft breaks away at most one sample late,
// and nothing chatters: after kMostEvents cuts in one stretch it rests to the stretch's end.

#include <memory>

#include "plant/integrator.h"

namespace imrig::plant {

// `inner` itself where no effect of the drive sticks, or where its shaft is held. Both must outlive the
// result's use.
std::unique_ptr<Integrator> with_sticking(std::unique_ptr<Integrator> inner, Drive& drive);

class StickingIntegrator final : public Integrator {
 public:
  StickingIntegrator(std::unique_ptr<Integrator> inner, Drive& drive)
      : inner_(std::move(inner)), drive_(drive) {}

  void advance(State& x, double duration_s, bool fresh) override;
  const Drive::Flow& flow(const State& x) override { return inner_->flow(x); }

  static constexpr int kMostEvents = 8;

 private:
  Motion motion_at(const State& x);
  double find_stop(const State& from, State& x, double duration_s);

  std::unique_ptr<Integrator> inner_;
  Drive& drive_;
  State from_{};
  bool fresh_ = true;  // as in Integrator
};

}  // namespace imrig::plant
