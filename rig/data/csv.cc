#include "rig/data/csv.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>

#include "rig/base/error.h"
#include "rig/base/file.h"
#include "rig/data/record.h"
#include "rig/data/unit_row.h"

namespace imrig {

namespace {

// What a message shows of a cell: printable and short.
std::string shown(std::string_view cell) {
  std::string clean;
  for (const char c : cell.substr(0, 24)) clean += static_cast<unsigned char>(c) < 32 || c == 127 ? '?' : c;
  return "\"" + clean + (cell.size() > 24 ? "..." : "") + "\"";
}

std::string_view trimmed(std::string_view cell) {
  while (!cell.empty() && (cell.front() == ' ' || cell.front() == '\t')) cell.remove_prefix(1);
  while (!cell.empty() && (cell.back() == ' ' || cell.back() == '\t')) cell.remove_suffix(1);
  return cell;
}

std::string unquoted(std::string_view cell) {
  cell = trimmed(cell);
  if (cell.size() < 2 || cell.front() != '"' || cell.back() != '"') return std::string(cell);
  std::string text;
  for (std::size_t k = 1; k + 1 < cell.size(); ++k) {
    text += cell[k];
    if (cell[k] == '"' && k + 2 < cell.size() && cell[k + 1] == '"') ++k;
  }
  return text;
}

// The separator found most often outside quotes; none if the header has one column.
char separator_of(std::string_view header) {
  std::size_t commas = 0, semicolons = 0, tabs = 0;
  bool quoted = false;
  for (const char c : header) {
    if (c == '"') quoted = !quoted;
    if (quoted) continue;
    commas += c == ',' ? 1u : 0u;
    semicolons += c == ';' ? 1u : 0u;
    tabs += c == '\t' ? 1u : 0u;
  }
  const std::size_t most = std::max({commas, semicolons, tabs});
  if (most == 0) return '\0';
  return most == semicolons ? ';' : most == tabs ? '\t' : ',';
}

std::vector<std::string_view> split(std::string_view line, char separator) {
  std::vector<std::string_view> cells;
  bool quoted = false;
  std::size_t from = 0;
  for (std::size_t k = 0; k < line.size(); ++k) {
    if (line[k] == '"') quoted = !quoted;
    if (line[k] == separator && separator != '\0' && !quoted) {
      cells.push_back(line.substr(from, k - from));
      from = k + 1;
    }
  }
  cells.push_back(line.substr(from));
  return cells;
}

bool is_missing_word(std::string_view cell) {
  if (cell.size() > 4) return false;
  std::string lower;
  for (const char c : cell) lower += static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  return lower.empty() || lower == "nan" || lower == "na" || lower == "n/a" || lower == "null";
}

// One cell, already cut out. False if it is no finite number and no missing value.
bool parse_cell(std::string_view raw, bool decimal_comma, double& x) {
  char buffer[64];
  std::string_view cell = trimmed(raw);
  if (cell.size() >= 2 && cell.front() == '"' && cell.back() == '"')
    cell = trimmed(cell.substr(1, cell.size() - 2));
  if (is_missing_word(cell)) {
    x = kMissing;
    return true;
  }
  if (cell.front() == '+' && cell.size() > 1 && cell[1] != '-') cell.remove_prefix(1);
  if (decimal_comma && cell.size() <= sizeof buffer && std::count(cell.begin(), cell.end(), ',') == 1 &&
      cell.find('.') == std::string_view::npos) {
    std::replace_copy(cell.begin(), cell.end(), buffer, ',', '.');
    cell = {buffer, cell.size()};
  }
  const char* end = cell.data() + cell.size();
  const auto [stop, problem] = std::from_chars(cell.data(), end, x);
  return problem == std::errc() && stop == end && std::isfinite(x);
}

class CsvParser {
 public:
  CsvParser(std::string_view text, const std::string& name, const CsvLimits& limits)
      : rest_(text), limits_(limits) {
    table_.file = name;
  }

  ColumnTable parse() {
    check_encoding();
    read_header();
    reserve();
    std::string_view line;
    if (next_line(line) && !take_units(line)) read_row(line);
    while (next_line(line)) read_row(line);
    return std::move(table_);
  }

 private:
  [[noreturn]] void fail(const std::string& what, const std::string& right) const {
    throw Error(fmt::format("{}:{}", table_.file, line_), what, right);
  }

  void check_encoding() {
    if (rest_.size() > limits_.max_bytes) {
      throw Error(table_.file, fmt::format("has {} bytes", rest_.size()),
                  fmt::format("at most {} are read", limits_.max_bytes));
    }
    if (rest_.starts_with("\xff\xfe") || rest_.starts_with("\xfe\xff")) {
      throw Error(table_.file, "is UTF-16 text", "save it as UTF-8 or plain ASCII");
    }
    if (rest_.starts_with("\xef\xbb\xbf")) rest_.remove_prefix(3);
  }

