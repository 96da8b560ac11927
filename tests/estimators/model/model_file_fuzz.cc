// Any bytes: a model that is saved and read back to the same text, or an Error that names the file.

#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "estimators/model/model_file.h"
#include "rig/base/error.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace imrig::est;
  try {
    const Model model = parse_model(std::string(data, data + size), "m.toml");
    const std::string text = to_toml(model);
    if (to_toml(parse_model(text, "m.toml")) != text) std::abort();
    for (const auto& base : base_parameters()) {
      const Parameter& p = model.*base.place;
      if (p.known() && !(p.value > 0.0)) std::abort();
    }
  } catch (const imrig::Error& e) {
    if (std::string(e.what()).find("m.toml") != 0) std::abort();
  }
  return 0;
}

std::vector<std::vector<std::uint8_t>> fuzz_corpus() {
  using namespace imrig::est;
  Model model = nominal_model({});
  model.R_s.ci95_low = 0.38;
  model.R_s.ci95_high = 0.4;
  model.R_s_stator_C = 25.0;
  model.history.push_back({1, "identified", "set", 0x1234, 0.01, 0.02, 0.005});
  const std::string text = to_toml(model);
  return {{text.begin(), text.end()}};
}
