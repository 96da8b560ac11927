#include "rig/bus/file_window.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "rig/base/error.h"

namespace imrig {

namespace {
constexpr std::size_t kPiece = std::size_t{1} << 20;
}  // namespace

FileWindow::FileWindow(const std::string& path) : path_(path) {
  fd_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);  // a pipe without a writer would hang
  if (fd_ < 0) throw Error(path, std::string("cannot be read: ") + std::strerror(errno));
  struct stat info = {};
  if (::fstat(fd_, &info) != 0 || !S_ISREG(info.st_mode)) {
    ::close(fd_);
    throw Error(path, "is no regular file", "an LCM event log is needed here");
  }
  size_ = info.st_size;
}

FileWindow::~FileWindow() { ::close(fd_); }

const std::uint8_t* FileWindow::at(std::int64_t offset, std::size_t n) {
  if (offset < 0 || offset > size_ || static_cast<std::uint64_t>(size_ - offset) < n) return nullptr;
  const std::int64_t in = offset - start_;
  if (in >= 0 && in <= static_cast<std::int64_t>(filled_) && filled_ - static_cast<std::size_t>(in) >= n) {
    return buffer_.data() + in;
  }
  const auto left = static_cast<std::uint64_t>(size_ - offset);
  const auto want = static_cast<std::size_t>(std::min<std::uint64_t>(left, std::max(n, kPiece)));
  buffer_.resize(std::max(buffer_.size(), want));
  filled_ = 0;
  read_exactly(offset, buffer_.data(), want);
  start_ = offset;
  filled_ = want;
  return buffer_.data();
}

bool FileWindow::peek(std::int64_t offset, std::uint8_t* out, std::size_t n) const {
  if (offset < 0 || offset > size_ || static_cast<std::uint64_t>(size_ - offset) < n) return false;
  const std::int64_t in = offset - start_;
  if (in >= 0 && in <= static_cast<std::int64_t>(filled_) && filled_ - static_cast<std::size_t>(in) >= n) {
    std::memcpy(out, buffer_.data() + in, n);
  } else {
    read_exactly(offset, out, n);
  }
  return true;
}

void FileWindow::read_exactly(std::int64_t offset, std::uint8_t* out, std::size_t n) const {
  std::size_t done = 0;
  while (done < n) {
    const ssize_t got = ::pread(fd_, out + done, n - done, offset + static_cast<std::int64_t>(done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw Error(path_, std::string("cannot be read: ") + std::strerror(errno));
    if (got == 0) throw Error(path_, "became shorter while it was read");
    done += static_cast<std::size_t>(got);
  }
}

}  // namespace imrig
