#include "tests/e2e/command.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <thread>

#include "tests/support/free_port.h"

namespace imrig::test {

namespace {

int spawn(const std::vector<std::string>& argv, int out, int err) {
  std::vector<std::string> words = argv;
  words[0] = program(words[0]);
  std::vector<char*> pointers;
  for (auto& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  const int pid = ::fork();
  if (pid == 0) {
    const int null = ::open("/dev/null", O_RDONLY);
    ::dup2(null, 0);
    ::dup2(out, 1);
    ::dup2(err, 2);
    ::setpgid(0, 0);
    ::execvp(pointers[0], pointers.data());
    ::_exit(127);
  }
  if (pid < 0) throw std::runtime_error("fork failed");
  return pid;
}

int code_of(int status) { return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status); }

}  // namespace

std::string program(const std::string& name) {
  if (name.find('/') != std::string::npos) return name;
  const std::string built = std::string(IMRIG_BIN_DIR) + "/" + name;
  return std::filesystem::exists(built) ? built : name;
}

Outcome run(const std::vector<std::string>& argv, int timeout_s) {
  int out[2];
  int err[2];
  if (::pipe2(out, O_CLOEXEC) != 0 || ::pipe2(err, O_CLOEXEC) != 0) throw std::runtime_error("pipe failed");
  const int pid = spawn(argv, out[1], err[1]);
  ::close(out[1]);
  ::close(err[1]);
  Outcome outcome;
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(timeout_s);
  pollfd files[2] = {{out[0], POLLIN, 0}, {err[0], POLLIN, 0}};
  std::string* texts[2] = {&outcome.out, &outcome.err};
  while (files[0].fd >= 0 || files[1].fd >= 0) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
    if (left.count() <= 0) {
      ::kill(-pid, SIGKILL);
      outcome.err += "[ended after " + std::to_string(timeout_s) + " s]";
      break;
    }
    ::poll(files, 2, static_cast<int>(std::min<long long>(left.count(), 1000)));
    for (int k = 0; k < 2; ++k) {
      if (files[k].fd < 0 || files[k].revents == 0) continue;
      char chunk[65536];
      const ssize_t got = ::read(files[k].fd, chunk, sizeof chunk);
      if (got > 0) {
        texts[k]->append(chunk, static_cast<std::size_t>(got));
      } else {
        files[k].fd = -1;
      }
    }
  }
  ::close(out[0]);
  ::close(err[0]);
  int status = 0;
  ::waitpid(pid, &status, 0);
  outcome.exit_code = code_of(status);
  return outcome;
}

Background::Background(const std::vector<std::string>& argv, const std::string& output_file) {
  const int out = ::open(output_file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  pid_ = spawn(argv, out, out);
  ::close(out);
}

bool Background::running() const {
  siginfo_t info = {};
  return pid_ > 0 && ::waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid == 0;
}

int Background::stop() {
  if (pid_ <= 0) return -1;
  ::kill(pid_, SIGTERM);
  for (int k = 0; k < 100 && running(); ++k) std::this_thread::sleep_for(std::chrono::milliseconds(100));
  if (running()) ::kill(-pid_, SIGKILL);
  int status = 0;
  ::waitpid(pid_, &status, 0);
  pid_ = -1;
  return code_of(status);
}

Background::~Background() { stop(); }

Folder::Folder() {
  std::string name = (std::filesystem::temp_directory_path() / "imrig_e2e_XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("mkdtemp failed");
  path_ = name;
}

Folder::~Folder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

std::vector<std::string> Folder::names() const {
  std::vector<std::string> all;
  for (const auto& entry : std::filesystem::directory_iterator(path_)) all.push_back(entry.path().filename().string());
  std::sort(all.begin(), all.end());
  return all;
}

int free_udp_port() { return free_port(SOCK_DGRAM); }
int free_tcp_port() { return free_port(SOCK_STREAM); }
std::string source(const std::string& relative) { return std::string(IMRIG_SOURCE_DIR) + "/" + relative; }

}  // namespace imrig::test
