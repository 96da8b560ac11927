#pragma once
// The current sensors on their way to the converters: a first-order lag tau and a delay T, then the errors of
// channel_errors.h.
//   tau dy/dt = i - y;   delay as the all-pass (1 - s T/2)/(1 + s T/2): phase w T within (w T)^3/12.
// Both act on the space vector, all phases alike. A zero-sequence current is not measured: none flows.

#include <algorithm>

#include "plant/effects/channel_errors.h"
#include "rig/base/space_vector.h"

namespace imrig::plant {

class CurrentSensors final : public Effect {
 public:
  struct Config {
    ChannelErrors errors;
    double lag_s = 0.0, delay_s = 0.0;
  };

  explicit CurrentSensors(const Config& config) : config_(config) {}
  std::string name() const override { return "current_sensors"; }
  unsigned hooks() const override {
    return (config_.errors.none() && states() == 0 ? 0u : kMeasured) | (states() > 0 ? kStates : 0u);
  }
  std::vector<Parameter> parameters() const override {
    auto list = config_.errors.parameters("A");
    list.push_back({"lag_s", "s", config_.lag_s});
    list.push_back({"delay_s", "s", config_.delay_s});
    return list;
  }
  double fastest_rate_per_s() const override {
    return std::max(config_.lag_s > 0.0 ? 1.0 / config_.lag_s : 0.0,
                    config_.delay_s > 0.0 ? 2.0 / config_.delay_s : 0.0);
  }
  // Lagged current, then the all-pass's slow part z: T/2 dz/dt = u - z, output 2 z - u.
  std::size_t states() const override {
    return (config_.lag_s > 0.0 ? 2u : 0u) + (config_.delay_s > 0.0 ? 2u : 0u);
  }
  void initial(double* own) const override {
    for (std::size_t k = 0; k < states(); ++k) own[k] = 0.0;
  }
  void derivatives(const Conditions& at, const double* own, double* d_own) const override {
    std::complex<double> u = at.i.s;
    if (config_.lag_s > 0.0) {
      d_own[0] = (u.real() - own[0]) / config_.lag_s;
      d_own[1] = (u.imag() - own[1]) / config_.lag_s;
      u = {own[0], own[1]};
      own += 2, d_own += 2;
    }
    if (config_.delay_s > 0.0) {
      d_own[0] = 2.0 * (u.real() - own[0]) / config_.delay_s;
      d_own[1] = 2.0 * (u.imag() - own[1]) / config_.delay_s;
    }
  }
  void measured(const Conditions& at, const double* own, Measured& values) const override {
    if (states() > 0) {
      std::complex<double> u = at.i.s;
      if (config_.lag_s > 0.0) u = {own[0], own[1]}, own += 2;
      if (config_.delay_s > 0.0) u = 2.0 * std::complex<double>(own[0], own[1]) - u;
      const auto i = phases(u);
      for (std::size_t k = 0; k < 3; ++k) values.i[k] = i[k];
    }
    config_.errors.apply(values.i);
  }

 private:
  Config config_;
};

}  // namespace imrig::plant
