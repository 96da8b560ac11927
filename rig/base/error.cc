#include "rig/base/error.h"

#include <cstdio>

namespace imrig {

namespace {
std::string sentence(const std::string& where, const std::string& what, const std::string& right) {
  return right.empty() ? where + ": " + what : where + ": " + what + "; " + right;
}
}  // namespace

Error::Error(const std::string& where, const std::string& what, const std::string& right)
    : std::runtime_error(sentence(where, what, right)) {}

int run_main(const char* program, int (*body)(int, char**), int argc, char** argv) {
  try {
    return body(argc, argv);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s: %s\n", program, e.what());
    return 2;
  }
}

}  // namespace imrig