  // The next line that is neither blank nor a comment, without its end.
  bool next_line(std::string_view& line) {
    while (!rest_.empty()) {
      const auto* end = static_cast<const char*>(std::memchr(rest_.data(), '\n', rest_.size()));
      const std::size_t length = end == nullptr ? rest_.size() : static_cast<std::size_t>(end - rest_.data());
      line = rest_.substr(0, length);
      rest_.remove_prefix(std::min(rest_.size(), length + 1));
      ++line_;
      if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
      const std::size_t first = line.find_first_not_of(" \t");
      if (first != std::string_view::npos && line[first] != '#') return true;
    }
    return false;
  }

  void read_header() {
    std::string_view header;
    if (!next_line(header))
      throw Error(table_.file, "is empty", "a header line with the columns' names is needed");
    separator_ = separator_of(header);
    auto cells = split(header, separator_);
    if (cells.size() > 1 && trimmed(cells.back()).empty()) cells.pop_back();  // a separator at the line's end
    if (cells.size() > limits_.max_columns) {
      fail(fmt::format("has {} columns", cells.size()),
           fmt::format("at most {} are read", limits_.max_columns));
    }
    for (const auto& cell : cells) add_name(unquoted(cell));
    double number = 0.0;
    if (std::all_of(cells.begin(), cells.end(),
                    [&](auto cell) { return parse_cell(cell, separator_ != ',', number); })) {
      fail("the first line holds numbers", "a header line with the columns' names is needed");
    }
  }

  bool take_units(std::string_view line) {
    auto cells = split(line, separator_);
    if (cells.size() == table_.names.size() + 1 && trimmed(cells.back()).empty()) cells.pop_back();
    if (cells.size() != table_.names.size()) return false;
    std::vector<std::string> words;
    for (const auto& cell : cells) words.push_back(unquoted(cell));
    if (!is_unit_row(words)) return false;
    table_.units = std::move(words);
    return true;
  }

  void add_name(const std::string& name) {
    const std::size_t column = table_.names.size() + 1;
    if (name.empty()) fail(fmt::format("column {} has no name", column), "each column needs one");
    if (table_.find(name) >= 0)
      fail(fmt::format("column {} is there twice", shown(name)), "names must differ");
    table_.names.push_back(name);
  }

  void reserve() {
    const auto rows = static_cast<std::size_t>(std::count(rest_.begin(), rest_.end(), '\n')) + 1;
    table_.columns.resize(table_.names.size());
    if (rows > limits_.max_cells / table_.names.size()) {
      throw Error(table_.file, fmt::format("has {} lines of {} columns", rows, table_.names.size()),
                  fmt::format("at most {} values are read", limits_.max_cells));
    }
    for (auto& column : table_.columns) column.reserve(rows);
    table_.lines.reserve(rows);
  }

  // Most cells are plain numbers right up to the separator; whatever is not takes the careful way.
  void read_row(std::string_view line) {
    const char* at = line.data();
    const char* const end = at + line.size();
    const std::size_t count = table_.columns.size();
    for (std::size_t k = 0; k < count; ++k) {
      double x = 0.0;
      const auto [stop, problem] = std::from_chars(at, end, x);
      const bool last = k + 1 == count;
      const bool ends_well = last ? stop == end : stop != end && *stop == separator_;
      if (problem != std::errc() || !ends_well || !std::isfinite(x)) return read_row_carefully(line);
      at = last ? end : stop + 1;
      row_[k] = x;
    }
    keep_row();
  }

  void read_row_carefully(std::string_view line) {
    auto cells = split(line, separator_);
    const std::size_t count = table_.columns.size();
    if (cells.size() == count + 1 && trimmed(cells.back()).empty()) cells.pop_back();
    if (cells.size() != count) {
      fail(fmt::format("has {} cells", cells.size()), fmt::format("the header names {} columns", count));
    }
    for (std::size_t k = 0; k < count; ++k) {
      if (!parse_cell(cells[k], separator_ != ',', row_[k])) {
        fail(fmt::format("column {} holds {}", shown(table_.names[k]), shown(cells[k])),
             "a finite number or nothing belongs there");
      }
    }
    keep_row();
  }

  void keep_row() {
    for (std::size_t k = 0; k < table_.columns.size(); ++k) table_.columns[k].push_back(row_[k]);
    table_.lines.push_back(line_);
  }

  std::string_view rest_;
  CsvLimits limits_;
  ColumnTable table_;
  char separator_ = ',';
  std::uint32_t line_ = 0;
  std::vector<double> row_ = std::vector<double>(limits_.max_columns);
};

}  // namespace

ColumnTable parse_csv(std::string_view text, const std::string& name, const CsvLimits& limits) {
  return CsvParser(text, name, limits).parse();
}

ColumnTable read_csv(const std::string& path, const CsvLimits& limits) {
  return parse_csv(read_text(path, limits.max_bytes), path, limits);
}

}  // namespace imrig
