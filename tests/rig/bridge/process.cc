#include "tests/rig/bridge/process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <sstream>

#include "rig/base/clock.h"
#include "rig/base/error.h"

namespace imrig {

Process::Process(std::vector<std::string> argv) {
  if (argv[0].find('/') == std::string::npos) argv[0] = std::string(IMRIG_BIN_DIR) + "/" + argv[0];
  int out[2], err[2];
  if (::pipe2(out, O_CLOEXEC) != 0 || ::pipe2(err, O_CLOEXEC) != 0) throw Error("pipe", "failed");
  std::vector<char*> words;
  for (auto& word : argv) words.push_back(word.data());
  words.push_back(nullptr);
  pid_ = ::fork();
  if (pid_ == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    ::dup2(out[1], STDOUT_FILENO);
    ::dup2(err[1], STDERR_FILENO);
    ::execv(words[0], words.data());
    ::_exit(127);
  }
  ::close(out[1]);
  ::close(err[1]);
  out_ = out[0];
  err_ = err[0];
}

Process::~Process() {
  if (pid_ > 0) {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  ::close(out_);
  ::close(err_);
}

std::string Process::first_line(int at_most_ms) {
  std::string line;
  const std::int64_t end_us = monotonic_us() + std::int64_t{at_most_ms} * 1000;
  while (monotonic_us() < end_us) {
    pollfd item = {out_, POLLIN, 0};
    if (::poll(&item, 1, 100) <= 0) continue;
    char c = 0;
    if (::read(out_, &c, 1) != 1) return "";
    if (c == '\n') return line;
    line += c;
  }
  return "";
}

void Process::signal(int number) const { ::kill(pid_, number); }

int Process::wait(int at_most_ms) {
  const std::int64_t end_us = monotonic_us() + std::int64_t{at_most_ms} * 1000;
  int status = 0;
  if (pid_ < 0) return exit_code_;
  while (::waitpid(pid_, &status, WNOHANG) == 0) {
    if (monotonic_us() > end_us) return -1;
    ::usleep(2000);
  }
  pid_ = -1;
  return exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

double Process::cpu_s() const {
  std::ifstream file("/proc/" + std::to_string(pid_) + "/stat");
  std::string text((std::istreambuf_iterator<char>(file)), {});
  std::istringstream fields(text.substr(text.rfind(')') + 2));  // from the third field on
  std::string skip;
  for (int k = 0; k < 11; ++k) fields >> skip;
  double user = 0.0, system = 0.0;
  fields >> user >> system;
  return (user + system) / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

namespace {
std::string rest_of(int fd) {
  std::string text;
  char buffer[4096];
  for (ssize_t n = 0; (n = ::read(fd, buffer, sizeof buffer)) > 0;)
    text.append(buffer, static_cast<std::size_t>(n));
  return text;
}
}  // namespace

std::string Process::output() { return rest_of(out_); }
std::string Process::errors() { return rest_of(err_); }

}  // namespace imrig
