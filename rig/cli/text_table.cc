#include "rig/cli/text_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace imrig {

namespace {

// Characters, not bytes: names may be UTF-8.
std::size_t width(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(
      text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

void add_line(const std::vector<std::string>& cells, const std::vector<std::size_t>& widths,
              const std::vector<bool>& left, std::string& out) {
  std::string line;
  for (std::size_t c = 0; c < widths.size(); ++c) {
    const std::string cell = c < cells.size() ? cells[c] : "";
    const std::string pad(widths[c] - std::min(widths[c], width(cell)), ' ');
    if (c > 0) line += "  ";
    line += left[c] ? cell + pad : pad + cell;
  }
  line.erase(line.find_last_not_of(' ') + 1);
  out += line;
  out += '\n';
}

}  // namespace

TextTable::TextTable(std::vector<std::string> header) : header_(std::move(header)) {
  for (auto& name : header_) {
    left_.push_back(!name.empty() && name.front() == '<');
    if (left_.back()) name.erase(0, 1);
  }
}

void TextTable::row(std::vector<std::string> cells) { rows_.push_back(std::move(cells)); }

std::string TextTable::text() const {
  std::vector<std::size_t> widths;
  for (const auto& name : header_) widths.push_back(width(name));
  for (const auto& cells : rows_) {
    for (std::size_t c = 0; c < std::min(cells.size(), widths.size()); ++c)
      widths[c] = std::max(widths[c], width(cells[c]));
  }
  std::string out;
  add_line(header_, widths, left_, out);
  for (const auto& cells : rows_) add_line(cells, widths, left_, out);
  return out;
}

std::string shown(double x, int digits) { return std::isnan(x) ? "-" : fmt::format("{:.{}g}", x, digits); }

std::string shown_beside(double largest, double x, int digits) {
  return shown(std::abs(x) <= 1e-12 * std::abs(largest) ? 0.0 : x, digits);
}

std::string printable(const std::string& text) {
  std::string out = text;
  for (char& c : out) {
    if (static_cast<unsigned char>(c) < 32 || c == 127) c = '?';
  }
  return out;
}

}  // namespace imrig
