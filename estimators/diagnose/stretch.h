#pragma once
// A piece of data under one operating condition: a stretch of a record, or one point of a table. Where a
// model fails is asked of stretches, so that one free-running log has as much to tell as a campaign of many
// short records.

#include <string>
#include <vector>

#include "estimators/diagnose/channel.h"
#include "rig/data/conditions.h"

namespace imrig::est {

struct Stretch {
  Conditions conditions;
  double time_s = kMissing;  // of its middle, on the device's clock where there is one, else in its record
  Channels channels;
  // Signed errors of its channels, which |error| hides where a fit balances them: of the current its mean in
  // phase with the voltage and behind it ("active", "reactive", A); of a point each channel's own ("", unit).
  // The same list in every stretch; NaN where a cell was empty.
  struct Signed {
    std::string channel, part;
    double error = kMissing;
  };
  std::vector<Signed> signed_errors;
};

}  // namespace imrig::est
