#include "rig/cli/supervisor/child_process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include "rig/base/error.h"
#include "rig/base/file.h"
#include "rig/cli/supervisor/keeper.h"
#include "tests/e2e/command.h"
#include "tests/rig/cli/supervisor/processes.h"

namespace imrig {
namespace {

using ::testing::HasSubstr;

class ChildProcessTest : public ::testing::Test {
 protected:
  ChildSpec shell(const std::string& script) {
    return {"child", {"/bin/sh", "-c", script}, folder_ / "child.log"};
  }

  template <class Call>
  std::string complaint(Call call) {
    try {
      call();
    } catch (const Error& e) {
      return e.what();
    }
    return "no complaint";
  }

  test::Folder folder_;
};

TEST_F(ChildProcessTest, SaysReadyAndStopsWhenAsked) {
  ChildProcess child(shell("echo starting; echo 'ready link=udp://x modbus=tcp://y'; exec sleep 1000"));
  EXPECT_EQ(child.wait_ready(20000), "ready link=udp://x modbus=tcp://y");
  EXPECT_TRUE(child.running());
  EXPECT_TRUE(child.stop(20000));
  EXPECT_FALSE(child.running());
  EXPECT_EQ(child.exit_code(), 128 + SIGTERM);
}

TEST_F(ChildProcessTest, ReadyMustBeAWordOnAWholeLine) {
  ChildProcess child(shell("echo already; printf ready; sleep 0.3; echo ' now'; exec sleep 1000"));
  EXPECT_EQ(child.wait_ready(20000), "ready now");
}

TEST_F(ChildProcessTest, DeathAtStartIsToldInItsOwnWords) {
  ChildProcess child(shell("echo 'child: port 7 is in use; take another' >&2; exit 2"));
  EXPECT_EQ(complaint([&] { child.wait_ready(20000); }), "child: port 7 is in use; take another");
  EXPECT_EQ(child.exit_code(), 2);
}

TEST_F(ChildProcessTest, SilentDeathIsToldWithItsCode) {
  ChildProcess child(shell("exit 3"));
  EXPECT_THAT(complaint([&] { child.wait_ready(20000); }), HasSubstr("code 3"));
}

TEST_F(ChildProcessTest, OneThatNeverGetsReadyIsNotWaitedForForever) {
  ChildProcess child(shell("exec sleep 1000"));
  EXPECT_THAT(complaint([&] { child.wait_ready(200); }), HasSubstr("not ready"));
}

TEST_F(ChildProcessTest, WaitingEndsWhenTheUserGivesUp) {
  ChildProcess child(shell("exec sleep 1000"));
  EXPECT_EQ(child.wait_ready(60000, [] { return true; }), "");
}

TEST_F(ChildProcessTest, OneThatIgnoresTermIsKilled) {
  ChildProcess child(shell("trap '' TERM; echo ready; while :; do sleep 0.05; done"));
  child.wait_ready(20000);
  EXPECT_FALSE(child.stop(200));
  EXPECT_EQ(child.exit_code(), 128 + SIGKILL);
}

TEST_F(ChildProcessTest, MissingProgramAndFolderAreTold) {
  EXPECT_THAT(complaint([&] {
                ChildProcess child({"x", {"/nonexistent/imrig-x"}, folder_ / "x.log"});
              }),
              HasSubstr("/nonexistent/imrig-x: cannot be started"));
  EXPECT_THAT(complaint([&] {
                ChildProcess child({"x", {"/bin/true"}, "/nonexistent/x.log"});
              }),
              HasSubstr("/nonexistent/x.log"));
}

TEST_F(ChildProcessTest, DestructionLeavesNoProcess) {
  pid_t pid = 0;
  {
    ChildProcess child(shell("echo ready; exec sleep 1000"));
    child.wait_ready(20000);
    pid = child.pid();
  }
  EXPECT_FALSE(test::alive(pid));
}

TEST_F(ChildProcessTest, KilledParentLeavesNoOrphanNotEvenAStubbornOne) {
  const std::string pids = folder_ / "pids";
  const pid_t parent = ::fork();
  if (parent == 0) {
    Keeper keeper;
    ChildSpec stubborn = shell("trap '' TERM; echo ready; while :; do sleep 0.05; done");
    ChildSpec polite = shell("echo ready; exec sleep 1000");
    polite.log_path = folder_ / "polite.log";
    ChildProcess a(stubborn);
    ChildProcess b(polite);
    keeper.adopt(a.pid());
    keeper.adopt(b.pid());
    a.wait_ready(20000);
    b.wait_ready(20000);
    write_text_atomically(pids, std::to_string(a.pid()) + " " + std::to_string(b.pid()));
    for (;;) ::pause();
  }
  ASSERT_TRUE(test::wait_until([&] { return ::access(pids.c_str(), F_OK) == 0; }));
  int a = 0;
  int b = 0;
  std::istringstream(read_text(pids)) >> a >> b;
  ASSERT_TRUE(test::alive(a));
  ASSERT_TRUE(test::alive(b));
  ::kill(parent, SIGKILL);
  ::waitpid(parent, nullptr, 0);
  EXPECT_TRUE(test::wait_until([&] { return !test::alive(a) && !test::alive(b); }));
}

}  // namespace
}  // namespace imrig
