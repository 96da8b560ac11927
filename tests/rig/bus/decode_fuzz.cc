// Whatever bytes arrive: decoding comes back, and what it accepts encodes to the same bytes.

#include <cstdlib>
#include <imrig_msg/ack_t.hpp>
#include <imrig_msg/bridge_cmd_t.hpp>
#include <imrig_msg/heartbeat_t.hpp>

#include "rig/bus/guarded_decode.h"
#include "tests/rig/bus/messages.h"

using namespace imrig;

namespace {
template <class Message>
void check(Bytes data) {
  const auto message = guarded_decode<Message>(data);
  if (!message) return;
  const auto again = test::encoded(*message);
  if (!std::equal(again.begin(), again.end(), data.begin(), data.end())) std::abort();
}
}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Bytes bytes(data, size);
  check<imrig_msg::samples_t>(bytes);
  check<imrig_msg::series_t>(bytes);
  check<imrig_msg::points_t>(bytes);
  check<imrig_msg::record_t>(bytes);
  check<imrig_msg::remark_t>(bytes);
  check<imrig_msg::dataset_t>(bytes);
  check<imrig_msg::campaign_status_t>(bytes);
  check<imrig_msg::ack_t>(bytes);
  check<imrig_msg::heartbeat_t>(bytes);
  check<imrig_msg::bridge_cmd_t>(bytes);
  return 0;
}

std::vector<std::vector<std::uint8_t>> fuzz_corpus() {
  using namespace imrig::test;
  imrig_msg::heartbeat_t beat = {};
  beat.heartbeat_v1 = 1;
  return {encoded(samples()), encoded(series()),  encoded(points()),          encoded(record()),
          encoded(remark()),  encoded(dataset()), encoded(campaign_status()), encoded(beat)};
}
