#pragma once
// A child process whose first line on stdout is waited for, and that can be sent any signal.

#include <sys/types.h>

#include <string>
#include <vector>

namespace imrig {

class Process {
 public:
  // argv[0] without a slash is one of the built programs.
  explicit Process(std::vector<std::string> argv);
  ~Process();  // SIGKILL if it still runs
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  std::string first_line(int at_most_ms = 20'000);  // of stdout; empty when it ended or said nothing
  void signal(int number) const;
  int wait(int at_most_ms = 20'000);  // exit code, 128 + signal when killed, -1 when it still runs
  double cpu_s() const;               // user and system time so far
  std::string output();               // the rest of stdout, after wait()
  std::string errors();               // stderr, after wait()

 private:
  pid_t pid_ = -1;
  int exit_code_ = -1;
  int out_ = -1, err_ = -1;
};

}  // namespace imrig
