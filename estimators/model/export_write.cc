#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>

#include "estimators/model/export.h"

namespace imrig::est {

namespace {

using Json = nlohmann::ordered_json;

// Shortest text that reads back to the same bits; empty for nothing known.
std::string cell(double x) { return std::isfinite(x) ? fmt::format("{}", x) : ""; }

std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string out(1, '"');
  for (const char c : text) {
    if (c == '"') out.push_back('"');
    out.push_back(c);
  }
  out.push_back('"');
  return out;
}

Json number(double x) { return std::isfinite(x) ? Json(x) : Json(nullptr); }

// A C identifier in capitals.
std::string macro(const std::string& name) {
  std::string out = "MOTOR_";
  for (const char c : name) {
    const auto u = static_cast<unsigned char>(c);
    out += std::isalnum(u) != 0 && u < 0x80 ? static_cast<char>(std::toupper(u)) : '_';
  }
  return out;
}

// Text that stays inside a comment.
std::string remark(const std::string& text) {
  std::string out;
  for (const char c : text)
    out += std::isprint(static_cast<unsigned char>(c)) != 0 && c != '*' && c != '\\' ? c : ' ';
  return out;
}

// A literal of type double.
std::string literal(double x) {
  std::string text = fmt::format("{}", x);
  if (text.find_first_of(".en") == std::string::npos) text.append(".0");
  return text;
}

std::string c_table(const ExportedTable& table) {
  const std::string size = macro(table.name + "_rows");
  std::string out = fmt::format("\n/* {} table: {}. */\n#define {} {}\n", remark(table.name),
                                remark(table.meaning), size, table.rows.size());
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    out += fmt::format("static const double motor_{}_{}[{}] = {{\n", table.name, table.columns[c], size);
    for (const auto& row : table.rows) out += fmt::format("    {},\n", literal(row[c]));
    out += "};\n";
  }
  return out;
}

}  // namespace

std::string exported_csv(const ExportedModel& model) {
  std::string out = "name,value,ci95_low,ci95_high,meaning\n";
  out += fmt::format("pole_pairs,{},,,\n", model.pole_pairs);
  for (const ExportedNumber& n : model.numbers)
    out += fmt::format("{},{},{},{},{}\n", quoted(n.name), cell(n.value), cell(n.ci95_low), cell(n.ci95_high),
                       quoted(n.meaning));
  for (const ExportedTable& table : model.tables) {
    out += "\n";
    out += fmt::format("{}\n", fmt::join(table.columns, ","));
    for (const auto& row : table.rows) {
      std::vector<std::string> cells;
      for (const double x : row) cells.push_back(cell(x));
      out += fmt::format("{}\n", fmt::join(cells, ","));
    }
  }
  return out;
}

std::string exported_json(const ExportedModel& model) {
  Json out{{"version", 1},
           {"name", model.name},
           {"pole_pairs", model.pole_pairs},
           {"connection", model.delta ? "delta" : "star"},
           {"numbers", Json::object()},
           {"tables", Json::object()}};
  for (const ExportedNumber& n : model.numbers)
    out["numbers"][n.name] = {{"value", number(n.value)},
                              {"ci95", {number(n.ci95_low), number(n.ci95_high)}},
                              {"meaning", n.meaning}};
  for (const ExportedTable& table : model.tables) {
    Json columns = Json::object();
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
      Json column = Json::array();
      for (const auto& row : table.rows) column.push_back(number(row[c]));
      columns[table.columns[c]] = column;
    }
    out["tables"][table.name] = {{"meaning", table.meaning}, {"columns", columns}};
  }
  return out.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string exported_c(const ExportedModel& model) {
  std::string out = fmt::format(
      "/* {}: parameters for field-oriented control, written by imrig model export.\n"
      " * Per phase of the equivalent star, amplitude-invariant space vectors (peak values), SI units;\n"
      " * motor connected in {}. R_s, R_r, L_l, L_m: inverse-gamma circuit (L_l is sigma L_s). */\n"
      "#ifndef IMRIG_MOTOR_H\n#define IMRIG_MOTOR_H\n\n#define MOTOR_POLE_PAIRS {}\n",
      remark(model.name), model.delta ? "delta" : "star", model.pole_pairs);
  for (const ExportedNumber& n : model.numbers) {
    if (!std::isfinite(n.value)) continue;
    out += fmt::format("#define {} {} /* {}", macro(n.name), literal(n.value), remark(n.meaning));
    if (std::isfinite(n.ci95_low) && std::isfinite(n.ci95_high))
      out += fmt::format("; 95 %: {:.6g} to {:.6g}", n.ci95_low, n.ci95_high);
    out += " */\n";
  }
  for (const ExportedTable& table : model.tables) out += c_table(table);
  return out + "\n#endif\n";
}

}  // namespace imrig::est
