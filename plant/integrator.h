#pragma once
// Integrates the drive over a stretch in which its inputs are held. Two ways behind one interface: SUNDIALS'
// ERKStep, error-controlled, the reference; and the classical fixed-step Runge-Kutta formula of order four,
// one step a stretch, for pace. docs/plant.md has both measured.

#include <memory>

#include "plant/drive.h"
#include "plant/plant_config.h"

namespace imrig::plant {

class Integrator {
 public:
  virtual ~Integrator() = default;
  // Advances x by duration_s. fresh: x, or an input of the drive, was changed since the last call ended;
  // without it an adaptive method goes on where it stopped. No allocation. Throws std::runtime_error when the
  // tolerance cannot be met.
  virtual void advance(State& x, double duration_s, bool fresh) = 0;
  // drive.flow(x), from what the integrator knows of x already. Valid until the next call of a function here.
  virtual const Drive::Flow& flow(const State& x) = 0;
};

// The drive must outlive the integrator.
std::unique_ptr<Integrator> make_integrator(const IntegratorConfig& config, const Drive& drive);

}  // namespace imrig::plant
