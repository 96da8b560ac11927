#include <gtest/gtest.h>

#include "estimators/online/estimator_node.h"
#include "rig/bus/guarded_decode.h"
#include "tests/estimators/online/sample_message.h"
#include "tests/estimators/online/synthetic.h"
#include "tests/support/count_allocations.h"

namespace imrig::est {
namespace {

TEST(OperatingPointMemory, NothingIsAllocatedAfterTheFirstBlock) {
  Signal s;
  const std::size_t n = 33000;
  const Samples x = make_samples(s, n);
  int windows = 0;
  OperatingPointEstimator estimator({}, [&](const OperatingPoint&) { ++windows; });
  estimator.feed(block_of(s, x, 0, 1, 0));
  const long before = test::allocations;
  for (std::size_t at = 1; at + 128 <= n; at += 128) {
    estimator.feed(block_of(s, x, at, 128, static_cast<std::int64_t>(at)));
  }
  SampleBlock off = block_of(s, x, 0, 30000, static_cast<std::int64_t>(n) + 1000);
  off.gates_on = false;
  estimator.feed(off);
  EXPECT_EQ(test::allocations, before);
  EXPECT_GE(windows, 15);
  EXPECT_GT(before, 0);
}

// The whole path of a block, from the message's bytes to the bytes of the estimates: rest, start, a gap, standstill.
TEST(EstimatorMemory, ABlockCostsNoAllocationOnceTheSampleTimeIsKnown) {
  Signal s;
  const std::size_t n = 100000;
  const Samples x = make_samples(s, n);
  std::vector<std::vector<std::uint8_t>> messages;
  for (std::size_t at = 0; at + 256 <= n; at += 256) {
    if (at / 256 == 200) continue;
    imrig_msg::samples_t m = sample_message(s, x, at, 256, static_cast<std::int64_t>(at / 256));
    m.gates_on = at > 3 * 256 && (at / 256) % 100 != 0 ? 1 : 0;
    auto& bytes = messages.emplace_back(static_cast<std::size_t>(m.getEncodedSize()));
    m.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  }
  EstimatorConfig config;
  config.follower.motor = knowledge_of(nominal_model(MotorConfig{}));
  std::int64_t bytes_out = 0;
  EstimatorNode node(config, [&](EstimatorNode::Kind, Bytes data) { bytes_out += static_cast<std::int64_t>(data.size()); });
  imrig_msg::samples_t block = {};
  const auto take = [&](const std::vector<std::uint8_t>& bytes) {
    ASSERT_TRUE(guarded_decode_into(bytes, block));
    node.take(block);
  };
  take(messages[0]);
  const long before = test::allocations;
  for (const auto& m : messages) take(m);
  EXPECT_EQ(test::allocations, before);
  EXPECT_GT(node.estimates(), 20);
  EXPECT_GT(bytes_out, 20 * 1000);
}

}  // namespace
}  // namespace imrig::est
