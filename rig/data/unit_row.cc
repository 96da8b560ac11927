#include "rig/data/unit_row.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <limits>

namespace imrig {

namespace {

enum class Kind { kTime, kVoltage, kCurrent, kSpeed, kTorque, kPower, kFrequency, kTemperature, kNone };

struct Unit {
  std::string_view word;
  Kind kind;
  double in_si;  // kSpeed: rad/s
};

constexpr double kRpm = 0.10471975511965977;  // 2 pi / 60
constexpr double kTurn = 6.283185307179586;

constexpr std::array kUnits{
    Unit{"s", Kind::kTime, 1.0},
    Unit{"sec", Kind::kTime, 1.0},
    Unit{"seconds", Kind::kTime, 1.0},
    Unit{"ms", Kind::kTime, 1e-3},
    Unit{"us", Kind::kTime, 1e-6},
    Unit{"\xc2\xb5s", Kind::kTime, 1e-6},
    Unit{"\xce\xbcs", Kind::kTime, 1e-6},
    Unit{"ns", Kind::kTime, 1e-9},
    Unit{"V", Kind::kVoltage, 1.0},
    Unit{"Volt", Kind::kVoltage, 1.0},
    Unit{"mV", Kind::kVoltage, 1e-3},
    Unit{"kV", Kind::kVoltage, 1e3},
    Unit{"A", Kind::kCurrent, 1.0},
    Unit{"Amp", Kind::kCurrent, 1.0},
    Unit{"mA", Kind::kCurrent, 1e-3},
    Unit{"kA", Kind::kCurrent, 1e3},
    Unit{"rpm", Kind::kSpeed, kRpm},
    Unit{"RPM", Kind::kSpeed, kRpm},
    Unit{"1/min", Kind::kSpeed, kRpm},
    Unit{"min-1", Kind::kSpeed, kRpm},
    Unit{"min^-1", Kind::kSpeed, kRpm},
    Unit{"r/min", Kind::kSpeed, kRpm},
    Unit{"U/min", Kind::kSpeed, kRpm},
    Unit{"rad/s", Kind::kSpeed, 1.0},
    Unit{"1/s", Kind::kSpeed, kTurn},
    Unit{"rps", Kind::kSpeed, kTurn},
    Unit{"Nm", Kind::kTorque, 1.0},
    Unit{"N.m", Kind::kTorque, 1.0},
    Unit{"N*m", Kind::kTorque, 1.0},
    Unit{"N\xc2\xb7m", Kind::kTorque, 1.0},
    Unit{"mNm", Kind::kTorque, 1e-3},
    Unit{"kNm", Kind::kTorque, 1e3},
    Unit{"Ncm", Kind::kTorque, 1e-2},
    Unit{"W", Kind::kPower, 1.0},
    Unit{"kW", Kind::kPower, 1e3},
    Unit{"var", Kind::kPower, 1.0},
    Unit{"kvar", Kind::kPower, 1e3},
    Unit{"Hz", Kind::kFrequency, 1.0},
    Unit{"kHz", Kind::kFrequency, 1e3},
    Unit{"C", Kind::kTemperature, 1.0},
    Unit{"degC", Kind::kTemperature, 1.0},
    Unit{"\xc2\xb0"
         "C",
         Kind::kTemperature, 1.0},
    Unit{"-", Kind::kNone, 1.0},
};

struct Ending {
  std::string_view text;
  Kind kind;
  double in_si;
};

// The longest first: speed_rad_s is no time.
constexpr std::array kEndings{
    Ending{"_rad_s", Kind::kSpeed, 1.0}, Ending{"_rpm", Kind::kSpeed, kRpm},
    Ending{"_s", Kind::kTime, 1.0},      Ending{"_V", Kind::kVoltage, 1.0},
    Ending{"_A", Kind::kCurrent, 1.0},   Ending{"_Nm", Kind::kTorque, 1.0},
    Ending{"_W", Kind::kPower, 1.0},     Ending{"_Hz", Kind::kFrequency, 1.0},
    Ending{"_var", Kind::kPower, 1.0},
};

// "[ms]", "(ms)", " ms " are ms.
std::string_view bare(std::string_view word) {
  constexpr std::string_view kAround = " \t()[]";
  const std::size_t first = word.find_first_not_of(kAround);
  if (first == std::string_view::npos) return {};
  return word.substr(first, word.find_last_not_of(kAround) - first + 1);
}

const Unit* unit_of(std::string_view word) {
  word = bare(word);
  const auto found =
      std::find_if(kUnits.begin(), kUnits.end(), [&](const Unit& u) { return u.word == word; });
  return found == kUnits.end() ? nullptr : &*found;
}

bool starts_a_number(std::string_view cell) {
  cell = bare(cell);
  const std::size_t first = cell.find_first_not_of("+-.");
  return first != std::string_view::npos && std::isdigit(static_cast<unsigned char>(cell[first])) != 0 &&
         unit_of(cell) == nullptr;
}

}  // namespace

bool is_unit_row(const std::vector<std::string>& cells) {
  std::size_t known = 0, filled = 0;
  for (const std::string& cell : cells) {
    if (starts_a_number(cell)) return false;
    const Unit* unit = unit_of(cell);
    if (bare(cell).empty() || (unit != nullptr && unit->kind == Kind::kNone)) continue;
    ++filled;
    known += unit != nullptr ? 1u : 0u;
  }
  return known > 0 && 2 * known >= filled;
}

std::optional<double> unit_factor(std::string_view our_name, std::string_view told) {
  const Unit* unit = unit_of(told);
  const auto ending = std::find_if(kEndings.begin(), kEndings.end(),
                                   [&](const Ending& e) { return our_name.ends_with(e.text); });
  if (unit == nullptr || unit->kind == Kind::kNone || ending == kEndings.end()) return std::nullopt;
  if (unit->kind != ending->kind) return std::numeric_limits<double>::quiet_NaN();
  return unit->in_si / ending->in_si;
}

}  // namespace imrig
