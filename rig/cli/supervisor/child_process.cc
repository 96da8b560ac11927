#include "rig/cli/supervisor/child_process.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <thread>

#include "rig/base/clock.h"
#include "rig/base/error.h"

namespace imrig {

namespace {

constexpr auto kPoll = std::chrono::milliseconds(10);

// After fork: only calls that are safe between fork and exec.
[[noreturn]] void become(char* const* argv, int log_fd, int failed_fd, pid_t parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (::getppid() != parent) ::_exit(127);  // the parent was gone before it could be asked for
  ::setpgid(0, 0);  // Ctrl-C on the terminal goes to the parent alone, which stops us in order
  const int null = ::open("/dev/null", O_RDONLY);
  ::dup2(null, STDIN_FILENO);
  ::dup2(log_fd, STDOUT_FILENO);
  ::dup2(log_fd, STDERR_FILENO);
  sigset_t none;
  ::sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  for (const int signal : {SIGINT, SIGTERM, SIGPIPE, SIGHUP}) ::signal(signal, SIG_DFL);
  ::execv(argv[0], argv);
  const int reason = errno;
  [[maybe_unused]] const ssize_t told = ::write(failed_fd, &reason, sizeof reason);
  ::_exit(127);
}

// The reason why exec failed, 0 when it did not.
int exec_result(int fd) {
  int reason = 0;
  ssize_t got = 0;
  do got = ::read(fd, &reason, sizeof reason);
  while (got < 0 && errno == EINTR);
  return got == sizeof reason ? reason : 0;
}

}  // namespace

ChildProcess::ChildProcess(ChildSpec spec) : spec_(std::move(spec)) {
  std::vector<char*> argv;
  for (std::string& word : spec_.argv) argv.push_back(word.data());
  argv.push_back(nullptr);
  const int log = ::open(spec_.log_path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC, 0644);
  if (log < 0) throw Error(spec_.log_path, std::string("cannot be written: ") + std::strerror(errno));
  int failed[2];
  if (::pipe2(failed, O_CLOEXEC) != 0) {
    ::close(log);
    throw Error(spec_.name, std::string("cannot be started: ") + std::strerror(errno));
  }
  const pid_t parent = ::getpid();
  pid_ = ::fork();
  if (pid_ == 0) become(argv.data(), log, failed[1], parent);
  const int fork_error = errno;
  ::close(log);
  ::close(failed[1]);
  const int reason = pid_ < 0 ? fork_error : exec_result(failed[0]);
  ::close(failed[0]);
  if (reason == 0) return;
  if (pid_ > 0) ::waitpid(pid_, nullptr, 0);
  pid_ = -1;
  exit_code_ = 127;
  throw Error(spec_.argv.front(), std::string("cannot be started: ") + std::strerror(reason),
              "build it, or install it beside imrig");
}

ChildProcess::~ChildProcess() { stop(1000); }

bool ChildProcess::running() {
  if (exit_code_) return false;
  int status = 0;
  if (::waitpid(pid_, &status, WNOHANG) != pid_) return true;
  exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return false;
}

std::optional<int> ChildProcess::exit_code() const { return exit_code_; }

std::string ChildProcess::last_words() const {
  std::ifstream log(spec_.log_path);
  std::string last;
  for (std::string line; std::getline(log, line);)
    if (line.find_first_not_of(" \t\r") != std::string::npos) last = line;
  return last;
}

std::string ChildProcess::wait_ready(int timeout_ms, const std::function<bool()>& give_up) {
  const std::int64_t until_us = monotonic_us() + std::int64_t{1000} * timeout_ms;
  while (true) {
    const bool alive = running();  // asked before reading, so that what it said last is read
    std::ifstream log(spec_.log_path);
    for (std::string line; std::getline(log, line) && !log.eof();)
      if (line == "ready" || line.starts_with("ready ")) return line;
    if (!alive) {
      const std::string words = last_words();
      throw Error(words.empty() ? spec_.name + ": ended at once with code " + std::to_string(*exit_code_)
                                : words);
    }
    if (monotonic_us() > until_us)
      throw Error(spec_.name, "is not ready after " + std::to_string(timeout_ms / 1000) + " s",
                  "see " + spec_.log_path);
    if (give_up && give_up()) return "";
    std::this_thread::sleep_for(kPoll);
  }
}

bool ChildProcess::stop(int grace_ms) {
  if (pid_ <= 0 || !running()) return true;
  ::kill(pid_, SIGTERM);
  const std::int64_t until_us = monotonic_us() + std::int64_t{1000} * grace_ms;
  while (running() && monotonic_us() < until_us) std::this_thread::sleep_for(kPoll);
  if (!running()) return true;
  ::kill(pid_, SIGKILL);
  int status = 0;
  ::waitpid(pid_, &status, 0);
  exit_code_ = 128 + SIGKILL;
  return false;
}

}  // namespace imrig
