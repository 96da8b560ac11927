#include "rig/base/file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "rig/base/error.h"

namespace imrig {

namespace {

[[noreturn]] void fail(const std::string& path, const char* what, const std::string& temporary = "") {
  const std::string reason = std::strerror(errno);
  if (!temporary.empty()) ::unlink(temporary.c_str());
  throw Error(path, std::string(what) + ": " + reason);
}

}  // namespace

void flush_folder(const std::string& folder) {
  const int fd = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return;
  ::fsync(fd);
  ::close(fd);
}

std::string read_text(const std::string& path, std::size_t max_bytes) {
  struct stat info = {};
  if (::stat(path.c_str(), &info) != 0) fail(path, "cannot be read");
  if (S_ISDIR(info.st_mode)) throw Error(path, "is a folder", "a file is needed here");
  std::FILE* file = std::fopen(path.c_str(), "rb");
  if (file == nullptr) fail(path, "cannot be read");
  std::string text;
  char chunk[65536];
  std::size_t got = 0;
  while ((got = std::fread(chunk, 1, sizeof chunk, file)) > 0) {
    text.append(chunk, got);
    if (text.size() > max_bytes) {
      std::fclose(file);
      throw Error(path, "is larger than " + std::to_string(max_bytes) + " bytes", "split it");
    }
  }
  const bool bad = std::ferror(file) != 0;
  std::fclose(file);
  if (bad) fail(path, "cannot be read");
  return text;
}

void write_text_atomically(const std::string& path, std::string_view text) {
  const std::string temporary = path + ".part" + std::to_string(::getpid());
  const int fd = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (fd < 0) fail(path, "cannot be written");
  std::size_t done = 0;
  while (done < text.size()) {
    const ssize_t wrote = ::write(fd, text.data() + done, text.size() - done);
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote < 0) {
      ::close(fd);
      fail(path, "cannot be written", temporary);
    }
    done += static_cast<std::size_t>(wrote);
  }
  if (::fsync(fd) != 0 || ::close(fd) != 0) fail(path, "cannot be written", temporary);
  if (::rename(temporary.c_str(), path.c_str()) != 0) fail(path, "cannot be written", temporary);
  flush_folder(std::filesystem::path(path).parent_path().string());
}

std::uint64_t fnv1a64(std::string_view bytes, std::uint64_t seed) {
  std::uint64_t hash = seed;
  for (const char byte : bytes) {
    hash ^= static_cast<unsigned char>(byte);
    hash *= 1099511628211ull;
  }
  return hash;
}

std::string executable_folder() { return std::filesystem::read_symlink("/proc/self/exe").parent_path().string(); }

}  // namespace imrig
