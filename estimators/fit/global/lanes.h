#pragma once
// Which unknowns an evaluation differentiates by: entries of the shared vector, then entries of the record's
// own vector, one derivative lane each.

#include <cstddef>
#include <vector>

namespace imrig::est {

struct Lanes {
  std::vector<std::size_t> shared;
  std::vector<std::size_t> local;
  std::size_t size() const { return shared.size() + local.size(); }
};

}  // namespace imrig::est
