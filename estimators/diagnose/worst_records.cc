#include "estimators/diagnose/worst_records.h"

#include <algorithm>
#include <cmath>

namespace imrig::est {

std::vector<const ComparedRecord*> worst_records(const CompareResult& result, std::size_t most) {
  std::vector<const ComparedRecord*> out;
  for (const auto& record : result.records) {
    if (record.left_out.empty() && !record.overlay.t_s.empty()) out.push_back(&record);
  }
  const bool floors = std::none_of(out.begin(), out.end(), [](const ComparedRecord* record) {
    return std::isnan(record->channels.at("current_A").floor);
  });
  const auto badness = [floors](const ComparedRecord* record) {
    const ChannelResult& c = record->channels.at("current_A");
    return floors ? c.nrmse / c.floor : c.nrmse;
  };
  std::stable_sort(out.begin(), out.end(),
                   [&](const auto* a, const auto* b) { return badness(a) > badness(b); });
  out.resize(std::min(most, out.size()));
  return out;
}

}  // namespace imrig::est
