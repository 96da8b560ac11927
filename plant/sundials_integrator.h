#pragma once
// ERKStep of SUNDIALS with Dormand and Prince's 5(4) pair and error control: smooth as the plant is within a
// sample, it needs one step of it. The solver's own time restarts at each change of an input, so that it
// never grows; between changes it is a whole number of stretches.

#include <memory>

#include "plant/integrator.h"

namespace imrig::plant {

class SundialsIntegrator final : public Integrator {
 public:
  SundialsIntegrator(const Drive& drive, double rtol, double atol);
  ~SundialsIntegrator() override;
  void advance(State& x, double duration_s, bool fresh) override;
  const Drive::Flow& flow(const State& x) override { return flow_ = drive_.flow(x); }

 private:
  struct Solver;
  const Drive& drive_;
  Drive::Flow flow_;
  std::unique_ptr<Solver> solver_;
};

}  // namespace imrig::plant
