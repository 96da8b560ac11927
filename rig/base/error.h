#pragma once
// The one exception of imrig: bad input or bad configuration, told in one sentence: where, what, what would be right.
// Thrown by readers and constructors, caught in main, which prints it and exits with 2.
// Running processes do not throw: there a fault is a state (rig/safety/trip.h).

#include <stdexcept>
#include <string>

namespace imrig {

class Error : public std::runtime_error {
 public:
  explicit Error(const std::string& sentence) : std::runtime_error(sentence) {}
  // "WHERE: WHAT" or "WHERE: WHAT; RIGHT".
  Error(const std::string& where, const std::string& what, const std::string& right = "");
};

// Runs a program's body: Error and other exceptions become one line on stderr and exit code 2.
int run_main(const char* program, int (*body)(int, char**), int argc, char** argv);

}  // namespace imrig
