#pragma once
// A comparison as one HTML file that needs nothing else: no network, no other file. Charts by Chart.js, which
// is built in.

#include <string>

#include "estimators/diagnose/compare.h"
#include "estimators/model/model.h"

namespace imrig {

std::string report_html(const est::Model& model, const est::CompareResult& result);

// Writes FOLDER/report.html, whole or not at all; makes the folder. Returns the file's path. Throws Error.
std::string write_report(const est::Model& model, const est::CompareResult& result,
                         const std::string& folder);

}  // namespace imrig
