#include "plant/modbus_server.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <modbus/modbus.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "rig/base/error.h"
#include "rig/base/url.h"
#include "tests/e2e/command.h"
#include "tests/plant/modbus/pty_pair.h"

namespace imrig::plant {
namespace {

struct Free {
  void operator()(modbus_t* m) const {
    modbus_close(m);
    modbus_free(m);
  }
};
using Client = std::unique_ptr<modbus_t, Free>;

Client patient(modbus_t* modbus) {
  Client client(modbus);
  modbus_set_response_timeout(modbus, 20, 0);
  modbus_set_byte_timeout(modbus, 20, 0);
  if (modbus_connect(modbus) != 0) throw std::runtime_error(modbus_strerror(errno));
  return client;
}

Client tcp_client(const ModbusServer& server) {
  return patient(modbus_new_tcp("127.0.0.1", parse_url(server.bound_url()).port));
}

std::uint16_t read_one(const Client& client, int address) {
  std::uint16_t word = 0xDEAD;
  EXPECT_EQ(modbus_read_registers(client.get(), address, 1, &word), 1)
      << address << " " << modbus_strerror(errno);
  return word;
}

// 0 when the write was taken, else the exception's errno.
int write_one(const Client& client, int address, std::uint16_t word) {
  errno = 0;
  return modbus_write_register(client.get(), address, word) == 1 ? 0 : errno;
}

int raw_connection(const ModbusServer& server) {
  const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(parse_url(server.bound_url()).port));
  ::inet_pton(AF_INET, "127.0.0.1", &to.sin_addr);
  EXPECT_EQ(::connect(fd, reinterpret_cast<sockaddr*>(&to), sizeof to), 0);
  const timeval patience{20, 0};
  ::setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  return fd;
}

std::string exchange(int fd, const std::string& bytes, std::size_t expected) {
  ::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  std::string reply;
  char byte = 0;
  while (reply.size() < expected && ::recv(fd, &byte, 1, 0) == 1) reply += byte;
  return reply;
}

std::string frame(const std::string& pdu, char id = 1) {
  return std::string{0, id, 0, 0, 0, static_cast<char>(pdu.size() + 1), 1} + pdu;
}

const std::string kReadIdentity = frame(std::string("\x03\0\0\0\x01", 5));
const std::string kIdentityReply("\0\x01\0\0\0\x05\x01\x03\x02\xEA\x9E", 11);  // 60062

TEST(ModbusServer, AFreshSupplyIsOffAtZeroAndSaysWhatItIs) {
  const ModbusServer server("tcp://127.0.0.1:0");
  const Client client = tcp_client(server);
  EXPECT_EQ(read_one(client, 0), 60062);
  EXPECT_EQ(read_one(client, 3), 128);
  for (const int address : {8, 9, 10, 11, 12, 13, 15, 16, 17, 18})
    EXPECT_EQ(read_one(client, address), 0) << address;
  EXPECT_EQ(read_one(client, 82), 6200);
  EXPECT_EQ(read_one(client, 83), 6200);
  const ExcitationCommand command = server.command();
  EXPECT_FALSE(command.output_on);
  EXPECT_EQ(command.set_V, 0.0);
  EXPECT_EQ(command.ovp_V, 62.0);
  EXPECT_EQ(command.ocp_A, 6.2);
}

TEST(ModbusServer, WhatIsWrittenIsTheCommandInTheRegistersResolution) {
  const ModbusServer server("tcp://127.0.0.1:0");
  const Client client = tcp_client(server);
  const std::uint16_t set[] = {1234, 2345};
  ASSERT_EQ(modbus_write_registers(client.get(), 8, 2, set), 2);
  EXPECT_EQ(write_one(client, 18, 1), 0);
  EXPECT_EQ(write_one(client, 82, 3000), 0);
  EXPECT_EQ(write_one(client, 83, 2500), 0);
  const ExcitationCommand command = server.command();
  EXPECT_DOUBLE_EQ(command.set_V, 12.34);
  EXPECT_DOUBLE_EQ(command.set_A, 2.345);
  EXPECT_TRUE(command.output_on);
  EXPECT_DOUBLE_EQ(command.ovp_V, 30.0);
  EXPECT_DOUBLE_EQ(command.ocp_A, 2.5);
  EXPECT_EQ(read_one(client, 8), 1234);
  EXPECT_EQ(read_one(client, 9), 2345);
}

TEST(ModbusServer, MeasuredValuesAreRoundedToTheRegisters) {
  ModbusServer server("tcp://127.0.0.1:0");
  const Client client = tcp_client(server);
  server.set_readback({.V = 47.126, .A = 1.2346, .constant_current = true, .output_on = true});
  EXPECT_EQ(read_one(client, 10), 4713);
  EXPECT_EQ(read_one(client, 11), 1235);
  EXPECT_EQ(read_one(client, 13), 5818);  // 47.126 V x 1.2346 A = 58.182 W
  EXPECT_EQ(read_one(client, 17), 1);
  server.set_readback({.V = 900.0, .A = 90.0});
  EXPECT_EQ(read_one(client, 10), 65535);
  EXPECT_EQ(read_one(client, 12), 8100000 >> 16);
  EXPECT_EQ(read_one(client, 13), 8100000 & 0xFFFF);
  server.set_readback({.V = -3.0, .A = std::nan("")});
  EXPECT_EQ(read_one(client, 10), 0);
  EXPECT_EQ(read_one(client, 11), 0);
}

TEST(ModbusServer, OutOfRangeAndReadOnlyWritesGetExceptionsAndChangeNothing) {
  const ModbusServer server("tcp://127.0.0.1:0");
  const Client client = tcp_client(server);
  ASSERT_EQ(write_one(client, 8, 1000), 0);
  EXPECT_EQ(write_one(client, 8, 6001), EMBXILVAL);
  EXPECT_EQ(write_one(client, 9, 6001), EMBXILVAL);
  EXPECT_EQ(write_one(client, 18, 2), EMBXILVAL);
  EXPECT_EQ(write_one(client, 0, 60062), EMBXILADD);
  EXPECT_EQ(write_one(client, 10, 5), EMBXILADD);
  EXPECT_EQ(write_one(client, 100, 0), EMBXILADD);
  const std::uint16_t half_good[] = {2000, 7000};
  EXPECT_EQ(modbus_write_registers(client.get(), 8, 2, half_good), -1);
  EXPECT_EQ(errno, EMBXILVAL);
  const std::uint16_t into_read_only[] = {2000, 3000, 1};
  EXPECT_EQ(modbus_write_registers(client.get(), 8, 3, into_read_only), -1);
  EXPECT_EQ(errno, EMBXILADD);
  std::uint16_t words[125];
  EXPECT_EQ(modbus_read_registers(client.get(), 90, 20, words), -1);
  EXPECT_EQ(errno, EMBXILADD);
  std::uint8_t bit;
  EXPECT_EQ(modbus_read_bits(client.get(), 0, 1, &bit), -1);
  EXPECT_EQ(errno, EMBXILFUN);
  EXPECT_EQ(modbus_read_input_registers(client.get(), 0, 1, words), -1);
  EXPECT_EQ(errno, EMBXILFUN);
  EXPECT_EQ(read_one(client, 8), 1000);
  EXPECT_EQ(read_one(client, 9), 0);
}

TEST(ModbusServer, AProtectionTripSwitchesOffAndStaysUntilTheOutputIsSwitchedOnAgain) {
  ModbusServer server("tcp://127.0.0.1:0");
  const Client client = tcp_client(server);
  ASSERT_EQ(write_one(client, 18, 1), 0);
  server.set_readback({.V = 12, .A = 3, .output_on = false, .tripped_ocp = true});
  EXPECT_EQ(read_one(client, 16), 2);
  EXPECT_EQ(read_one(client, 18), 0);
  EXPECT_FALSE(server.command().output_on);
  // Quicker than the plant: the supply has not yet seen that the output was withdrawn.
  ASSERT_EQ(write_one(client, 18, 1), 0);
  EXPECT_EQ(read_one(client, 16), 0);
  EXPECT_FALSE(server.command().output_on);
  server.set_readback({.V = 0, .A = 0});
  EXPECT_TRUE(server.command().output_on);
  server.set_readback({.V = 62.5, .A = 0, .tripped_ovp = true});
  EXPECT_EQ(read_one(client, 16), 1);
  EXPECT_EQ(read_one(client, 18), 0);
}

TEST(ModbusServer, SeveralClientsAreServedAtOnce) {
  const ModbusServer server("tcp://127.0.0.1:0");
  std::vector<Client> clients;
  for (int k = 0; k < 8; ++k) clients.push_back(tcp_client(server));
  for (int round = 0; round < 20; ++round) {
    for (std::size_t k = 0; k < clients.size(); ++k) {
      const auto word = static_cast<std::uint16_t>(100 * round + static_cast<int>(k));
      EXPECT_EQ(write_one(clients[k], 8, word), 0);
      EXPECT_EQ(read_one(clients[(k + 3) % clients.size()], 8), word);
    }
  }
}

TEST(ModbusServer, HalfFramesSilenceAndBrokenConnectionsHoldNobodyUp) {
  const ModbusServer server("tcp://127.0.0.1:0");
  const int silent = raw_connection(server);
  const int half = raw_connection(server);
  ::send(half, kReadIdentity.data(), 9, MSG_NOSIGNAL);
  const int reset = raw_connection(server);
  const linger at_once{1, 0};
  ::setsockopt(reset, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
  ::send(reset, kReadIdentity.data(), kReadIdentity.size(), MSG_NOSIGNAL);
  ::close(reset);
  const Client client = tcp_client(server);
  EXPECT_EQ(read_one(client, 0), 60062);
  // The rest of the half frame comes late, byte by byte, and is answered.
  for (std::size_t k = 9; k + 1 < kReadIdentity.size(); ++k) ::send(half, &kReadIdentity[k], 1, MSG_NOSIGNAL);
  EXPECT_EQ(exchange(half, kReadIdentity.substr(kReadIdentity.size() - 1), 11), kIdentityReply);
  // Two requests in one segment.
  EXPECT_EQ(exchange(half, kReadIdentity + kReadIdentity, 22), kIdentityReply + kIdentityReply);
  ::close(silent);
  ::close(half);
}

TEST(ModbusServer, AConnectionThatBreaksTheFramingIsClosedAndTheOthersLive) {
  const ModbusServer server("tcp://127.0.0.1:0");
  const Client client = tcp_client(server);
  for (const std::string& bytes :
       {std::string("GET / HTTP/1.1\r\n\r\n"), std::string(3000, '\xFF'),
        std::string("\0\1\0\0\xFF\xFF\1\3", 8), std::string("\0\1\0\0\0\1\1\3\0", 9),
        std::string("\0\1\0\0\0\0\1\3\0", 9)}) {
    const int fd = raw_connection(server);
    EXPECT_EQ(exchange(fd, bytes, 1), "");
    ::close(fd);
    EXPECT_EQ(read_one(client, 0), 60062);
  }
}

TEST(ModbusServer, WellFramedNonsenseGetsAnException) {
  const ModbusServer server("tcp://127.0.0.1:0");
  const int fd = raw_connection(server);
  const auto exception = [&](const std::string& pdu) { return exchange(fd, frame(pdu), 9).substr(7); };
  EXPECT_EQ(exception(std::string("\x03\0\0\0\0", 5)), "\x83\x03");              // no registers
  EXPECT_EQ(exception(std::string("\x03\0\0\0\x7E", 5)), "\x83\x03");            // 126 registers
  EXPECT_EQ(exception(std::string("\x03\0\0", 3)), "\x83\x03");                  // cut short
  EXPECT_EQ(exception(std::string("\x10\0\x08\0\x02\x04\0\1", 8)), "\x90\x03");  // fewer bytes than told
  EXPECT_EQ(exception(std::string("\x10\0\x08\0\x7B\xF6", 6)), "\x90\x03");      // no data at all
  EXPECT_EQ(exception(std::string("\x10\0\x08\0\x02\x02\0\1", 8)), "\x90\x03");  // count and bytes differ
  EXPECT_EQ(exception(std::string("\x17\0\0\0\1\0\0\0\1\2\0\0", 12)), "\x97\x01");
  EXPECT_EQ(exception(std::string("\x63", 1)), "\xE3\x01");
  EXPECT_EQ(exchange(fd, kReadIdentity, 11), kIdentityReply);
  ::close(fd);
}

TEST(ModbusServer, ManyHalfOpenConnectionsDoNotKeepAClientOut) {
  const ModbusServer server("tcp://127.0.0.1:0");
  std::vector<int> dead;
  for (int k = 0; k < 60; ++k) dead.push_back(raw_connection(server));
  const Client client = tcp_client(server);
  EXPECT_EQ(read_one(client, 0), 60062);
  for (const int fd : dead) ::close(fd);
}

TEST(ModbusServer, APortInUseAndABadAddressAreOneSentence) {
  const ModbusServer server("tcp://127.0.0.1:0");
  try {
    const ModbusServer second(server.bound_url());
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("in use"), std::string::npos) << e.what();
  }
  for (const char* url :
       {"tcp://nowhere.invalid:0", "tcp://127.0.0.1", "udp://127.0.0.1:0", "rtu://host:1",
        "rtu:///dev/no_such_device?baud=9600", "rtu:///dev/null?speed=1", "tcp:///dev/null", ""}) {
    EXPECT_THROW(ModbusServer{url}, Error) << url;
  }
}

TEST(ModbusServer, TheSerialLineSpeaksRtu) {
  test::PtyPair line;
  ModbusServer server("rtu://" + line.a() + "?baud=115200&unit=7");
  modbus_t* modbus = modbus_new_rtu(line.b().c_str(), 115200, 'N', 8, 1);
  modbus_set_slave(modbus, 7);
  const Client client = patient(modbus);
  EXPECT_EQ(read_one(client, 0), 60062);
  EXPECT_EQ(write_one(client, 8, 4321), 0);
  EXPECT_DOUBLE_EQ(server.command().set_V, 43.21);
  EXPECT_EQ(write_one(client, 8, 6001), EMBXILVAL);
  const std::uint16_t set[] = {100, 200};
  EXPECT_EQ(modbus_write_registers(client.get(), 8, 2, set), 2);
  EXPECT_DOUBLE_EQ(server.command().set_A, 0.2);
  // Another unit's request is none of ours.
  modbus_set_slave(modbus, 8);
  modbus_set_response_timeout(modbus, 0, 300000);
  std::uint16_t word;
  EXPECT_EQ(modbus_read_registers(modbus, 0, 1, &word), -1);
  EXPECT_EQ(errno, ETIMEDOUT);
}

TEST(ModbusServer, NoiseOnTheSerialLineIsSurvived) {
  test::PtyPair line;
  const ModbusServer server("rtu://" + line.a());
  const Client client = patient(modbus_new_rtu(line.b().c_str(), 115200, 'N', 8, 1));
  modbus_set_slave(client.get(), 1);
  ASSERT_EQ(read_one(client, 0), 60062);
  for (const std::string& noise :
       {std::string(300, '\x55'), std::string("\x01\x03\0\0\0\x01\xFF\xFF", 8), std::string("\x01\x10", 2)}) {
    const int fd = ::open(line.b().c_str(), O_WRONLY | O_NOCTTY);
    ASSERT_EQ(::write(fd, noise.data(), noise.size()), static_cast<ssize_t>(noise.size()));
    ::close(fd);
    ::usleep(300000);  // the silence that ends a frame
    modbus_flush(client.get());
    EXPECT_EQ(read_one(client, 0), 60062);
  }
}

TEST(ModbusServer, MbpollReadsAndWrites) {
  ModbusServer server("tcp://127.0.0.1:0");
  server.set_readback({.V = 47.13, .A = 1.235});
  const std::string port = std::to_string(parse_url(server.bound_url()).port);
  const auto mbpoll = [&](std::vector<std::string> rest) {
    std::vector<std::string> all = {"mbpoll", "-m", "tcp", "-p", port, "-0", "-1", "-q", "-t", "4"};
    all.insert(all.end(), rest.begin(), rest.end());
    return test::run(all, 60);
  };
  const test::Outcome written = mbpoll({"-r", "8", "127.0.0.1", "1234", "2345"});
  ASSERT_EQ(written.exit_code, 0) << "needs Debian's mbpoll: " << written.err;
  EXPECT_DOUBLE_EQ(server.command().set_V, 12.34);
  EXPECT_DOUBLE_EQ(server.command().set_A, 2.345);
  const test::Outcome read = mbpoll({"-r", "8", "-c", "4", "127.0.0.1"});
  ASSERT_EQ(read.exit_code, 0) << read.err;
  for (const char* value : {"1234", "2345", "4713", "1235"}) {
    EXPECT_NE(read.out.find(value), std::string::npos) << value << " in " << read.out;
  }
  const test::Outcome refused = mbpoll({"-r", "8", "127.0.0.1", "6001"});
  EXPECT_NE((refused.out + refused.err).find("Illegal data value"), std::string::npos)
      << refused.out << refused.err;
}

TEST(ModbusServer, PymodbusReadsAndWritesOverTcpAndTheSerialLine) {
  ModbusServer tcp("tcp://127.0.0.1:0");
  test::PtyPair line;
  ModbusServer rtu("rtu://" + line.a());
  for (ModbusServer* server : {&tcp, &rtu}) server->set_readback({.V = 47.13, .A = 1.235});
  const std::string script = test::source("tests/plant/modbus/pymodbus_client.py");
  const std::string port = std::to_string(parse_url(tcp.bound_url()).port);
  const test::Outcome over_tcp = test::run({"/usr/bin/python3", script, "tcp", port}, 60);
  EXPECT_EQ(over_tcp.exit_code, 0) << "needs Debian's python3-pymodbus: " << over_tcp.err;
  EXPECT_EQ(over_tcp.out, "60062 [4713, 1235] [1500, 750] 3 2\n");
  const test::Outcome over_rtu = test::run({"/usr/bin/python3", script, "rtu", line.b()}, 60);
  EXPECT_EQ(over_rtu.exit_code, 0) << "needs Debian's python3-pymodbus and python3-serial: " << over_rtu.err;
  EXPECT_EQ(over_rtu.out, over_tcp.out);
  for (ModbusServer* server : {&tcp, &rtu}) {
    EXPECT_DOUBLE_EQ(server->command().set_V, 15.0);
    EXPECT_DOUBLE_EQ(server->command().set_A, 0.75);
  }
}

}  // namespace
}  // namespace imrig::plant
