#pragma once
// JSON of diagnose and improve, as other programs read it: docs/diagnosis.md.

#include <string>

#include "estimators/diagnose/diagnose.h"

namespace imrig::est {

inline constexpr int kDiagnoseJsonVersion = 1;

std::string diagnose_json(const Diagnosis& diagnosis);
std::string improve_json(const Improvement& improvement, const std::string& model_path);

}  // namespace imrig::est
