#pragma once
// What measuring programs need to run other programs: a folder that goes with them, and a command's JSON.

#include <fmt/format.h>
#include <stdlib.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "rig/base/error.h"
#include "rig/base/file.h"

namespace imrig::bench {

// A folder that goes with the program.
class Scratch {
 public:
  Scratch() {
    std::string name = std::filesystem::temp_directory_path() / "imrig-bench-XXXXXX";
    if (::mkdtemp(name.data()) == nullptr) throw Error(name, "cannot be made");
    path_ = name;
  }
  ~Scratch() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  std::string operator/(const std::string& name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

// Runs a command line; what it prints, as JSON. Throws Error when that is none.
inline nlohmann::json json_of(const std::string& command) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(::popen(command.c_str(), "r"), ::pclose);
  if (!pipe) throw Error(command, "cannot be run");
  std::string text;
  std::array<char, 4096> buffer;
  while (const std::size_t n = std::fread(buffer.data(), 1, buffer.size(), pipe.get())) text.append(buffer.data(), n);
  const nlohmann::json parsed = nlohmann::json::parse(text, nullptr, false);
  if (parsed.is_discarded()) throw Error(command, fmt::format("said \"{}\"", text), "JSON");
  return parsed;
}

// Likewise a command line of the programs built beside this one.
inline nlohmann::json answer(const std::string& command) {
  return json_of(fmt::format("{}/{}", executable_folder(), command));
}

}  // namespace imrig::bench
