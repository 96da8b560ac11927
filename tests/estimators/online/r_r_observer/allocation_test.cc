#include <gtest/gtest.h>

#include "estimators/online/r_r_observer/r_r_observer.h"
#include "tests/estimators/online/r_r_observer/phasor_motor.h"
#include "tests/support/count_allocations.h"

namespace imrig::est {
namespace {

TEST(RotorObserverMemory, NothingIsAllocatedPerSample) {
  RotorObserverConfig c;
  c.voltage_filter_s = 160e-6;
  c.circuit = {0.39, 0.068, 150.0, 0.22};
  RotorObserver observer(c);
  phasor::Source source({}, {}, 1);
  int valid = 0;
  const long before = test::allocations;
  for (int k = 0; k < 40000; ++k) {
    const auto s = source.at({}, k * 60e-6);
    const auto e = observer.take(s.v, s.i, s.speed_rad_s);
    if (e && e->status == RotorResistanceStatus::kValid) ++valid;
    if (k == 30000) observer.interrupt(40000);
  }
  EXPECT_EQ(test::allocations, before);
  EXPECT_GE(valid, 5);
}

}  // namespace
}  // namespace imrig::est
