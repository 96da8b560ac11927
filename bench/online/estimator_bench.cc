// usage: imrig-bench-online [--json] [--root DIR] [--minutes N] NAME...
// NAME: estimator_ns_per_sample estimator_latency_ratio estimator_replays soak, and estimator_compare: a table

#include "bench/online/estimator_bench.h"

#include <filesystem>
#include <imrig_msg/samples_t.hpp>
#include <set>

#include "bench/command.h"
#include "bench/one_core.h"
#include "estimators/online/estimator_node.h"
#include "rig/base/error.h"
#include "rig/base/file.h"
#include "rig/base/rig_config.h"
#include "rig/bus/guarded_decode.h"
#include "tests/estimators/online/emulated_motor.h"

namespace imrig::bench {

namespace {

std::string plant_of(const std::string& root) {
  std::string toml = read_text(root + "/models/plants/proca_5hp.toml");
  const std::string slow = "\"sundials\"";
  return toml.replace(toml.find(slow), slow.size(), "\"rk4\"");
}

imrig_msg::samples_t message_of(const est::SampleBlock& b, std::int64_t seq) {
  imrig_msg::samples_t m = {};
  m.utime = b.first_index * b.sample_time_ns / 1000;
  m.seq = seq;
  m.samples_v1 = 1;
  m.boot_id = b.boot_id;
  m.first_index = b.first_index;
  m.sample_time_ns = b.sample_time_ns;
  m.gates_on = b.gates_on ? 1 : 0;
  m.current_A_per_count = static_cast<float>(b.current_A_per_count);
  m.voltage_V_per_count = static_cast<float>(b.voltage_V_per_count);
  m.voltage_filter_s = static_cast<float>(b.voltage_filter_s);
  m.full_scale_counts = 2047;
  m.encoder_counts_per_rev = b.encoder_counts_per_rev;
  m.stator_C = static_cast<float>(b.stator_C);
  m.n = static_cast<std::int32_t>(b.size());
  const auto copy = [](const auto& from, auto& to) { to.assign(from.begin(), from.end()); };
  copy(b.i_a, m.i_a);
  copy(b.i_b, m.i_b);
  copy(b.i_c, m.i_c);
  copy(b.v_a, m.v_a);
  copy(b.v_b, m.v_b);
  copy(b.v_c, m.v_c);
  copy(b.encoder, m.encoder);
  return m;
}

// Bytes of the samples to bytes of the estimates, everything on, one pinned core.
Result ns_per_sample(const std::string& root) {
  constexpr double kSeconds = 30.0;
  const auto messages = motor_messages(root, kSeconds);
  const bool pinned = pin_to_one_core();
  std::int64_t estimates = 0, samples = 0;
  const auto work = [&] {
    est::EstimatorNode node(estimator_config(root), [](est::EstimatorNode::Kind, Bytes) {});
    imrig_msg::samples_t block = {};
    for (const auto& m : messages) {
      if (guarded_decode_into(m, block)) node.take(block);
    }
    estimates = node.estimates();
    samples = node.read_index();
  };
  const Spread s = spread(timed(9, work));
  const double per = 1e9 / static_cast<double>(samples);
  return {"estimator_ns_per_sample", s.median * per, "ns", 1000.0, false,
          fmt::format("{:.0f} s of the 5 hp motor, decoding and encoding included, observer, joint filter and model all on{}: {} samples, {} "
                      "estimates; least {:.0f}, most {:.0f} ns of 9 runs",
                      kSeconds, pinned ? ", one core" : "", samples, estimates, s.least * per, s.most * per)};
}

// The same log read a hundred times by the real process.
Result replays(const std::string& root) {
  constexpr int kTimes = 100;
  const Scratch scratch;
  const std::string folder = scratch / "campaign";
  answer(fmt::format("imrig campaign run {0}/campaigns/smoke.toml --emulate {0}/models/plants/proca_5hp.toml --pace max --out {1} --json", root, folder));
  std::set<std::string> kinds;
  std::size_t bytes = 0;
  for (int k = 0; k < kTimes; ++k) {
    const std::string out = scratch / fmt::format("{}.lcm", k);
    const std::string command = fmt::format("{}/imrig-estimator --config {}/rig.toml --url 'file://{}/log-000.lcm?speed=0' --out {} > /dev/null",
                                            executable_folder(), folder, folder, out);
    if (std::system(command.c_str()) != 0) throw Error(command, "failed");
    std::string all = read_text(out);
    bytes = all.size();
    kinds.insert(std::move(all));
    std::filesystem::remove(out);
  }
  return {"estimator_replays", static_cast<double>(kinds.size()), "different results", 1.0, false,
          fmt::format("{} times imrig-estimator --url file://LOG?speed=0 on a log of campaigns/smoke.toml, whole output files of {} bytes compared", kTimes, bytes)};
}

int body(int argc, char** argv) {
  bool as_json = false;
  std::string root = ".";
  double minutes = 60.0;
  std::vector<std::string> names;
  for (int k = 1; k < argc; ++k) {
    const std::string word = argv[k];
    if (word == "--json") as_json = true;
    else if (word == "--echo" && k + 1 < argc) return answer_echoes(argv[k + 1]);
    else if (word == "--root" && k + 1 < argc) root = argv[++k];
    else if (word == "--minutes" && k + 1 < argc) minutes = std::stod(argv[++k]);
    else names.push_back(word);
  }
  for (const std::string& name : names) {
    if (name == "estimator_ns_per_sample") print(ns_per_sample(root), as_json);
    else if (name == "estimator_latency_ratio") print(estimator_latency_ratio(root, 30), as_json);
    else if (name == "estimator_replays") print(replays(root), as_json);
    else if (name == "soak") for (const Result& r : soak(root, minutes)) print(r, as_json);
    else if (name == "estimator_compare") compare_estimators(root);
    else throw Error("usage", "no benchmark is called " + name);
  }
  return 0;
}

}  // namespace

std::vector<std::vector<std::uint8_t>> motor_messages(const std::string& root, double seconds) {
  std::vector<std::vector<std::uint8_t>> out;
  test::EmulatedMotor motor(plant_of(root), [&](const est::SampleBlock& b) {
    const auto m = message_of(b, static_cast<std::int64_t>(out.size()));
    out.emplace_back(static_cast<std::size_t>(m.getEncodedSize()));
    m.encode(out.back().data(), 0, static_cast<int>(out.back().size()));
  });
  motor.rest(0.5);
  motor.run(1.5, 60.0, 180.0);
  const double fields_A[] = {1.5, 1.2, 1.7};
  for (int k = 0; motor.time_s() < seconds; ++k) {
    motor.excite(fields_A[k % 3]);
    motor.run(3.0, 60.0, 180.0);
  }
  return out;
}

est::EstimatorConfig estimator_config(const std::string& root) {
  est::EstimatorConfig c;
  c.follower.motor = est::knowledge_of(est::nominal_model(load_rig_config(root + "/models/rigs/proca_5hp.toml").motor));
  return c;
}

}  // namespace imrig::bench

int main(int argc, char** argv) { return imrig::run_main("imrig-bench-online", imrig::bench::body, argc, argv); }
