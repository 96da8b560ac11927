#pragma once
// The classical formula of order four, one step a stretch:
//   y(t + h) = y + h (k1 + 2 k2 + 2 k3 + k4)/6.
// Its stages tell when a kink lies within the step (the inverter's dead time where a phase current turns,
// friction where the shaft does) or a transient too fast for it (a deep bar after a switch of the full link):
// then h/3 |k2 - k3| or h/6 |k1 - k2 - k3 + k4|, of third order and far below in a smooth stretch, exceeds
// the constants below, and the step is made again in two halves, at most kMostHalvings times over. Which
// steps these are depends on the state alone.
// A stretch of at most kShort of the sample time h, as switching instants leave them, is made by the midpoint
// formula y + h k2 at half the price: for a mode of rate w its error (w h/5)^3/6 is below the (w h)^5/120
// that a whole sample is allowed from w h = 0.4 on, and small where the mode is slower. The point where a
// step ends begins the next one; saturated currents follow from stage to stage, and slow effects move at the
// rate of the step's middle, k2, and until it is known at the last step's.

#include "plant/integrator.h"

namespace imrig::plant {

class Rk4Integrator final : public Integrator {
 public:
  explicit Rk4Integrator(const Drive& drive)
      : drive_(drive), n_(drive.size()), short_s_(kShort * drive.sample_s()) {}

  void advance(State& x, double h, bool fresh) override;
  const Drive::Flow& flow(const State& x) override;

  static constexpr double kBendStator_Wb = 2e-6, kBendRotor_Wb = 2e-5;
  static constexpr double kBend_rad_s = 2e-5;
  static constexpr int kMostHalvings = 4;
  static constexpr double kShort = 0.2;  // of the sample time

 private:
  void derivatives(const State& x, State& dx);
  void stage(const State& x, double h, const State& slope, State& out);
  void step(State& x, const State& k1, double h, int halvings);
  bool smooth(const State& x, const State& k1, double h, bool must);
  void midpoint(State& x, const State& k1, double h);
  bool followed() const;
  bool settled(const State& x) const;

  const Drive& drive_;
  std::size_t n_;
  double short_s_;
  State at_{}, k2_{}, k3_{}, k4_{};
  State slow_{};  // rates of the slow effects, from the last step
  Drive::Memory memory_;
  // The point that flow() was asked for last, its state and the inputs there.
  bool known_ = false;
  Drive::Flow flow_;
  State known_x_{};
  Terminals known_terminals_;
  double known_field_V_ = 0.0;
};

}  // namespace imrig::plant
