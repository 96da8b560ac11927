// The real process imrig-emulator over real sockets and a real serial line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <modbus/modbus.h>
#include <sys/resource.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/e2e/command.h"
#include "tests/plant/emulator/minimal_host.h"
#include "tests/rig/link/device_bench.h"
#include "tests/rig/link/serial_line.h"

namespace imrig::test {
namespace {

using testing::HasSubstr;

const std::string kPlant = source("models/plants/proca_5hp.toml");

// The process, its addresses from its ready line.
class Emulated {
 public:
  explicit Emulated(std::vector<std::string> more, const std::string& link_url = "udp://127.0.0.1:0") {
    std::vector<std::string> argv = {"imrig-emulator", "--config",         kPlant, "--link", link_url,
                                     "--modbus",       "tcp://127.0.0.1:0"};
    argv.insert(argv.end(), more.begin(), more.end());
    process.emplace(argv, folder_ / "out");
    for (int k = 0; k < 600 && !read_ready_line(); ++k)
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  std::string link, modbus;
  std::optional<Background> process;

 private:
  bool read_ready_line() {
    std::ifstream file(folder_ / "out");
    std::string ready, first, second;
    if (!(file >> ready >> first >> second) || ready != "ready" || file.peek() != '\n') return false;
    link = first.substr(std::strlen("link="));
    modbus = second.substr(std::strlen("modbus="));
    return true;
  }
  Folder folder_;
};

LinkProfile ramp_profile() {
  LinkProfile profile;
  profile.profile_id = 1;
  profile.at_end = IMRIG_AT_END_HOLD;
  imrig_segment hold = voltage_segment(16667, 180, 180, 60, 60);
  hold.record = 5;
  profile.segments = {voltage_segment(33334, 0, 180, 0, 60), voltage_segment(16667, 180, 180, 60, 60), hold};
  return profile;
}

std::complex<double> mean_in_frame(const std::vector<Sampled>& samples, double f_Hz,
                                   SpaceVector Sampled::*quantity) {
  std::complex<double> sum = 0.0;
  for (const Sampled& s : samples)
    sum += s.*quantity * std::polar(1.0, -2 * kPi * f_Hz * kSample_s * static_cast<double>(s.index));
  return sum / static_cast<double>(samples.size());
}

// 180 V peak at 60 Hz on the paper's motor without load: I = V / |R_s + j w (L_l + L_m)| plus what friction
// and the generator's iron-free drag ask for.
void expect_the_motor(MinimalHost& host) {
  ASSERT_TRUE(host.connect());
  ASSERT_EQ(host.result_of(host.link.upload(ramp_profile())), IMRIG_DONE);
  ASSERT_EQ(host.result_of(host.link.start(1)), IMRIG_DONE);
  ASSERT_TRUE(host.until([&] { return host.status.state == IMRIG_HOLDING; }, 120));
  std::vector<Sampled> recorded;
  ASSERT_TRUE(host.until([&] {
    return !host.blocks.empty() && host.blocks.back().segment < 0 && host.blocks.back().gates_on == 1;
  }));
  for (const Sampled& s : samples_of(host)) {
    if (s.record == 5) recorded.push_back(s);
  }
  ASSERT_EQ(recorded.size(), 16667u);
  const auto v = mean_in_frame(recorded, 60.0, &Sampled::v_V);
  const auto i = mean_in_frame(recorded, 60.0, &Sampled::i_A);
  const double w = 2 * kPi * 60;
  EXPECT_NEAR(std::abs(v), 180.0 / std::hypot(1.0, w * 160e-6), 1.0);
  EXPECT_NEAR(std::abs(i), 180.0 / std::hypot(0.39, w * 0.074), 0.15);
  EXPECT_GT(std::arg(v / i), 1.3);  // nearly idle: the current lags by almost a quarter turn
  EXPECT_LT(std::arg(v / i), kPi / 2 + w * 160e-6);
  const double turns = static_cast<double>(recorded.back().encoder - recorded.front().encoder) / 4096;
  const double rpm = 60.0 * turns / (16666 * kSample_s);
  EXPECT_GT(rpm, 1780.0);
  EXPECT_LT(rpm, 1801.0);

  ASSERT_EQ(host.result_of(host.link.stop(0.1)), IMRIG_DONE);
  ASSERT_TRUE(host.until([&] { return host.status.state == IMRIG_IDLE; }));
  ASSERT_TRUE(host.until([&] { return host.blocks.back().gates_on == 0; }));
  EXPECT_EQ(host.link.lost_blocks(), 0);
  EXPECT_EQ(host.link.bad_frames(), 0);
}

TEST(EmulatorProcess, AtMaxPaceRunsTheMotorUpAndTheCurrentIsTheMotors) {
  Emulated emulator({"--pace", "max", "--seed", "3"});
  MinimalHost host(emulator.link);
  const std::int64_t began = monotonic_us();
  expect_the_motor(host);
  const double wall_s = static_cast<double>(monotonic_us() - began) * 1e-6;
  const double rig_s = static_cast<double>(host.link.next_index()) * kSample_s;
  std::printf("%.2f s of the rig in %.2f s: %.1f times real time\n", rig_s, wall_s, rig_s / wall_s);
  EXPECT_EQ(host.link.welcome()->waits_for_credit, 1);
  EXPECT_EQ(emulator.process->stop(), 0);
}

TEST(EmulatorProcess, SpeaksTheSameOverASerialLine) {
  SerialLine line;
  Emulated emulator({"--pace", "max"}, "serial://" + line.names[0] + "?baud=4000000");
  EXPECT_EQ(emulator.link, "serial://" + line.names[0] + "?baud=4000000");
  MinimalHost host("serial://" + line.names[1] + "?baud=4000000");
  expect_the_motor(host);
  EXPECT_EQ(emulator.process->stop(), 0);
}

// Nothing is granted before the start is answered, so every command falls on the same sample.
std::vector<imrig_block> blocks_of_a_run(const std::string& seed) {
  Emulated emulator({"--pace", "max", "--seed", seed});
  MinimalHost host(emulator.link);
  host.credit_end = 0;
  EXPECT_TRUE(host.connect());
  EXPECT_EQ(host.result_of(host.link.upload(ramp_profile())), IMRIG_DONE);
  EXPECT_EQ(host.result_of(host.link.start(1)), IMRIG_DONE);
  EXPECT_EQ(host.link.next_index(), 0);
  host.credit_end = 20000;
  EXPECT_TRUE(host.reach(19000));
  return host.blocks;
}

TEST(EmulatorProcess, WithTheSameSeedGivesTheSameBitsAndWithAnotherOthers) {
  const auto first = blocks_of_a_run("7"), second = blocks_of_a_run("7"), other = blocks_of_a_run("8");
  const std::size_t n = std::min({first.size(), second.size(), other.size()});
  ASSERT_GT(n, 70u);
  int different = 0;
  for (std::size_t k = 0; k < n; ++k) {
    EXPECT_EQ(std::memcmp(&first[k], &second[k], sizeof first[k]), 0) << k;
    different += std::memcmp(first[k].i_a, other[k].i_a, sizeof first[k].i_a) != 0;
  }
  EXPECT_GT(different, 60);
}

TEST(EmulatorProcess, IsLoadedThroughItsModbusRegisters) {
  Emulated emulator({"--pace", "max"});
  MinimalHost host(emulator.link);
  ASSERT_TRUE(host.connect());
  ASSERT_EQ(host.result_of(host.link.upload(ramp_profile())), IMRIG_DONE);
  ASSERT_EQ(host.result_of(host.link.start(1)), IMRIG_DONE);
  ASSERT_TRUE(host.until([&] { return host.status.state == IMRIG_HOLDING; }, 120));
  ASSERT_TRUE(host.reach(host.link.next_index() + 16667));
  const double idle_rpm = static_cast<double>(host.status.speed_rpm);

  const std::string port = emulator.modbus.substr(emulator.modbus.rfind(':') + 1);
  modbus_t* client = modbus_new_tcp("127.0.0.1", std::stoi(port));
  modbus_set_response_timeout(client, 5, 0);
  ASSERT_EQ(modbus_connect(client), 0) << modbus_strerror(errno);
  const std::uint16_t levels[] = {5000, 1500};  // 50 V, 1.5 A of field
  EXPECT_EQ(modbus_write_registers(client, 8, 2, levels), 2);
  EXPECT_EQ(modbus_write_register(client, 18, 1), 1);
  ASSERT_TRUE(host.reach(host.link.next_index() + 5 * 16667));  // the field's time constant is 0.8 s
  std::uint16_t read[2] = {};
  EXPECT_EQ(modbus_read_registers(client, 10, 2, read), 2);
  modbus_close(client);
  modbus_free(client);
  EXPECT_NEAR(read[1] * 0.001, 1.5, 0.1);
  EXPECT_LT(static_cast<double>(host.status.speed_rpm), idle_rpm - 10.0);
}

TEST(EmulatorProcess, InRealTimeNeverRunsAheadOfTheClockAndNeedsNoCredit) {
  Emulated emulator({"--pace", "realtime"});
  MinimalHost host(emulator.link);
  const std::int64_t began = monotonic_us();
  host.credit_end = 0;
  ASSERT_TRUE(host.connect());
  ASSERT_TRUE(host.reach(16667));
  EXPECT_GE(monotonic_us() - began, 1000000);
  EXPECT_EQ(host.link.welcome()->waits_for_credit, 0);
  EXPECT_EQ(host.link.lost_blocks(), 0);
  EXPECT_EQ(emulator.process->stop(), 0);
}

TEST(EmulatorProcess, TripsByItselfWhenItsHostFallsSilentAndTellsTheNextOne) {
  Emulated emulator({"--pace", "4"});
  {
    MinimalHost host(emulator.link, 300);
    ASSERT_TRUE(host.connect());
    ASSERT_EQ(host.result_of(host.link.upload(ramp_profile())), IMRIG_DONE);
    ASSERT_EQ(host.result_of(host.link.start(1)), IMRIG_DONE);
    MinimalHost second(emulator.link);  // hears nothing while the first one speaks
    for (int k = 0; k < 200; ++k) {
      host.turn();
      second.turn(0);
    }
    EXPECT_FALSE(second.link.up());
    EXPECT_TRUE(host.link.up());
  }
  MinimalHost host(emulator.link);
  ASSERT_TRUE(host.connect());
  ASSERT_TRUE(host.until([&] { return host.status.state == IMRIG_TRIPPED; }));
  EXPECT_EQ(host.status.trip, IMRIG_TRIP_WATCHDOG);
  EXPECT_EQ(host.result_of(host.link.clear()), IMRIG_DONE);
  ASSERT_TRUE(host.until([&] { return host.status.state == IMRIG_IDLE; }));
}

double children_cpu_s() {
  rusage usage = {};
  ::getrusage(RUSAGE_CHILDREN, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

TEST(EmulatorProcess, WithoutAHostIdlesAndEndsCleanlyOnASignal) {
  for (const char* pace : {"realtime", "max"}) {
    const double before_s = children_cpu_s();
    const Outcome outcome = run({"timeout", "--preserve-status", "-s", "INT", "3",
                                 std::string(IMRIG_BIN_DIR) + "/imrig-emulator", "--config", kPlant, "--link",
                                 "udp://127.0.0.1:0", "--modbus", "tcp://127.0.0.1:0", "--pace", pace});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_THAT(outcome.out, testing::StartsWith("ready link=udp://127.0.0.1:"));
    EXPECT_THAT(outcome.out, HasSubstr(" modbus=tcp://127.0.0.1:"));
    EXPECT_LT(children_cpu_s() - before_s, 1.0) << pace;
  }
}

void expect_refusal(const std::vector<std::string>& arguments, const std::string& says) {
  std::vector<std::string> argv = {"imrig-emulator"};
  argv.insert(argv.end(), arguments.begin(), arguments.end());
  const Outcome outcome = run(argv, 60);
  EXPECT_EQ(outcome.exit_code, 2) << says;
  EXPECT_EQ(outcome.out, "");
  EXPECT_THAT(outcome.err, HasSubstr(says));
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
}

TEST(EmulatorProcess, RefusesBadInputInOneSentence) {
  const std::string any = "udp://127.0.0.1:0", modbus = "tcp://127.0.0.1:0";
  expect_refusal({}, "--config is missing");
  expect_refusal({"--config", "no-such-file.toml"}, "no-such-file.toml");
  expect_refusal({"--config", kPlant, "--pace", "fast"}, "wanted is realtime, max");
  expect_refusal({"--config", kPlant, "--link", "udp://127.0.0.1"}, "no port");
  expect_refusal({"--config", kPlant, "--link", "serial:///dev/no-such-line"}, "No such file");
  expect_refusal({"--config", kPlant, "--link", any, "--modbus", "tcp://nowhere"}, "no port");
  expect_refusal({"--config", kPlant, "--speed", "3"}, "--speed");
  expect_refusal({"truth"}, "--config is missing");
  Folder folder;
  std::ofstream(folder / "bad.toml") << "version = 1\nname = \"x\"\nwheels = 3\n";
  expect_refusal({"--config", folder / "bad.toml", "--link", any, "--modbus", modbus}, "bad.toml");
}

TEST(EmulatorProcess, RefusesAPortThatIsInUse) {
  Emulated emulator({});
  expect_refusal({"--config", kPlant, "--link", emulator.link, "--modbus", "tcp://127.0.0.1:0"},
                 "the port is in use");
  expect_refusal({"--config", kPlant, "--link", "udp://127.0.0.1:0", "--modbus", emulator.modbus},
                 emulator.modbus.substr(16));
}

TEST(EmulatorProcess, TellsTheTruthOfItsPlant) {
  const Outcome json = run({"imrig-emulator", "truth", "--config", kPlant, "--json"});
  ASSERT_EQ(json.exit_code, 0) << json.err;
  const auto truth = nlohmann::json::parse(json.out);
  EXPECT_NEAR(truth["parameters"]["R_s"]["value"].get<double>(), 0.39, 1e-12);
  EXPECT_NEAR(truth["parameters"]["L_m"]["value"].get<double>(), 0.068, 1e-12);
  const Outcome text = run({"imrig-emulator", "truth", "--config", kPlant});
  EXPECT_EQ(text.exit_code, 0);
  EXPECT_THAT(text.out, HasSubstr("R_s"));
}

}  // namespace
}  // namespace imrig::test
