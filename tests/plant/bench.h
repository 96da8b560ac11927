#pragma once
// What the plant's tests share: the 2002 paper's motor with perfect sensors, and ways to drive it.

#include <cmath>
#include <complex>
#include <cstdint>

#include "plant/plant.h"
#include "plant/plant_config.h"
#include "rig/base/space_vector.h"

namespace imrig::plant::bench {

using Complex = std::complex<double>;

// Table II, inverse-gamma circuit: what the analytic formulas of the tests use.
inline constexpr double kRs = 0.39, kRr = 0.22, kLl = 0.006, kLm = 0.068;
inline constexpr int kPolePairs = 2;

inline PlantConfig config() {
  PlantConfig c;
  c.machine = machine_of_inverse_gamma(kRs, kRr, kLl, kLm, kPolePairs);
  c.sensors.ideal = true;
  return c;
}

inline double sample_s(const Plant& plant) { return static_cast<double>(plant.sample_time_ns()) * 1e-9; }

inline InverterCommand command(Complex v) {
  const auto p = phases(v);
  return {{p[0], p[1], p[2]}, true};
}

// A supply that turns at f_Hz with amplitude V, sampled at the middle of each held step (the hold's mean
// delay is then none).
struct Supply {
  double f_Hz, V;
  double soft_s = 0.0;  // the amplitude rises over this time
  InverterCommand at(const Plant& plant) const {
    const double h = sample_s(plant), t = (static_cast<double>(plant.index()) + 0.5) * h;
    const double amplitude = soft_s > 0.0 ? V * std::min(1.0, t / soft_s) : V;
    return command(std::polar(amplitude, 2.0 * kPi * f_Hz * t));
  }
  // Amplitude of the fundamental of what is held.
  double fundamental_V(const Plant& plant) const {
    const double x = kPi * f_Hz * sample_s(plant);
    return V * std::sin(x) / x;
  }
};

inline void run(Plant& plant, const Supply& supply, double duration_s) {
  const auto end = plant.index() + std::llround(duration_s / sample_s(plant));
  while (plant.index() < end) plant.step(supply.at(plant));
}

inline void hold(Plant& plant, const InverterCommand& command, double duration_s) {
  const auto end = plant.index() + std::llround(duration_s / sample_s(plant));
  while (plant.index() < end) plant.step(command);
}

}  // namespace imrig::plant::bench
