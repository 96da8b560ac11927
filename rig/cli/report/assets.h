#pragma once
// Files built into the program by report.cmake.

#include <string_view>

namespace imrig {

extern const std::string_view kChartJs;       // Chart.js, from Debian's libjs-chart.js
extern const std::string_view kReportScript;  // script.js
extern const std::string_view kReportStyle;   // style.css

}  // namespace imrig
