#pragma once
// Looking at other processes through /proc.

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

namespace imrig::test {

struct ProcessState {
  char letter = 0;  // 0: no such process
  pid_t parent = 0;
};

inline ProcessState state_of(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  std::string line;
  std::getline(file, line);
  const std::size_t name_end = line.rfind(')');
  ProcessState state;
  if (name_end == std::string::npos) return state;
  std::istringstream rest(line.substr(name_end + 1));
  rest >> state.letter >> state.parent;
  return state;
}

inline bool alive(pid_t pid) {
  const char letter = state_of(pid).letter;
  return letter != 0 && letter != 'Z' && letter != 'X';
}

// Children, their children and so on; the process itself is not among them.
inline std::vector<pid_t> descendants(pid_t ancestor) {
  std::vector<pid_t> found = {ancestor};
  for (std::size_t k = 0; k < found.size(); ++k)
    for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
      const std::string name = entry.path().filename().string();
      if (name.find_first_not_of("0123456789") != std::string::npos) continue;
      if (const pid_t pid = std::stoi(name); state_of(pid).parent == found[k]) found.push_back(pid);
    }
  found.erase(found.begin());
  return found;
}

inline bool wait_until(const std::function<bool()>& what, int seconds = 60) {
  for (int k = 0; k < 100 * seconds; ++k) {
    if (what()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return what();
}

}  // namespace imrig::test
