#include "rig/data/record.h"

#include <array>
#include <utility>

namespace imrig {

namespace {
constexpr std::array<std::pair<RecordKind, const char*>, 10> kWords = {
    {{RecordKind::kDc, "dc"},
     {RecordKind::kStandstill, "standstill"},
     {RecordKind::kLockedSweep, "locked_sweep"},
     {RecordKind::kNoLoad, "no_load"},
     {RecordKind::kSteady, "steady"},
     {RecordKind::kStep, "step"},
     {RecordKind::kStartup, "startup"},
     {RecordKind::kCoastDown, "coast_down"},
     {RecordKind::kFree, "free"},
     {RecordKind::kPoints, "points"}}};
}  // namespace

std::string record_kind_word(RecordKind kind) {
  for (const auto& [known, word] : kWords) {
    if (known == kind) return word;
  }
  return "free";
}

std::optional<RecordKind> record_kind_from(const std::string& word) {
  for (const auto& [kind, known] : kWords) {
    if (word == known) return kind;
  }
  return std::nullopt;
}

}  // namespace imrig
