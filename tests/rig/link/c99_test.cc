// The device's side stays what a firmware can take: nothing from the system but a few functions of
// mathematics and memory.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <memory>
#include <set>
#include <sstream>
#include <string>

namespace imrig {
namespace {

std::string output_of(const std::string& command) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(::popen(command.c_str(), "r"), ::pclose);
  std::string text;
  std::array<char, 4096> buffer;
  for (std::size_t n; pipe && (n = std::fread(buffer.data(), 1, buffer.size(), pipe.get())) > 0;)
    text.append(buffer.data(), n);
  return text;
}

TEST(DeviceSide, NeedsNothingButMathematicsAndMemoryFunctions) {
  const std::set<std::string> allowed = {"sin",  "cos",    "sincos", "floor",   "sqrt",
                                         "fabs", "memcpy", "memset", "memmove", "_GLOBAL_OFFSET_TABLE_"};
  std::istringstream lines(output_of(std::string("nm -u --format=posix ") + IMRIG_LINK_DEVICE_ARCHIVE));
  int seen = 0;
  for (std::string line; std::getline(lines, line);) {
    const std::string name = line.substr(0, line.find(' '));
    if (name.empty() || line.find(" U") == std::string::npos) continue;
    ++seen;
    const bool ours = name.starts_with("imrig_"), sanitizer = name.starts_with("__");
    EXPECT_TRUE(ours || sanitizer || allowed.contains(name)) << name;
  }
  EXPECT_GT(seen, 10);
}

TEST(DeviceSide, CompilesAsPedanticC99WithEitherCompiler) {
  for (const std::string compiler : {"gcc", "clang"}) {
    if (output_of("command -v " + compiler).empty()) continue;
    const std::string told =
        output_of("cd '" IMRIG_SOURCE_DIR "' && " + compiler +
                  " -std=c99 -pedantic -Wall -Wextra -Wconversion -Wsign-conversion -Wshadow -Werror "
                  "-fsyntax-only -I. rig/link/device/*.c 2>&1 && echo fine");
    EXPECT_EQ(told, "fine\n") << compiler;
  }
}

}  // namespace
}  // namespace imrig
