#pragma once
// Numbers for JSON, where NaN and infinity do not exist: they are null.

#include <cmath>
#include <nlohmann/json.hpp>

namespace imrig {

using Json = nlohmann::ordered_json;

inline Json json_number(double x) { return std::isfinite(x) ? Json(x) : Json(nullptr); }

// Text that stays valid JSON whatever bytes the names hold.
inline std::string json_text(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace imrig
