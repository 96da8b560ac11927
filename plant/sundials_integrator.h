#pragma once
// ERKStep of SUNDIALS: explicit embedded Runge-Kutta with error control (Bogacki and Shampine's 3(2) or Zonneveld's 5-stage 4(3), see the .cc).
// The solver's own time restarts at each change of an input, so that it never grows; between changes it is a whole number of stretches.

#include <memory>

#include "plant/integrator.h"

namespace imrig::plant {

class SundialsIntegrator final : public Integrator {
 public:
  SundialsIntegrator(const Drive& drive, double rtol, double atol);
  ~SundialsIntegrator() override;
  void advance(State& x, double duration_s, bool fresh) override;
  long derivative_calls() const;

 private:
  struct Solver;
  std::unique_ptr<Solver> solver_;
};

}  // namespace imrig::plant
