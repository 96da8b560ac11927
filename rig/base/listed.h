#pragma once

#include <string>
#include <vector>

namespace imrig {

// "a", "a and b", "a, b and c"; empty for none.
inline std::string listed(const std::vector<std::string>& names) {
  std::string out;
  for (std::size_t k = 0; k < names.size(); ++k)
    out += (k == 0 ? "" : k + 1 == names.size() ? " and " : ", ") + names[k];
  return out;
}

}  // namespace imrig
