#include "rig/dyno/modbus_client.h"

#include <gtest/gtest.h>

#include <bit>
#include <chrono>
#include <functional>
#include <memory>
#include <thread>

#include "plant/modbus_server.h"
#include "rig/base/error.h"
#include "rig/dyno/modbus_wire.h"
#include "tests/e2e/command.h"
#include "tests/plant/modbus/pty_pair.h"
#include "tests/rig/dyno/scripted_supply.h"

namespace imrig {
namespace {

using plant::ModbusServer;
using test::ScriptedSupply;

constexpr SupplyOrder kOn{12.34, 2.345, true, 1};
constexpr SupplyOrder kOff{0.0, 0.0, false, 2};

bool wait_until(const std::function<bool()>& condition, int timeout_s = 60) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(timeout_s);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

void pause_ms(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

bool up(const ModbusClient& client) { return client.report().link == SupplyLink::kUp; }
bool done(const ModbusClient& client, std::int64_t number) {
  const SupplyReport r = client.report();
  return r.link == SupplyLink::kUp && r.order_number == number && r.as_written;
}

RegisterMap riden() { return load_register_map("riden_rd6006"); }

using Registers = std::vector<std::pair<int, std::uint16_t>>;

std::unique_ptr<ScriptedSupply> scripted_riden(int port, Registers registers = {}) {
  registers.insert(registers.begin(), {0, 60062});
  return std::make_unique<ScriptedSupply>(port, registers);
}

TEST(ModbusClient, TheSupplyTakesTheOrderAndIsReadBack) {
  ModbusServer server("tcp://127.0.0.1:0");
  ModbusClient client({server.bound_url()}, riden());
  ASSERT_TRUE(wait_until([&] { return up(client); }));
  client.order(kOn);
  ASSERT_TRUE(wait_until([&] { return done(client, 1); }));
  EXPECT_DOUBLE_EQ(server.command().set_V, 12.34);
  EXPECT_DOUBLE_EQ(server.command().set_A, 2.345);
  EXPECT_TRUE(server.command().output_on);
  server.set_readback({.V = 12.31, .A = 0.617, .constant_current = true, .output_on = true});
  ASSERT_TRUE(wait_until([&] { return client.report().out_V > 0.0; }));
  const SupplyReport report = client.report();
  EXPECT_DOUBLE_EQ(report.out_V, 12.31);
  EXPECT_DOUBLE_EQ(report.out_A, 0.617);
  EXPECT_TRUE(report.constant_current);
  EXPECT_TRUE(report.output_on);
  EXPECT_DOUBLE_EQ(report.held_V, 12.34);
  EXPECT_EQ(report.read_errors, 0);
  client.order(kOff);
  ASSERT_TRUE(wait_until([&] { return done(client, 2); }));
  EXPECT_FALSE(server.command().output_on);
  EXPECT_EQ(server.command().set_V, 0.0);
}

TEST(ModbusClient, ASupplyFoundOnIsSwitchedOffBeforeAnyOrder) {
  const auto supply = scripted_riden(test::free_tcp_port(), {{8, 3000}, {9, 1000}, {18, 1}});
  const ModbusClient client({supply->url()}, riden());
  ASSERT_TRUE(wait_until([&] { return done(client, 0); }));
  EXPECT_EQ(supply->peek(18), 0);
  EXPECT_EQ(supply->peek(8), 0);
  EXPECT_EQ(supply->writes(),
            (std::vector<int>{18, 8}));  // output first, then both set-points in one request
}

TEST(ModbusClient, WritesOnChangeOnly) {
  const auto supply = scripted_riden(test::free_tcp_port());
  ModbusClient client({supply->url(), 5000, 1}, riden());
  client.order(kOn);
  ASSERT_TRUE(wait_until([&] { return done(client, 1); }));
  EXPECT_EQ(supply->writes(), (std::vector<int>{8, 18}));  // set-points first, then the output
  const int before = supply->requests;
  ASSERT_TRUE(wait_until([&] { return supply->requests > before + 100; }));
  client.order({12.3401, 2.345, true, 2});  // less than the register resolves
  ASSERT_TRUE(wait_until([&] { return done(client, 2); }));
  EXPECT_EQ(supply->writes().size(), 2u);
  client.order({12.34, 2.0, true, 3});
  ASSERT_TRUE(wait_until([&] { return done(client, 3); }));
  EXPECT_EQ(supply->writes(), (std::vector<int>{8, 18, 9}));
}

TEST(ModbusClient, AServerThatIsNotThereIsAStateAndIsFoundWhenItComes) {
  const int port = test::free_tcp_port();
  ModbusClient client({"tcp://127.0.0.1:" + std::to_string(port)}, riden());
  ASSERT_TRUE(wait_until([&] { return client.report().read_errors >= 2; }));
  EXPECT_EQ(client.report().link, SupplyLink::kAbsent);
  EXPECT_FALSE(client.trouble().empty());
  const auto supply = scripted_riden(port);
  ASSERT_TRUE(wait_until([&] { return up(client); }));
  EXPECT_EQ(client.report().reconnects, 0);
  EXPECT_TRUE(client.trouble().empty());
}

TEST(ModbusClient, AServerThatIsKilledAndComesBackIsFoundAgainButNotSilentlySwitchedOn) {
  auto server = std::make_unique<ModbusServer>("tcp://127.0.0.1:0");
  const std::string url = server->bound_url();
  ModbusClient client({url}, riden());
  client.order(kOn);
  ASSERT_TRUE(wait_until([&] { return done(client, 1); }));
  server.reset();
  ASSERT_TRUE(wait_until([&] { return client.report().link == SupplyLink::kSilent; }));
  server = std::make_unique<ModbusServer>(url);  // a supply that has lost its set-points
  ASSERT_TRUE(wait_until([&] { return up(client) && client.report().mismatch; }));
  EXPECT_GE(client.report().reconnects, 1);
  EXPECT_FALSE(client.report().as_written);
  pause_ms(1500);  // longer than the time after which set-points are written anew
  EXPECT_FALSE(server->command().output_on);
  client.order(kOff);
  ASSERT_TRUE(wait_until([&] { return done(client, 2); }));
  client.order({5.0, 1.0, true, 3});
  ASSERT_TRUE(wait_until([&] { return done(client, 3); }));
  EXPECT_TRUE(server->command().output_on);
}

TEST(ModbusClient, AConnectionThatIsCutForAMomentGoesOnWhereItWas) {
  const int port = test::free_tcp_port();
  auto supply = scripted_riden(port);
  ModbusClient client({supply->url()}, riden());
  client.order(kOn);
  ASSERT_TRUE(wait_until([&] { return done(client, 1); }));
  supply.reset();
  supply = scripted_riden(port, {{8, 1234}, {9, 2345}, {18, 1}});
  ASSERT_TRUE(wait_until([&] { return client.report().reconnects >= 1 && done(client, 1); }));
  EXPECT_FALSE(client.report().mismatch);
  EXPECT_TRUE(supply->writes().empty());
}

TEST(ModbusClient, AReplyThatComesLateDoesNotPutLaterRepliesOutOfStep) {
  const auto supply = scripted_riden(test::free_tcp_port());
  supply->poke(10, 1111);
  supply->poke(11, 2222);
  ModbusClient client({supply->url(), 300, 5}, riden());
  client.order(kOn);
  ASSERT_TRUE(wait_until([&] { return done(client, 1); }));
  for (int round = 0; round < 3; ++round) {
    const std::int64_t errors = client.report().read_errors;
    supply->delay_next_ms = 700;
    ASSERT_TRUE(wait_until([&] { return client.report().read_errors > errors; }));
    ASSERT_TRUE(wait_until([&] { return done(client, 1); }));
    const int requests = supply->requests;
    while (supply->requests < requests + 60) {
      const SupplyReport report = client.report();
      ASSERT_DOUBLE_EQ(report.held_V, 12.34);
      ASSERT_DOUBLE_EQ(report.held_A, 2.345);
      ASSERT_DOUBLE_EQ(report.out_V, 11.11);
      ASSERT_DOUBLE_EQ(report.out_A, 2.222);
      ASSERT_EQ(report.protection, 0);
      pause_ms(2);
    }
  }
  EXPECT_EQ(supply->writes(), (std::vector<int>{8, 18}));
}

TEST(ModbusClient, AnotherDeviceAtTheAddressIsRefusedAndNeverWrittenTo) {
  const auto supply = scripted_riden(test::free_tcp_port(), {{0, 1234}});
  ModbusClient client({supply->url()}, riden());
  client.order(kOn);
  ASSERT_TRUE(wait_until([&] { return supply->connections >= 2 && client.report().wrong_device; }));
  EXPECT_NE(client.report().link, SupplyLink::kUp);
  EXPECT_NE(client.trouble().find("1234"), std::string::npos) << client.trouble();
  EXPECT_TRUE(supply->writes().empty());
  supply->poke(0, 60062);
  ASSERT_TRUE(wait_until([&] { return done(client, 1); }));
  EXPECT_FALSE(client.report().wrong_device);
}

TEST(ModbusClient, AnotherDeviceAfterAReconnectIsRefused) {
  const int port = test::free_tcp_port();
  auto supply = scripted_riden(port);
  ModbusClient client({supply->url()}, riden());
  client.order(kOn);
  ASSERT_TRUE(wait_until([&] { return done(client, 1); }));
  supply.reset();
  supply = scripted_riden(port, {{0, 999}});
  ASSERT_TRUE(wait_until([&] { return client.report().wrong_device; }));
  EXPECT_EQ(client.report().link, SupplyLink::kSilent);
  EXPECT_TRUE(supply->writes().empty());
}

TEST(ModbusClient, RegistersThatDoNotKeepWhatIsWrittenAreAMismatch) {
  const auto supply = scripted_riden(test::free_tcp_port());
  ModbusClient client({supply->url()}, riden());
  ASSERT_TRUE(wait_until([&] { return up(client); }));
  supply->deaf_to_writes = true;
  client.order(kOn);
  ASSERT_TRUE(wait_until([&] { return client.report().mismatch; }));
  EXPECT_FALSE(client.report().as_written);
}

TEST(ModbusClient, ARefusedWriteIsAMismatchAndTheLineStaysUp) {
  const auto supply = scripted_riden(test::free_tcp_port());
  supply->refuse_write = 8;
  ModbusClient client({supply->url()}, riden());
  ASSERT_TRUE(wait_until([&] { return up(client); }));
  client.order(kOn);
  ASSERT_TRUE(wait_until([&] { return client.report().mismatch; }));
  EXPECT_TRUE(up(client));
  EXPECT_EQ(client.report().reconnects, 0);
}

TEST(ModbusClient, ASetPointChangedAtTheFrontPanelIsAMismatchAndIsPutRight) {
  const auto supply = scripted_riden(test::free_tcp_port());
  ModbusClient client({supply->url()}, riden());
  client.order(kOn);
  ASSERT_TRUE(wait_until([&] { return done(client, 1); }));
  supply->poke(8, 5000);
  ASSERT_TRUE(wait_until([&] { return client.report().mismatch; }));
  ASSERT_TRUE(wait_until([&] { return supply->peek(8) == 1234; }));
  ASSERT_TRUE(wait_until([&] { return done(client, 1); }));
}

TEST(ModbusClient, AnOutputSwitchedOnAtTheFrontPanelWhileItIsToBeOffIsSwitchedOff) {
  const auto supply = scripted_riden(test::free_tcp_port());
  const ModbusClient client({supply->url()}, riden());
  ASSERT_TRUE(wait_until([&] { return done(client, 0); }));
  supply->poke(18, 1);
  ASSERT_TRUE(wait_until([&] { return supply->peek(18) == 0; }));
}

TEST(ModbusClient, AProtectionTripIsReportedAndNotSwitchedOnAgain) {
  ModbusServer server("tcp://127.0.0.1:0");
  ModbusClient client({server.bound_url()}, riden());
  client.order(kOn);
  ASSERT_TRUE(wait_until([&] { return done(client, 1); }));
  server.set_readback({.tripped_ocp = true});
  ASSERT_TRUE(wait_until([&] { return client.report().protection == 2; }));
  pause_ms(1500);
  EXPECT_FALSE(client.report().output_on);
  EXPECT_EQ(client.report().protection, 2);
}

TEST(ModbusClient, TheSuppliesOwnWatchdogIsArmedOnEveryConnect) {
  const int port = test::free_tcp_port();
  std::unique_ptr<ModbusClient> client;
  for (int round = 0; round < 2; ++round) {
    ScriptedSupply supply(port, {});
    if (round == 0) {
      client =
          std::make_unique<ModbusClient>(ModbusClientConfig{supply.url()}, load_register_map("tdk_genesys"));
    }
    ASSERT_TRUE(wait_until([&] { return supply.peek(1021) == 1 && up(*client); }));
    EXPECT_EQ(supply.peek(1022), 2);
  }
}

TEST(ModbusClient, FloatSetPointsAreWrittenWholeInTheMapsWordOrder) {
  const ScriptedSupply supply(test::free_tcp_port(), {{200, 0x1C00}, {201, 0x47BB}});
  const RegisterMap map = parse_register_map(R"(
version = 1
name = "floats"
[registers.set_V]
address = 100
kind = "f32"
word_order = "CDAB"
unit = "V"
[registers.out_V]
address = 200
kind = "f32"
word_order = "CDAB"
unit = "V"
[registers.output]
address = 300
)",
                                             "test");
  ModbusClient client({supply.url()}, map);
  client.order({1.234, 0.0, true, 1});
  ASSERT_TRUE(wait_until([&] { return done(client, 1); }));
  EXPECT_EQ(supply.peek(100), 0xF3B6);
  EXPECT_EQ(supply.peek(101), 0x3F9D);
  EXPECT_DOUBLE_EQ(client.report().out_V, 95800.0);
  EXPECT_EQ(supply.writes(), (std::vector<int>{100, 300}));
}

TEST(ModbusClient, AHungServerDelaysNobodyWhoAsksForTheReport) {
  const auto supply = scripted_riden(test::free_tcp_port());
  ModbusClient client({supply->url(), 2000, 20}, riden());
  ASSERT_TRUE(wait_until([&] { return up(client); }));
  supply->hung = true;
  pause_ms(200);  // the thread now waits for a reply
  const auto begin = std::chrono::steady_clock::now();
  for (int k = 0; k < 1000; ++k) {
    client.report();
    client.order(kOn);
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(1000));
  ASSERT_TRUE(wait_until([&] { return client.report().link == SupplyLink::kSilent; }));
}

TEST(ModbusClient, TheSerialLineWorksTheSameAndSurvivesACut) {
  test::PtyPair line;
  ModbusServer server("rtu://" + line.a() + "?baud=115200&unit=3");
  ModbusClient client({"rtu://" + line.b() + "?baud=115200&unit=3"}, riden());
  client.order(kOn);
  ASSERT_TRUE(wait_until([&] { return done(client, 1); }));
  EXPECT_DOUBLE_EQ(server.command().set_V, 12.34);
  EXPECT_TRUE(server.command().output_on);
  line.cut = true;
  ASSERT_TRUE(wait_until([&] { return client.report().link == SupplyLink::kSilent; }));
  line.cut = false;
  ASSERT_TRUE(wait_until([&] { return done(client, 1); }));
  EXPECT_GE(client.report().reconnects, 1);
  EXPECT_FALSE(client.report().mismatch);
}

TEST(ModbusClient, AStaleReplyOnTheSerialLineIsNotTakenForAFreshOne) {
  test::PtyPair line;
  const ModbusServer server("rtu://" + line.a());
  ModbusWire wire("rtu://" + line.b(), 5000);
  ASSERT_TRUE(wire.connect());
  std::uint16_t word = 0;
  ASSERT_EQ(wire.read(0, {&word, 1}), WireResult::kDone);
  ASSERT_EQ(word, 60062);
  // A well-formed late reply to a read of one register, value 1, lies in the line before the next request.
  line.inject_to_b(std::string("\x01\x03\x02\x00\x01\x79\x84", 7));
  pause_ms(200);
  ASSERT_EQ(wire.read(0, {&word, 1}), WireResult::kDone);
  EXPECT_EQ(word, 60062);
}

TEST(ModbusClient, PymodbusServesItToo) {
  const std::string port = std::to_string(test::free_tcp_port());
  const test::Folder folder;
  const test::Background server({"/usr/bin/python3", test::source("tests/rig/dyno/pymodbus_server.py"), port},
                                folder / "out");
  ModbusClient client({"tcp://127.0.0.1:" + port, 5000, 20}, riden());
  client.order(kOn);
  ASSERT_TRUE(wait_until([&] { return done(client, 1); }))
      << "needs Debian's python3-pymodbus: " << client.trouble();
  EXPECT_DOUBLE_EQ(client.report().held_V, 12.34);
  EXPECT_DOUBLE_EQ(client.report().held_A, 2.345);
  EXPECT_DOUBLE_EQ(client.report().out_V, 47.13);
  EXPECT_TRUE(client.report().output_on);
}

TEST(ModbusClient, BadAddressesAreOneSentence) {
  for (const char* url : {"", "tcp://127.0.0.1", "tcp://127.0.0.1:0", "udp://127.0.0.1:502", "rtu://host:5",
                          "tcp:///dev/null", "rtu:///dev/no_such_device", "rtu:///dev/null?speed=9600",
                          "tcp://127.0.0.1:502?baud=9600", "tcp://127.0.0.1:502?unit=300"}) {
    EXPECT_THROW(ModbusClient({url}, riden()), Error) << url;
  }
}

}  // namespace
}  // namespace imrig
