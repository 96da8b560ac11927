#pragma once
// Tables for people: columns as wide as they need, numbers right, words left.

#include <string>
#include <vector>

namespace imrig {

class TextTable {
 public:
  // A name that starts with '<' is a column of words, set left without the sign; others are set right.
  explicit TextTable(std::vector<std::string> header);
  void row(std::vector<std::string> cells);
  bool empty() const { return rows_.empty(); }
  std::string text() const;

 private:
  std::vector<std::string> header_;
  std::vector<bool> left_;
  std::vector<std::vector<std::string>> rows_;
};

// A number with so many significant digits; "-" for NaN.
std::string shown(double x, int digits = 4);
// The same among other numbers, the largest of them this large: what is only the rounding of arithmetic with
// those (below 1e-12 of it) is "0".
std::string shown_beside(double largest, double x, int digits = 4);
// Text from a file, safe on a terminal: control characters become '?'.
std::string printable(const std::string& text);

}  // namespace imrig
