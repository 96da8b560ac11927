#include "rig/cli/supervisor/keeper.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <initializer_list>
#include <string>

#include "rig/base/error.h"

namespace imrig {

namespace {

constexpr int kMostChildren = 16;
constexpr int kGrace_ms = 5000;

int open_process(pid_t pid) { return static_cast<int>(::syscall(SYS_pidfd_open, pid, 0)); }
void send_signal(int process, int signal) { ::syscall(SYS_pidfd_send_signal, process, signal, nullptr, 0); }
// A pidfd is readable once its process has ended.
bool ended(int process, int wait_ms) {
  pollfd p = {process, POLLIN, 0};
  return ::poll(&p, 1, wait_ms) == 1;
}

[[noreturn]] void keep(int fd) {
  ::setsid();
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) ::signal(signal, SIG_IGN);
  for (int other = 0; other < 1024; ++other)
    if (other != fd) ::close(other);  // holds nobody's terminal, log or socket open
  std::array<int, kMostChildren> children;
  int count = 0;
  pid_t child = 0;
  while (true) {
    const ssize_t got = ::read(fd, &child, sizeof child);
    if (got < 0 && errno == EINTR) continue;
    if (got != sizeof child) break;
    if (const int process = count < kMostChildren ? open_process(child) : -1; process >= 0)
      children[static_cast<std::size_t>(count++)] = process;
  }
  for (int k = count; k-- > 0;) send_signal(children[static_cast<std::size_t>(k)], SIGTERM);
  int left_ms = kGrace_ms;
  for (int k = count; k-- > 0;)
    while (!ended(children[static_cast<std::size_t>(k)], 0) && left_ms > 0)
      left_ms -= ended(children[static_cast<std::size_t>(k)], 20) ? 0 : 20;
  for (int k = count; k-- > 0;) send_signal(children[static_cast<std::size_t>(k)], SIGKILL);
  ::_exit(0);
}

}  // namespace

Keeper::Keeper() {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0)
    throw Error("supervisor", std::string("no pipe: ") + std::strerror(errno));
  pid_ = ::fork();
  if (pid_ == 0) {
    ::close(ends[1]);
    keep(ends[0]);
  }
  ::close(ends[0]);
  fd_ = ends[1];
  if (pid_ < 0) {
    ::close(fd_);
    throw Error("supervisor", std::string("cannot fork: ") + std::strerror(errno));
  }
}

Keeper::~Keeper() {
  ::close(fd_);
  ::waitpid(pid_, nullptr, 0);
}

void Keeper::adopt(pid_t child) {
  ssize_t wrote = 0;
  do wrote = ::write(fd_, &child, sizeof child);
  while (wrote < 0 && errno == EINTR);
}

}  // namespace imrig
