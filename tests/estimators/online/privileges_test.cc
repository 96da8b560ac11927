// --realtime and --lock-memory: taken where the kernel allows it, told and done without where not.

#include <gtest/gtest.h>
#include <sched.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "rig/base/file.h"
#include "rig/base/rig_config.h"
#include "tests/e2e/command.h"
#include "tests/rig/bus/wire.h"

namespace imrig::test {
namespace {

constexpr int kPriority = 7;

// The estimator with both options, up on a bus of its own.
struct Privileged {
  explicit Privileged(std::vector<std::string> before = {}) {
    RigConfig config;
    config.bus = bus_config(free_udp_port());
    write_text_atomically(folder / "rig.toml", to_toml(config));
    before.insert(before.end(), {program("imrig-estimator"), "--config", folder / "rig.toml", "--realtime",
                                 std::to_string(kPriority), "--lock-memory"});
    process = std::make_unique<Background>(before, said);
    ready = wait_until([&] { return words().find("ready") != std::string::npos || !process->running(); }) && process->running();
  }
  std::string words() const { return read_text(said); }

  Folder folder;
  std::string said = folder / "said";
  std::unique_ptr<Background> process;
  bool ready = false;
};

// kB, of "VmLck:" in /proc/PID/status.
long locked_kB(int pid) {
  std::ifstream status("/proc/" + std::to_string(pid) + "/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmLck:")) return std::stol(line.substr(6));
  return -1;
}

TEST(Privileges, EveryThreadRunsAtTheAskedPriorityWithItsMemoryLocked) {
  Privileged estimator;
  ASSERT_TRUE(estimator.ready) << estimator.words();
  if (estimator.words().find("no real-time priority") != std::string::npos ||
      estimator.words().find("no locked memory") != std::string::npos)
    GTEST_SKIP() << "this kernel does not allow it: " << estimator.words();
  const int pid = estimator.process->pid();
  int threads = 0;
  for (const auto& task : std::filesystem::directory_iterator("/proc/" + std::to_string(pid) + "/task")) {
    const int id = std::stoi(task.path().filename());
    sched_param param = {};
    ASSERT_EQ(::sched_getparam(id, &param), 0);
    EXPECT_EQ(::sched_getscheduler(id) & ~SCHED_RESET_ON_FORK, SCHED_FIFO);
    EXPECT_EQ(param.sched_priority, kPriority);
    ++threads;
  }
  EXPECT_GE(threads, 2) << "the bus has a thread of its own";
  EXPECT_GT(locked_kB(pid), 1000);
  EXPECT_EQ(estimator.process->stop(), 0);
}

TEST(Privileges, WhereTheyAreRefusedItSaysSoOnceAndRunsAllTheSame) {
  std::vector<std::string> without = {"prlimit", "--memlock=0", "--rtprio=0"};
  if (::geteuid() == 0) without.insert(without.end(), {"setpriv", "--bounding-set", "-sys_nice,-ipc_lock"});
  if (run({"prlimit", "--version"}).exit_code != 0 || run({"setpriv", "--version"}).exit_code != 0)
    GTEST_SKIP() << "no prlimit or no setpriv to take the rights away with";
  Privileged estimator(without);
  ASSERT_TRUE(estimator.ready) << estimator.words();
  const std::string words = estimator.words();
  for (const char* sentence : {"imrig-estimator: no locked memory: ", "imrig-estimator: no real-time priority: "}) {
    const std::size_t at = words.find(sentence);
    EXPECT_NE(at, std::string::npos) << words;
    EXPECT_EQ(words.find(sentence, at + 1), std::string::npos) << "told once";
  }
  EXPECT_EQ(locked_kB(estimator.process->pid()), 0);
  EXPECT_EQ(estimator.process->stop(), 0);
}

}  // namespace
}  // namespace imrig::test
