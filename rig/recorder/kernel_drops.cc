#include "rig/recorder/kernel_drops.h"

#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>

namespace imrig {

namespace {

// Inodes of this process's sockets: /proc/self/fd/N -> "socket:[INODE]".
std::set<std::string> own_sockets() {
  constexpr char kBegin[] = "socket:[";
  std::set<std::string> inodes;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd", error)) {
    const std::string target = std::filesystem::read_symlink(entry.path(), error).string();
    if (!error && target.starts_with(kBegin))
      inodes.insert(target.substr(sizeof kBegin - 1, target.size() - sizeof kBegin));
  }
  return inodes;
}

}  // namespace

std::int64_t kernel_drops() {
  const auto own = own_sockets();
  std::ifstream table("/proc/net/udp");
  std::string line;
  std::getline(table, line);  // heading
  std::int64_t drops = 0;
  while (std::getline(table, line)) {
    // sl local rem st queues timer retransmits uid timeout INODE ref pointer DROPS
    std::istringstream words(line);
    std::string word;
    std::string inode;
    for (int k = 0; k < 10 && words >> word; ++k) inode = word;
    std::int64_t dropped = 0;
    if (own.contains(inode) && words >> word >> word >> dropped) drops += dropped;
  }
  return drops;
}

}  // namespace imrig
