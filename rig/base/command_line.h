#pragma once
// What every program does with its arguments. Included by mains alone: CLI11 is a heavy header.

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "rig/base/error.h"

namespace imrig {

// An exit code when that was all there was to do (--help, --version). Throws Error on bad usage.
inline std::optional<int> parse_command_line(CLI::App& app, const char* program, int argc, char** argv) {
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {
    return app.exit(asked);
  } catch (const CLI::ParseError& e) {
    throw Error("usage", e.what(), std::string("see ").append(program).append(" --help"));
  }
  return std::nullopt;
}

}  // namespace imrig
