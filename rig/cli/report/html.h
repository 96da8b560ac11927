#pragma once
// HTML from text that may hold anything: names of records and columns come from files.

#include <string>
#include <vector>

namespace imrig {

// Text for element content and double-quoted attributes; control characters become spaces.
std::string escaped(const std::string& text);

// JSON for a <script> element: no '<' can end the element early.
std::string escaped_json(const std::string& json);

// <table>; cells are escaped here. A header that starts with '<' is a column of words, set left.
std::string html_table(const std::vector<std::string>& header,
                       const std::vector<std::vector<std::string>>& rows);

// A whole page: what stands in <main>, then Chart.js and script.js with the charts' data, which draw into
// <div id="charts">. title is escaped here.
std::string html_page(const std::string& title, const std::string& main, const std::string& chart_json);

// Writes FOLDER/report.html, whole or not at all; makes the folder. Returns the file's path. Throws Error.
std::string write_page(const std::string& folder, const std::string& html);

}  // namespace imrig
