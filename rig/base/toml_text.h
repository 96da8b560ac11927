#pragma once
// Values as TOML writes them.

#include <string>

namespace imrig {

// A basic string in its quotes; control characters as \uXXXX.
std::string toml_quoted(const std::string& text);
// Shortest text that reads back to the same bits, and that TOML takes for a real number.
std::string toml_number(double x);

}  // namespace imrig
