#pragma once
// A file of any size seen through a buffer: bytes at an offset, read ahead in large pieces. Its size is taken
// when it is opened.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace imrig {

class FileWindow {
 public:
  // Throws Error when the path cannot be opened or is no regular file.
  explicit FileWindow(const std::string& path);
  ~FileWindow();
  FileWindow(const FileWindow&) = delete;
  FileWindow& operator=(const FileWindow&) = delete;

  std::int64_t size() const { return size_; }
  const std::string& path() const { return path_; }

  // n bytes at the offset, valid until the next call; null when they reach past the file's end.
  // Throws Error when the file cannot be read, or has become shorter.
  const std::uint8_t* at(std::int64_t offset, std::size_t n);

  // As at, for a few bytes far away: leaves the buffer where it is.
  bool peek(std::int64_t offset, std::uint8_t* out, std::size_t n) const;

 private:
  void read_exactly(std::int64_t offset, std::uint8_t* out, std::size_t n) const;

  std::string path_;
  int fd_ = -1;
  std::int64_t size_ = 0;
  std::vector<std::uint8_t> buffer_;
  std::int64_t start_ = 0;  // offset of the buffer's first byte
  std::size_t filled_ = 0;
};

}  // namespace imrig
