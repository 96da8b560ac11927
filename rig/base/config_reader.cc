#include "rig/base/config_reader.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string_view>

#include "rig/base/error.h"
#include "rig/base/file.h"

namespace imrig {

struct ConfigReader::Node {
  std::shared_ptr<toml::table> root;  // owns what table points into
  const toml::table* table = nullptr;
  std::string file;
  std::string path;  // "" for the root, else "motor." or "record[2]."
  std::set<std::string> asked;
  std::map<std::string, std::vector<std::shared_ptr<Node>>> children;
};

namespace {

std::string kind_of(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table: return "a table";
    case toml::node_type::array: return "an array";
    case toml::node_type::string: return "a text";
    case toml::node_type::integer:
    case toml::node_type::floating_point: return "a number";
    case toml::node_type::boolean: return "true or false";
    default: return "a date";
  }
}

std::string join(const std::vector<std::string>& words) {
  std::string all;
  for (const auto& word : words) all += (all.empty() ? "\"" : ", \"") + word + "\"";
  return all;
}

std::string told(Range range) {
  if (std::isinf(range.low) && std::isinf(range.high)) return "a finite number";
  if (std::isinf(range.high)) return fmt::format("a number from {} up", range.low);
  if (std::isinf(range.low)) return fmt::format("a number up to {}", range.high);
  return fmt::format("a number from {} to {}", range.low, range.high);
}

}  // namespace

ConfigReader::ConfigReader(std::shared_ptr<Node> node) : node_(std::move(node)) {}

ConfigReader ConfigReader::from_file(const std::string& path) {
  return from_text(read_text(path, std::size_t{1} << 26), path);
}

ConfigReader ConfigReader::from_text(const std::string& text, const std::string& name) {
  try {
    auto root = std::make_shared<toml::table>(toml::parse(std::string_view(text), std::string_view(name)));
    auto node = std::make_shared<Node>();
    node->root = root;
    node->table = root.get();
    node->file = name;
    return ConfigReader(node);
  } catch (const toml::parse_error& e) {
    throw Error(fmt::format("{}:{}", name, e.source().begin.line), fmt::format("is no TOML ({})", e.description()));
  }
}

void ConfigReader::fail(const std::string& key, const std::string& what, const std::string& right) const {
  const toml::node* value = node_->table->get(key);
  const auto line = (value != nullptr ? value->source() : node_->table->source()).begin.line;
  throw Error(fmt::format("{}:{}", node_->file, line), fmt::format("{}{} {}", node_->path, key, what), right);
}

std::string ConfigReader::file() const { return node_->file; }

bool ConfigReader::has(const std::string& key) const { return node_->table->contains(key); }

std::vector<std::string> ConfigReader::keys() const {
  std::vector<std::pair<std::pair<unsigned, unsigned>, std::string>> placed;
  for (const auto& [key, value] : *node_->table) {
    placed.push_back({{key.source().begin.line, key.source().begin.column}, std::string(key.str())});
  }
  std::sort(placed.begin(), placed.end());
  std::vector<std::string> names;
  for (auto& entry : placed) names.push_back(std::move(entry.second));
  return names;
}

void ConfigReader::ignore(const std::string& key) const { node_->asked.insert(key); }

namespace {
double checked(const ConfigReader& reader, const std::string& key, const toml::node& value, Range range) {
  if (!value.is_number()) reader.fail(key, "is " + kind_of(value), "it must be " + told(range));
  const double x = value.is_integer() ? static_cast<double>(**value.as_integer()) : **value.as_floating_point();
  if (!std::isfinite(x) || x < range.low || x > range.high) {
    reader.fail(key, fmt::format("is {}", x), "it must be " + told(range));
  }
  return x;
}
}  // namespace

double ConfigReader::number(const std::string& key, Range range) const {
  node_->asked.insert(key);
  const toml::node* value = node_->table->get(key);
  if (value == nullptr) fail(key, "is missing", "it must be " + told(range));
  return checked(*this, key, *value, range);
}

double ConfigReader::number_or(const std::string& key, double fallback, Range range) const {
  node_->asked.insert(key);
  return has(key) ? number(key, range) : fallback;
}

long long ConfigReader::integer(const std::string& key, Range range) const {
  const double x = number(key, range);
  if (!node_->table->get(key)->is_integer()) fail(key, fmt::format("is {}", x), "it must be a whole number");
  return **node_->table->get(key)->as_integer();
}

long long ConfigReader::integer_or(const std::string& key, long long fallback, Range range) const {
  node_->asked.insert(key);
  return has(key) ? integer(key, range) : fallback;
}

bool ConfigReader::boolean_or(const std::string& key, bool fallback) const {
  node_->asked.insert(key);
  const toml::node* value = node_->table->get(key);
  if (value == nullptr) return fallback;
  if (!value->is_boolean()) fail(key, "is " + kind_of(*value), "it must be true or false");
  return **value->as_boolean();
}

