#include "rig/cli/report/html.h"

#include <filesystem>

#include "rig/base/error.h"
#include "rig/base/file.h"
#include "rig/cli/report/assets.h"

namespace imrig {

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += static_cast<unsigned char>(c) < 32 || c == 127 ? ' ' : c;
    }
  }
  return out;
}

std::string escaped_json(const std::string& json) {
  std::string out;
  for (const char c : json) {
    if (c == '<') {
      out += "\\u003c";
    } else {
      out += c;
    }
  }
  return out;
}

std::string html_table(const std::vector<std::string>& header,
                       const std::vector<std::vector<std::string>>& rows) {
  std::string out = "<div class=\"wide\"><table>\n<thead><tr>";
  std::vector<const char*> open;
  for (const auto& name : header) {
    const bool left = !name.empty() && name.front() == '<';
    open.push_back(left ? "<td class=\"left\">" : "<td>");
    out += left ? "<th class=\"left\">" : "<th>";
    out += escaped(left ? name.substr(1) : name) + "</th>";
  }
  out += "</tr></thead>\n<tbody>\n";
  for (const auto& row : rows) {
    out += "<tr>";
    for (std::size_t c = 0; c < header.size(); ++c) {
      out += open[c];
      out += c < row.size() ? escaped(row[c]) : "";
      out += "</td>";
    }
    out += "</tr>\n";
  }
  return out + "</tbody></table></div>\n";
}

std::string html_page(const std::string& title, const std::string& main, const std::string& chart_json) {
  std::string out = "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n";
  out += "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n";
  out += "<title>" + escaped(title) + "</title>\n";
  out += "<style>\n" + std::string(kReportStyle) + "</style>\n</head>\n<body>\n<main>\n" + main + "</main>\n";
  out += "<script type=\"application/json\" id=\"data\">" + escaped_json(chart_json) + "</script>\n";
  out += "<script>" + std::string(kChartJs) + "</script>\n<script>\n" + std::string(kReportScript) +
         "</script>\n</body>\n</html>\n";
  return out;
}

std::string write_page(const std::string& folder, const std::string& html) {
  std::error_code problem;
  std::filesystem::create_directories(folder, problem);
  if (problem)
    throw Error(folder, "cannot be made: " + problem.message(), "--report names the folder for report.html");
  const std::string path = (std::filesystem::path(folder) / "report.html").string();
  write_text_atomically(path, html);
  return path;
}

}  // namespace imrig
