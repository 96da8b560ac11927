#pragma once
// Dead time and voltage drop of a two-level inverter, seen on average. Over the dead time t_d a phase's
// current keeps flowing through a diode and decides the pole's voltage; a cycle T_c has two such gaps, of
// which one counts:
//   u_k = -[V_dc t_d/T_c + V_on] sgn(i_k) - r_on i_k,   sgn(i) = i/sqrt(i^2 + i_0^2),
// summed as space vectors over the three phases (what is common to them drops out). A sinusoidal current sees
// the harmonics 6k -+ 1 with amplitude (4/pi)(V_dc t_d/T_c + V_on)/n. Transistors and diodes drop alike. The
// width i_0 stands for the ripple and the charging of the switches' capacitances near zero current. Where
// every switching instant is followed (inverter kind "switching"), the gaps are made there, and only the drop
// is left here. Source: Choi and Sul, Inverter output voltage synthesis using novel dead time compensation,
// IEEE Trans. Power Electronics 11(2), 1996.

#include <cmath>

#include "plant/effects/effect.h"
#include "rig/base/space_vector.h"

namespace imrig::plant {

class InverterDeadTime final : public Effect {
 public:
  struct Config {
    double dead_time_s = 0.0;
    double drop_V = 0.0;    // V_on
    double drop_ohm = 0.0;  // r_on
    double width_A = 0.2;   // i_0
  };

  explicit InverterDeadTime(const Config& config) : config_(config) {}
  double dead_time_s() const { return config_.dead_time_s; }

  std::string name() const override { return "inverter_dead_time"; }
  unsigned hooks() const override {
    const bool acts = config_.dead_time_s > 0.0 || config_.drop_V > 0.0 || config_.drop_ohm > 0.0;
    return acts ? kAppliedVoltage : 0u;
  }
  std::vector<Parameter> parameters() const override {
    return {{"dead_time_s", "s", config_.dead_time_s},
            {"drop_V", "V", config_.drop_V},
            {"drop_ohm", "ohm", config_.drop_ohm},
            {"width_A", "A", config_.width_A}};
  }
  void applied_voltage(const Conditions& at, const double* /*own*/, std::complex<double>& v) const override {
    const double gap_V = at.cycle_s > 0.0 ? at.dc_link_V * config_.dead_time_s / at.cycle_s : 0.0;
    const double step_V = gap_V + config_.drop_V;
    const auto i = phases(at.i.s);
    const auto lost = [&](double i_k) {
      return step_V * i_k / std::sqrt(i_k * i_k + config_.width_A * config_.width_A);
    };
    const double a = lost(i[0]), b = lost(i[1]), c = lost(i[2]);
    v -= std::complex<double>((2.0 / 3.0) * a - (1.0 / 3.0) * (b + c), (b - c) * (1.0 / kSqrt3));
    v -= config_.drop_ohm * at.i.s;
  }

 private:
  Config config_;
};

}  // namespace imrig::plant
