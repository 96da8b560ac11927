#pragma once
// Strict reading of TOML: each key is asked for by name, type and range; whatever nobody asked for is an error.
// Every complaint names the file, the line, the key, what is there and what would be right.

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace imrig {

struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
};

class ConfigReader {
 public:
  // Throws Error when the file is missing or is no TOML.
  static ConfigReader from_file(const std::string& path);
  static ConfigReader from_text(const std::string& text, const std::string& name);

  // Numbers: integers are accepted where a real number is asked for. NaN and infinity are refused.
  double number(const std::string& key, Range range = {}) const;
  double number_or(const std::string& key, double fallback, Range range = {}) const;
  long long integer(const std::string& key, Range range = {}) const;
  long long integer_or(const std::string& key, long long fallback, Range range = {}) const;
  bool boolean_or(const std::string& key, bool fallback) const;
  std::string text(const std::string& key) const;
  std::string text_or(const std::string& key, const std::string& fallback) const;
  // One of the given words.
  std::string choice(const std::string& key, const std::vector<std::string>& words) const;
  std::string choice_or(const std::string& key, const std::vector<std::string>& words, const std::string& fallback) const;
  std::vector<double> numbers(const std::string& key, std::size_t at_least, std::size_t at_most, Range range = {}) const;
  std::vector<std::string> texts(const std::string& key, std::size_t at_least, std::size_t at_most) const;

  bool has(const std::string& key) const;
  std::vector<std::string> keys() const;             // all keys of this table, in the file's order
  ConfigReader table(const std::string& key) const;  // must exist
  std::optional<ConfigReader> table_if(const std::string& key) const;
  std::vector<ConfigReader> tables(const std::string& key) const;  // [[key]]; empty when absent
  void ignore(const std::string& key) const;         // known, not wanted

  // Throws Error naming the first key, here or in any table below, that nobody asked for. Call it once, on the root.
  void finish() const;

  // An Error about this table's key, with file and line: for checks that a range cannot express.
  [[noreturn]] void fail(const std::string& key, const std::string& what, const std::string& right = "") const;
  std::string file() const;

 private:
  struct Node;
  explicit ConfigReader(std::shared_ptr<Node> node);
  std::shared_ptr<Node> node_;
};

}  // namespace imrig
