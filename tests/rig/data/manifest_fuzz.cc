// Any bytes: a manifest that holds what docs/data-sets.md promises, or an Error in one line.

#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "rig/base/error.h"
#include "rig/data/manifest.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const auto manifest = imrig::parse_manifest(std::string(data, data + size), "dataset.toml", "/data");
    if (manifest.records.empty() || manifest.pole_pairs < 1) std::abort();
    for (const auto& record : manifest.records) {
      if (record.id.empty() || !record.path.starts_with("/data/") ||
          record.path.find("/../") != std::string::npos)
        std::abort();
    }
  } catch (const imrig::Error& e) {
    if (std::string(e.what()).find("dataset.toml") != 0) std::abort();
  }
  return 0;
}

std::vector<std::vector<std::uint8_t>> fuzz_corpus() {
  const std::string text =
      "name = \"x\"\npole_pairs = 2\nconnection = \"delta\"\nquantities = \"line\"\nnoise = { current_A = "
      "0.1, speed_rpm = 1 }\n"
      "[[record]]\nid = \"a\"\nkind = \"step\"\nfile = \"a.csv\"\nsample_time_s = 1e-4\ncolumns.v_a_V = { "
      "from = \"u\", scale = 2 }\n"
      "[[record]]\nid = \"b\"\nkind = \"points\"\nfile = \"d/b.mat\"\nrepeat_of = \"a\"\nholdout = true\nset "
      "= { f_Hz = 50 }\n";
  return {{text.begin(), text.end()}};
}
