#pragma once
// The field's DC supply. It gives the smaller of two voltages: the ramped set voltage, and what a PI current
// loop asks for,
//   v = min(v_set, k_p (I_set - i) + k_i integral(I_set - i)), within [0, max_V];
// the loop integrates only while it is in charge. Off, or tripped, the field freewheels on zero volts.
// Updated at a fixed period, held between.

#include "plant/excitation.h"
#include "plant/plant_config.h"

namespace imrig::plant {

class ExcitationSupply {
 public:
  explicit ExcitationSupply(const SupplyConfig& config) : config_(config) {}

  void set(const ExcitationCommand& command);
  // One control period; returns the voltage held until the next one.
  double update(double field_A, double period_s);
  double output_V() const { return V_; }
  ExcitationReadback readback() const { return readback_; }

 private:
  double regulated(double field_A, double period_s);
  void protect(double field_A);
  bool tripped() const { return readback_.tripped_ovp || readback_.tripped_ocp; }

  SupplyConfig config_;
  ExcitationCommand command_;
  ExcitationReadback readback_;
  double ramped_V_ = 0.0, integral_V_ = 0.0, V_ = 0.0;
};

}  // namespace imrig::plant
