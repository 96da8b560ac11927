#include "rig/base/file.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "rig/base/error.h"

namespace imrig {
namespace {

TEST(File, AtomicWriteReplacesTheWholeFileAndLeavesNothingBeside) {
  const auto folder = std::filesystem::temp_directory_path() / "imrig_file_test";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  const std::string path = (folder / "f.txt").string();
  write_text_atomically(path, "first");
  write_text_atomically(path, "second");
  EXPECT_EQ(read_text(path), "second");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}), 1);
  EXPECT_THROW(write_text_atomically((folder / "no" / "f").string(), "x"), Error);
  EXPECT_THROW(read_text(path, 3), Error);
  EXPECT_THROW(read_text(folder.string()), Error);
  std::filesystem::remove_all(folder);
}

TEST(File, Fnv1aMatchesItsPublishedValues) {
  EXPECT_EQ(fnv1a64(""), 0xcbf29ce484222325ull);
  EXPECT_EQ(fnv1a64("a"), 0xaf63dc4c8601ec8cull);
  EXPECT_EQ(fnv1a64("foobar"), 0x85944171f73967e8ull);
}

}  // namespace
}  // namespace imrig
