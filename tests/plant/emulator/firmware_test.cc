#include "plant/firmware.h"

#include <gtest/gtest.h>

#include "plant/plant_config.h"
#include "rig/base/space_vector.h"
#include "tests/rig/link/device_bench.h"

namespace imrig::plant {
namespace {

using test::voltage_segment;

PlantConfig ideal() {
  PlantConfig config;
  config.machine = machine_of_inverse_gamma(0.39, 0.22, 0.006, 0.068, 2);
  config.sensors.ideal = true;
  config.sensors.voltage_filter_s = 0.0;
  return config;
}

class OnThePlant : public testing::Test {
 protected:
  OnThePlant() : plant(ideal()), firmware(plant, 1, false) { say(imrig_encode_hello, test::bench_hello()); }

  template <class Message>
  void say(std::size_t (*encode)(const Message*, std::uint8_t*, std::size_t), const Message& message) {
    firmware.feed(frame_of(encode, message), 0);
  }
  void start(imrig_segment segment) {
    segment.seq = 2;
    segment.profile_id = 1;
    say(imrig_encode_segment, segment);
    say(imrig_encode_commit, imrig_commit{0, 3, 1, 1, 1, IMRIG_AT_END_GATES_OFF});
    say(imrig_encode_order, imrig_order{0, 4, 1, IMRIG_START, 1, 0.0});
  }
  RawSample sample() {
    const RawSample raw = plant.step(firmware.command());
    firmware.sample(raw);
    std::vector<std::uint8_t> frame(IMRIG_FRAME_MAX);
    while (const std::size_t n = firmware.take(frame)) {
      reader.feed({frame.data(), n}, [&](auto payload) { test::hear(payload, heard); });
    }
    return raw;
  }

  Plant plant;
  Firmware firmware;
  FrameReader reader;
  test::Heard heard;
};

TEST_F(OnThePlant, WhatIsComputedFromASampleActsFromTheNextOneOn) {
  const double scale = plant.scale().voltage_V_per_count;
  sample();  // sample 0
  start(voltage_segment(400, 10, 10, 0, 0));
  // Command 4 is the first of a PWM cycle that can still be reached: it acts from the instant of sample 4 on,
  // and sample 5 is the first to show it.
  for (int k = 1; k <= 4; ++k) EXPECT_NEAR(scale * sample().v[0], 0.0, 0.1) << k;
  for (int k = 5; k <= 404; ++k) EXPECT_NEAR(scale * sample().v[0], 10.0, 0.1) << k;
  sample();
  EXPECT_FALSE(firmware.command().gates_on);
  for (int k = 0; k < 256; ++k) sample();
  ASSERT_GE(heard.blocks.size(), 2u);
  EXPECT_EQ(heard.blocks[0].n, 4);
  EXPECT_EQ(heard.blocks[1].first_index, 4);
  EXPECT_EQ(heard.blocks[1].gates_on, 1);
}

TEST_F(OnThePlant, ATripOpensTheGatesBeforeTheNextStep) {
  start(voltage_segment(40000, 10, 10, 10, 10));
  for (int k = 0; k < 100; ++k) sample();
  EXPECT_TRUE(firmware.command().gates_on);
  say(imrig_encode_order, imrig_order{0, 5, 1, IMRIG_TRIP, 0, 0.0});
  EXPECT_FALSE(firmware.command().gates_on);
}

TEST_F(OnThePlant, RegulatedDcCurrentIsWhatTheDcTestNeeds) {
  imrig_segment dc = test::off_segment(60000);
  dc.kind = IMRIG_DC;
  dc.plus_phases = 1;
  dc.minus_phases = 6;
  dc.level_A = 8.0;
  dc.kp_V_per_A = dc.ki_V_per_As = test::kNan;
  start(dc);
  RawSample raw = {};
  for (int k = 0; k < 55000; ++k) raw = sample();
  const SensorScale scale = plant.scale();
  EXPECT_NEAR(scale.current_A_per_count * raw.i[0], 8.0, 0.05);
  EXPECT_NEAR(scale.current_A_per_count * raw.i[1], -4.0, 0.05);
  // Phase a against b and c in parallel is one and a half R_s.
  EXPECT_NEAR(scale.voltage_V_per_count * (raw.v[0] - raw.v[1]), 8.0 * 1.5 * 0.39, 0.05);
  EXPECT_LT(std::abs(plant.state().speed_rpm), 1e-6);
}

}  // namespace
}  // namespace imrig::plant