std::string ConfigReader::text(const std::string& key) const {
  node_->asked.insert(key);
  const toml::node* value = node_->table->get(key);
  if (value == nullptr) fail(key, "is missing", "it must be a text");
  if (!value->is_string()) fail(key, "is " + kind_of(*value), "it must be a text");
  return **value->as_string();
}

std::string ConfigReader::text_or(const std::string& key, const std::string& fallback) const {
  node_->asked.insert(key);
  return has(key) ? text(key) : fallback;
}

std::string ConfigReader::choice(const std::string& key, const std::vector<std::string>& words) const {
  const std::string word = has(key) ? text(key) : "";
  node_->asked.insert(key);
  if (!has(key)) fail(key, "is missing", "it must be one of " + join(words));
  if (std::find(words.begin(), words.end(), word) == words.end()) {
    fail(key, "is \"" + word + "\"", "it must be one of " + join(words));
  }
  return word;
}

std::string ConfigReader::choice_or(const std::string& key, const std::vector<std::string>& words,
                                    const std::string& fallback) const {
  node_->asked.insert(key);
  return has(key) ? choice(key, words) : fallback;
}

std::vector<double> ConfigReader::numbers(const std::string& key, std::size_t at_least, std::size_t at_most,
                                          Range range) const {
  node_->asked.insert(key);
  const toml::node* value = node_->table->get(key);
  const std::string right = fmt::format("it must be an array of {} to {} numbers", at_least, at_most);
  if (value == nullptr) fail(key, "is missing", right);
  if (!value->is_array()) fail(key, "is " + kind_of(*value), right);
  std::vector<double> all;
  for (const auto& element : *value->as_array()) all.push_back(checked(*this, key, element, range));
  if (all.size() < at_least || all.size() > at_most) fail(key, fmt::format("has {} entries", all.size()), right);
  return all;
}

std::vector<std::string> ConfigReader::texts(const std::string& key, std::size_t at_least, std::size_t at_most) const {
  node_->asked.insert(key);
  const toml::node* value = node_->table->get(key);
  const std::string right = fmt::format("it must be an array of {} to {} texts", at_least, at_most);
  if (value == nullptr) fail(key, "is missing", right);
  if (!value->is_array()) fail(key, "is " + kind_of(*value), right);
  std::vector<std::string> all;
  for (const auto& element : *value->as_array()) {
    if (!element.is_string()) fail(key, "holds " + kind_of(element), right);
    all.push_back(**element.as_string());
  }
  if (all.size() < at_least || all.size() > at_most) fail(key, fmt::format("has {} entries", all.size()), right);
  return all;
}

std::optional<ConfigReader> ConfigReader::table_if(const std::string& key) const {
  node_->asked.insert(key);
  const toml::node* value = node_->table->get(key);
  if (value == nullptr) return std::nullopt;
  if (!value->is_table()) fail(key, "is " + kind_of(*value), "it must be a table");
  auto& known = node_->children[key];
  if (known.empty()) {
    auto child = std::make_shared<Node>();
    child->root = node_->root;
    child->table = value->as_table();
    child->file = node_->file;
    child->path = node_->path + key + ".";
    known.push_back(child);
  }
  return ConfigReader(known.front());
}

ConfigReader ConfigReader::table(const std::string& key) const {
  auto found = table_if(key);
  if (!found) fail(key, "is missing", "it must be a table [" + node_->path + key + "]");
  return *found;
}

std::vector<ConfigReader> ConfigReader::tables(const std::string& key) const {
  node_->asked.insert(key);
  std::vector<ConfigReader> all;
  const toml::node* value = node_->table->get(key);
  if (value == nullptr) return all;
  if (!value->is_array_of_tables()) fail(key, "is " + kind_of(*value), "it must be tables [[" + node_->path + key + "]]");
  auto& known = node_->children[key];
  if (known.empty()) {
    std::size_t index = 0;
    for (const auto& element : *value->as_array()) {
      auto child = std::make_shared<Node>();
      child->root = node_->root;
      child->table = element.as_table();
      child->file = node_->file;
      child->path = fmt::format("{}{}[{}].", node_->path, key, index++);
      known.push_back(child);
    }
  }
  for (const auto& child : known) all.push_back(ConfigReader(child));
  return all;
}

void ConfigReader::finish() const {
  for (const auto& key : keys()) {
    if (!node_->asked.contains(key)) {
      std::vector<std::string> known(node_->asked.begin(), node_->asked.end());
      fail(key, "is not known here", "known are " + join(known));
    }
  }
  for (const auto& [key, children] : node_->children) {
    for (const auto& child : children) ConfigReader(child).finish();
  }
}

}  // namespace imrig
