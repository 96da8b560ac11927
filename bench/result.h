#pragma once
// What a benchmark says: one JSON object a line, or one line of a table.

#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>

namespace imrig::bench {

struct Result {
  std::string name;
  double value = 0.0;
  std::string unit;
  double target = 0.0;
  bool higher_is_better = true;
  std::string note;

  bool reached() const { return higher_is_better ? value >= target : value <= target; }
};

inline void print(const Result& r, bool json) {
  if (json) {
    const nlohmann::ordered_json line = {
        {"name", r.name}, {"value", r.value}, {"unit", r.unit}, {"target", r.target}, {"note", r.note}};
    fmt::print("{}\n", line.dump());
  } else {
    fmt::print("{:<20}{:>10.4g} {:<12}{} {:<8.4g}{:<8}{}\n", r.name, r.value, r.unit,
               r.higher_is_better ? ">=" : "<=", r.target, r.reached() ? "reached" : "MISSED", r.note);
  }
  std::fflush(stdout);
}

}  // namespace imrig::bench
