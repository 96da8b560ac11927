#pragma once
// Runs a real command line and keeps what it said.

#include <string>
#include <vector>

namespace imrig::test {

struct Outcome {
  int exit_code = -1;  // 128 + signal when killed
  std::string out;
  std::string err;
};

// A name without a slash becomes the path of the program built here, where there is one.
std::string program(const std::string& name);

// argv[0] as program() has it, then from PATH. Ends the command after timeout_s.
Outcome run(const std::vector<std::string>& argv, int timeout_s = 300);

// A background process that is stopped (SIGTERM, then SIGKILL) when this goes out of scope.
class Background {
 public:
  explicit Background(const std::vector<std::string>& argv, const std::string& output_file = "/dev/null");
  ~Background();
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;
  int stop();  // exit code
  bool running() const;
  int pid() const { return pid_; }

 private:
  int pid_ = -1;
};

// A fresh folder under the system's temporary folder, removed with the object.
class Folder {
 public:
  Folder();
  ~Folder();
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::string operator/(const std::string& name) const { return path_ + "/" + name; }
  const std::string& path() const { return path_; }
  std::vector<std::string> names() const;

 private:
  std::string path_;
};

int free_udp_port();
int free_tcp_port();
std::string source(const std::string& relative);  // absolute path of a file of the repository

}  // namespace imrig::test
