#pragma once
// The inverter with its gates off: six freewheeling diodes on a stiff DC link. A phase whose current flows
// into the motor hangs on the lower rail, one whose current flows out on the upper rail, and one without
// current floats until its terminal leaves the rails. Currents can therefore only be driven towards zero or
// fed by an EMF above the link's voltage. Diodes are ideal; potentials are against the link's middle.

#include <array>
#include <complex>

#include "plant/drive.h"

namespace imrig::plant {

class DiodeBridge {
 public:
  enum class Leg { kOff, kLower, kUpper };

  explicit DiodeBridge(double dc_link_V) : half_V_(0.5 * dc_link_V) {}

  void set_dc_link_V(double dc_link_V) { half_V_ = 0.5 * dc_link_V; }
  // The gates have just opened while i_s flows.
  void take_over(std::complex<double> i_s);
  Terminals terminals() const;
  // Lets floating legs conduct that the EMF v_s drives beyond the rails. v_s: terminal voltage under
  // terminals(). True when one did.
  bool conduct_where_forced(std::complex<double> v_s);
  bool reversed(int phase, double current_A) const;  // flows against its diode
  // The phase's current has come to zero: its diode blocks. Returns the current vector that is left, made
  // exact.
  std::complex<double> block(int phase, std::complex<double> i_s);
  void block_all() { legs_ = {Leg::kOff, Leg::kOff, Leg::kOff}; }
  bool open() const { return conducting() == 0; }
  int conducting() const;

  static std::complex<double> axis(int phase);  // unit vector along phase 0, 1, 2

 private:
  double half_V_;
  std::array<Leg, 3> legs_{};
};

}  // namespace imrig::plant
