#pragma once
// The voltage dividers behind their filter: the errors of channel_errors.h.

#include "plant/effects/channel_errors.h"

namespace imrig::plant {

class VoltageSensors final : public Effect {
 public:
  explicit VoltageSensors(const ChannelErrors& errors) : errors_(errors) {}
  std::string name() const override { return "voltage_sensors"; }
  unsigned hooks() const override { return errors_.none() ? 0u : kMeasured; }
  std::vector<Parameter> parameters() const override { return errors_.parameters("V"); }
  void measured(const Conditions& /*at*/, const double* /*own*/, Measured& values) const override {
    errors_.apply(values.v);
  }

 private:
  ChannelErrors errors_;
};

}  // namespace imrig::plant
