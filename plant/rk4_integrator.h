#pragma once
// The classical formula of order four, one step a stretch:
//   y(t + h) = y + h (k1 + 2 k2 + 2 k3 + k4)/6.
// Its stages tell when a kink lies within the step (the inverter's dead time where a phase current turns,
// friction where the shaft does): then h/3 |k2 - k3| and h/6 |k1 - k2 - k3 + k4|, both of third order and
// far below in a smooth stretch, exceed kBend_Wb in the stator's flux or kBend_rad_s in speed, and the step
// is made again in two halves, at most kMostHalvings times over. Which steps these are depends on the state
// alone. The point where a step ends begins the next one; saturated currents follow from stage to stage
// (Drive::Memory).

#include "plant/integrator.h"

namespace imrig::plant {

class Rk4Integrator final : public Integrator {
 public:
  explicit Rk4Integrator(const Drive& drive) : drive_(drive), n_(drive.size()) {}

  void advance(State& x, double h, bool fresh) override;
  const Drive::Flow& flow(const State& x) override;

  static constexpr double kBend_Wb = 4e-7;
  static constexpr double kBend_rad_s = 2e-5;
  static constexpr int kMostHalvings = 4;

 private:
  void stage(const State& x, double h, const State& slope, State& out);
  void step(State& x, const State& k1, double h, int halvings);
  bool bends(const State& k1, double h) const;
  Drive::Memory* memory();
  bool settled(const State& x) const;

  const Drive& drive_;
  std::size_t n_;
  State at_{}, k2_{}, k3_{}, k4_{};
  Drive::Memory memory_;
  // The point asked for last, and the inputs that were answered there.
  State known_{};
  Drive::Flow known_flow_;
  Terminals known_terminals_;
  double known_field_V_ = 0.0;
  bool any_known_ = false;
};

}  // namespace imrig::plant
