#pragma once
// Advances the drive while the gates are off. Within a stretch the set of conducting diodes is fixed; where a
// current runs through zero the stretch ends there, found by bracketing, and its diode blocks. Diodes begin
// to conduct only at the start of a stretch, so at most one sample late and at zero current: nothing
// chatters, and no stretch can create energy. The current is exactly zero in a blocked phase.

#include "plant/diode_bridge.h"
#include "plant/drive.h"
#include "plant/integrator.h"
#include "plant/voltage_filter.h"

namespace imrig::plant {

class Freewheel {
 public:
  Freewheel(double dc_link_V, Drive& drive, Integrator& integrator)
      : bridge_(dc_link_V), drive_(drive), integrator_(integrator) {}

  void take_over(State& x);
  // fresh as in Integrator.
  void advance(State& x, double duration_s, VoltageFilter& filter, bool fresh);
  void set_dc_link_V(double dc_link_V) { bridge_.set_dc_link_V(dc_link_V); }
  const DiodeBridge& bridge() const { return bridge_; }

 private:
  struct Crossing {
    int phase = -1;
    double at_s = 0.0;
  };
  Crossing first_reversal(const State& from, State& to, double duration_s);
  double find_zero(const State& from, State& to, int phase, double duration_s);
  double current(const State& x, int phase) const;
  void place_current(State& x, std::complex<double> i_s);

  DiodeBridge bridge_;
  Drive& drive_;
  Integrator& integrator_;
  bool fresh_ = true;  // as in Integrator
};

}  // namespace imrig::plant
