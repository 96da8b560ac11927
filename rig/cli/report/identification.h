#pragma once
// An identification by maps as one HTML file that needs nothing else: the paper's figures 2 to 18 with this
// motor's data. Charts by Chart.js, which is built in.

#include <string>

#include "estimators/fit/maps/identify_maps.h"

namespace imrig {

std::string identification_html(const est::MapsResult& result);

// Writes FOLDER/report.html, whole or not at all; makes the folder. Returns the file's path. Throws Error.
std::string write_identification_report(const est::MapsResult& result, const std::string& folder);

}  // namespace imrig
