// Both integrators over a start-up and a voltage step in the same run: how fast, how far apart, and what a
// tighter tolerance changes.

#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <vector>

#include "plant/effects/friction.h"
#include "plant/powers.h"
#include "plant/rk4_integrator.h"
#include "tests/plant/bench.h"

namespace {
long allocations = 0;
}

// C libraries count too: every way to the heap goes through malloc and its kin.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
extern "C" int __sanitizer_install_malloc_and_free_hooks(void (*)(const volatile void*, std::size_t),
                                                         void (*)(const volatile void*));
const int hooked = __sanitizer_install_malloc_and_free_hooks(
    [](const volatile void*, std::size_t) { ++allocations; }, [](const volatile void*) {});
#else
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* malloc(std::size_t size) { return ++allocations, __libc_malloc(size); }
void* calloc(std::size_t n, std::size_t size) { return ++allocations, __libc_calloc(n, size); }
void* realloc(void* p, std::size_t size) { return ++allocations, __libc_realloc(p, size); }
}
#endif

namespace imrig::plant {
namespace {

using namespace bench;

struct Trace {
  std::vector<Complex> i;
  std::vector<double> rpm;
  double times_real_time = 0.0;
};

// Start from rest under load, a step of -20 % at 1.0 s, back at 1.3 s; the command holds over the PWM cycle
// as the firmware's does.
Trace start_up_and_step(const IntegratorConfig& integrator) {
  PlantConfig c = config();
  c.sensors = SensorsConfig{};
  c.integrator = integrator;
  c.effects.push_back(std::make_shared<Friction>(Friction::Config{0.25, 0.0015, 0.2}));
  Plant plant(c);
  plant.set_excitation({60.0, 1.2, true, 0.0, 0.0});
  const int n = 27000;
  Trace trace;
  trace.i.reserve(n), trace.rpm.reserve(n);
  InverterCommand held;
  const auto start = std::chrono::steady_clock::now();
  for (int k = 0; k < n; ++k) {
    const double t = (k + 2) * 60e-6;
    if (k % 4 == 0)
      held = command(
          std::polar(t > 1.0 && t < 1.3 ? 143.7 : 179.6 * std::min(1.0, t / 0.05), 2.0 * kPi * 60.0 * t));
    plant.step(held);
    trace.i.push_back(plant.state().i_s), trace.rpm.push_back(plant.state().speed_rpm);
  }
  trace.times_real_time =
      n * 60e-6 / std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return trace;
}

struct Difference {
  double rms_A = 0.0, most_rpm = 0.0;
};

Difference difference(const Trace& a, const Trace& b) {
  Difference d;
  for (std::size_t k = 0; k < a.i.size(); ++k) {
    d.rms_A += std::norm(a.i[k] - b.i[k]) / static_cast<double>(a.i.size());
    d.most_rpm = std::max(d.most_rpm, std::abs(a.rpm[k] - b.rpm[k]));
  }
  d.rms_A = std::sqrt(d.rms_A);
  return d;
}

TEST(Integrator, FixedStepFollowsTheErrorControlledReference) {
  const IntegratorConfig shipped;
  const Trace reference = start_up_and_step(shipped);
  const Trace rk4 = start_up_and_step({IntegratorConfig::Kind::kRk4, 0.0, 0.0});
  const Difference d = difference(rk4, reference);
  std::printf(
      "ERKStep 5(4), rtol %.0e: %.1f x real time; RK4: %.1f x real time; apart %.2e A rms, %.2e rpm at "
      "most\n",
      shipped.rtol, reference.times_real_time, rk4.times_real_time, d.rms_A, d.most_rpm);
  EXPECT_GT(reference.rpm[16000], 1700.0);
  EXPECT_GT(std::abs(reference.rpm[16600] - reference.rpm[20000]), 3.0);  // the step was one
  EXPECT_LT(d.rms_A, 1e-5);
  EXPECT_LT(d.most_rpm, 1e-4);
}

TEST(Integrator, HalvingTheToleranceChangesNothingThatMatters) {
  IntegratorConfig config;
  const Trace shipped = start_up_and_step(config);
  config.rtol *= 0.5, config.atol *= 0.5;
  const Difference halved = difference(start_up_and_step(config), shipped);
  config.rtol = 1e-11, config.atol = 1e-13;
  const Difference tight = difference(start_up_and_step(config), shipped);
  std::printf("tolerance halved: %.2e A rms, %.2e rpm; at 1e-11: %.2e A rms, %.2e rpm\n", halved.rms_A,
              halved.most_rpm, tight.rms_A, tight.most_rpm);
  EXPECT_LT(halved.rms_A, 1e-7);
  EXPECT_LT(halved.most_rpm, 1e-6);
  EXPECT_LT(tight.rms_A, 1e-7);
  EXPECT_LT(tight.most_rpm, 1e-6);
}

TEST(Integrator, GoesOnAcrossHeldStepsAsIfRestarted) {
  const PlantConfig c = config();
  Drive drive(c);
  drive.terminals = {Terminals::Kind::kInverter, {50.0, 10.0}, 1.0};
  const auto going = make_integrator(c.integrator, drive), restarted = make_integrator(c.integrator, drive);
  State a = drive.initial(), b = a;
  for (int k = 0; k < 5000; ++k) {
    going->advance(a, 60e-6, k == 0);
    restarted->advance(b, 60e-6, true);
  }
  EXPECT_NEAR(a[kSpeed], b[kSpeed], 1e-7);
  for (std::size_t k = 0; k < kSpeed; ++k) EXPECT_NEAR(a[k], b[k], 1e-9) << k;
}

long allocated_while_running(const PlantConfig& c) {
  Plant plant(c);
  const Supply supply{60.0, 150.0};
  const long before = allocations;
  plant.set_excitation({60.0, 1.0, true, 0.0, 0.0});
  std::int64_t sum = 0;
  for (int k = 0; k < 6000; ++k) {
    sum += plant.step(k % 2000 < 1500 ? supply.at(plant) : InverterCommand{}).i[0];
    sum += plant.excitation().constant_current;
    sum += plant.powers().motor_W > 0.0;
  }
  EXPECT_NE(sum, 0);
  return allocations - before;
}

TEST(Integrator, AllocatesNothingInAStep) {
  PlantConfig simple = config();
  simple.sensors = SensorsConfig{};
  simple.effects.push_back(std::make_shared<Friction>(Friction::Config{0.25, 0.0015, 0.2}));
  PlantConfig full = load_plant_config(IMRIG_SOURCE_DIR "/models/plants/proca_5hp_full.toml");
  PlantConfig switching = full;
  switching.inverter.kind = InverterConfig::Kind::kSwitching;
  for (PlantConfig* c : {&simple, &full, &switching}) {
    for (const auto kind : {IntegratorConfig::Kind::kSundials, IntegratorConfig::Kind::kRk4}) {
      c->integrator.kind = kind;
      EXPECT_EQ(allocated_while_running(*c), 0) << c->name;
    }
  }
  // The counter does count.
  const long before = allocations;
  EXPECT_NE(std::make_unique<std::vector<int>>(1000), nullptr);
  EXPECT_GT(allocations, before);
}

}  // namespace
}  // namespace imrig::plant
