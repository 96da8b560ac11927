#include "rig/dyno/register_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <filesystem>
#include <set>
#include <utility>

#include "rig/base/config_reader.h"
#include "rig/base/error.h"
#include "rig/base/file.h"

namespace imrig {

namespace {

// What a register of each role holds: its unit ("" for a plain number) and whether somebody must be able to
// write it.
struct RoleText {
  Role role;
  const char* key;
  const char* unit;
  bool written;
};

constexpr std::array kRoles = {
    RoleText{Role::kIdentity, "identity", "", false},
    RoleText{Role::kSetV, "set_V", "V", true},
    RoleText{Role::kSetA, "set_A", "A", true},
    RoleText{Role::kOutV, "out_V", "V", false},
    RoleText{Role::kOutA, "out_A", "A", false},
    RoleText{Role::kOutput, "output", "", true},
    RoleText{Role::kProtection, "protection", "", false},
    RoleText{Role::kConstantCurrent, "constant_current", "", false},
    RoleText{Role::kWatchdogEnable, "watchdog_enable", "", true},
    RoleText{Role::kWatchdogSeconds, "watchdog_seconds", "s", true},
};

constexpr std::array kOrders = {
    std::pair{"ABCD", WordOrder::kABCD},
    std::pair{"CDAB", WordOrder::kCDAB},
    std::pair{"BADC", WordOrder::kBADC},
    std::pair{"DCBA", WordOrder::kDCBA},
};

constexpr std::array kKinds = {
    std::pair{"u16", RegisterKind::kU16}, std::pair{"s16", RegisterKind::kS16},
    std::pair{"u32", RegisterKind::kU32}, std::pair{"s32", RegisterKind::kS32},
    std::pair{"f32", RegisterKind::kF32},
};

template <class Table>
std::vector<std::string> words_in(const Table& table) {
  std::vector<std::string> words;
  for (const auto& [word, value] : table) words.emplace_back(word);
  return words;
}

template <class Table>
auto chosen(const Table& table, const std::string& word) {
  return std::ranges::find_if(table, [&](const auto& entry) { return word == entry.first; })->second;
}

// Either a plain scale, or the counts that stand for the supply's rated voltage or current.
double scale_of(const ConfigReader& file, const ConfigReader& table, const std::string& unit) {
  if (!table.has("counts_at_rated")) return table.number_or("scale", 1.0, {1e-9, 1e9});
  if (unit != "V" && unit != "A") table.fail("counts_at_rated", "belongs to a register in V or A");
  return file.number("rated_" + unit, {1e-3, 1e6}) / table.number("counts_at_rated", {1.0, 65535.0});
}

Register read_register(const ConfigReader& file, const ConfigReader& table, const RoleText& role) {
  Register r;
  r.kind = chosen(kKinds, table.choice_or("kind", words_in(kKinds), "u16"));
  r.order = chosen(kOrders, table.choice_or("word_order", words_in(kOrders), "ABCD"));
  r.address = static_cast<int>(table.integer("address", {0, 65536.0 - r.words()}));
  r.unit = table.choice_or("unit", {role.unit}, role.unit);
  r.scale = scale_of(file, table, r.unit);
  r.read_only = table.boolean_or("read_only", !role.written);
  if (role.written && r.read_only) table.fail("read_only", fmt::format("{} is written", role.key));
  return r;
}

void refuse_overlap(const RegisterMap& map, const ConfigReader& file) {
  std::set<int> taken;
  for (const auto& [role, r] : map.registers) {
    for (int i = 0; i < r.words(); ++i) {
      if (!taken.insert(r.address + i).second)
        file.fail("registers", fmt::format("two use address {}", r.address + i));
    }
  }
}

void refuse_half_a_supply(const RegisterMap& map, const ConfigReader& file) {
  const bool set = map.find(Role::kSetV) != nullptr || map.find(Role::kSetA) != nullptr;
  const bool output = map.find(Role::kOutput) != nullptr;
  if (set != output)
    file.fail("registers", "set-points and output go together", "set_V or set_A, and output");
  const bool enable = map.find(Role::kWatchdogEnable) != nullptr;
  if (enable != (map.watchdog_s > 0.0)) file.fail("registers", "watchdog_enable and watchdog_s go together");
  if ((map.find(Role::kIdentity) != nullptr) == map.identities.empty()) {
    file.fail("registers", "identity and identities go together");
  }
}

std::string found_file(const std::string& name) {
  if (name.find('/') != std::string::npos || name.ends_with(".toml")) return name;
  const std::string file = "registers/" + name + ".toml";
  const std::string installed = executable_folder() + "/../share/imrig/models/" + file;
  return std::filesystem::exists(installed) ? installed : IMRIG_MODELS_DIR "/" + file;
}

double clamped_raw(double raw, double low, double high) {
  return std::isnan(raw) ? low : std::clamp(raw, low, high);
}

}  // namespace

int Register::words() const { return kind == RegisterKind::kU16 || kind == RegisterKind::kS16 ? 1 : 2; }

std::vector<std::uint16_t> Register::encode(double value) const {
  const double raw = std::round(value / scale);
  const auto pair = [this](std::uint32_t bits) {
    const WordPair words = words_of(bits, order);
    return std::vector<std::uint16_t>(words.begin(), words.end());
  };
  switch (kind) {
    case RegisterKind::kU16:
      return {static_cast<std::uint16_t>(clamped_raw(raw, 0.0, 65535.0))};
    case RegisterKind::kS16:
      return {static_cast<std::uint16_t>(static_cast<std::int16_t>(clamped_raw(raw, -32768.0, 32767.0)))};
    case RegisterKind::kU32:
      return pair(static_cast<std::uint32_t>(clamped_raw(raw, 0.0, 4294967295.0)));
    case RegisterKind::kS32:
      return pair(static_cast<std::uint32_t>(
          static_cast<std::int32_t>(clamped_raw(raw, -2147483648.0, 2147483647.0))));
    case RegisterKind::kF32:
      break;
  }
  return pair(std::bit_cast<std::uint32_t>(static_cast<float>(value / scale)));
}

double Register::decode(const std::uint16_t* at) const {
  const std::uint32_t bits = words() == 1 ? at[0] : value_of({at[0], at[1]}, order);
  switch (kind) {
    case RegisterKind::kU16:
    case RegisterKind::kU32:
      return scale * bits;
    case RegisterKind::kS16:
      return scale * static_cast<std::int16_t>(bits);
    case RegisterKind::kS32:
      return scale * static_cast<std::int32_t>(bits);
    case RegisterKind::kF32:
      break;
  }
  return scale * static_cast<double>(std::bit_cast<float>(bits));
}

double Register::resolution(double value) const {
  return kind == RegisterKind::kF32 ? std::abs(value) * 0x1p-23 : scale;
}

const Register* RegisterMap::find(Role role) const {
  const auto found = registers.find(role);
  return found == registers.end() ? nullptr : &found->second;
}

RegisterMap parse_register_map(const std::string& text, const std::string& where) {
  const ConfigReader file = ConfigReader::from_text(text, where);
  file.integer("version", {1, 1});
  RegisterMap map;
  map.name = file.text("name");
  file.ignore("source");
  map.watchdog_s = file.number_or("watchdog_s", 0.0, {1.0, 3600.0});
  if (file.has("identities")) {
    for (const double raw : file.numbers("identities", 1, 64, {0.0, 4294967295.0})) {
      map.identities.push_back(static_cast<long long>(raw));
    }
  }
  const ConfigReader tables = file.table("registers");
  for (const RoleText& role : kRoles) {
    if (const auto table = tables.table_if(role.key))
      map.registers[role.role] = read_register(file, *table, role);
  }
  file.finish();
  refuse_overlap(map, file);
  refuse_half_a_supply(map, file);
  return map;
}

RegisterMap load_register_map(const std::string& name) {
  const std::string path = found_file(name);
  if (!std::filesystem::is_regular_file(path)) {
    throw Error("register map", fmt::format("there is no '{}'", name),
                fmt::format("a path, or the name of a file in {}", IMRIG_MODELS_DIR "/registers"));
  }
  return parse_register_map(read_text(path, 1u << 16), path);
}

}  // namespace imrig
