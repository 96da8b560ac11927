#include "estimators/model/export.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "estimators/model/magnetic_tables.h"
#include "rig/base/error.h"

namespace imrig::est {
namespace {

Model motor() {
  Model m;
  m.name = "5 hp \"bench\" */ 3";
  m.pole_pairs = 2;
  m.ratings = {220.0, 60.0, 14.0, 1750.0, 3730.0};
  m.R_s = {0.39, 0.387, 0.393, "ohm", ""};
  m.R_r = {0.22, 0.218, 0.222, "ohm", ""};
  m.L_l = {0.006, 0.00597, 0.00603, "H", ""};
  m.L_m = {0.068, kMissing, kMissing, "H", ""};
  return m;
}

Model saturated() {
  Model m = motor();
  ActiveEffect effect;
  effect.name = "magnetizing_saturation";
  for (const auto& [name, value] : std::map<std::string, double>{
           {"extra", 0.8}, {"exponent", 6.0}, {"place", 1.0}, {"bend", 0.0}, {"psi_ref_Wb", 0.5}})
    effect.parameters[name].value = value;
  m.effects.push_back(effect);
  return m;
}

double number_of(const ExportedModel& m, const std::string& name) {
  for (const auto& n : m.numbers)
    if (n.name == name) return n.value;
  ADD_FAILURE() << name << " is missing";
  return kMissing;
}

// A scratch folder that goes with the test.
class Folder {
 public:
  Folder() : path_(std::filesystem::temp_directory_path() / fmt::format("imrig_export_{}", ::getpid())) {
    std::filesystem::create_directories(path_);
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(path_ / name) << text;
    return (path_ / name).string();
  }
  std::string read(const std::string& name) const {
    std::stringstream text;
    text << std::ifstream(path_ / name).rdbuf();
    return text.str();
  }
  std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

TEST(Export, TheHeaderCompilesAsStrictC99AndHoldsTheModelsNumbers) {
  const ExportedModel model = exported(saturated());
  const Folder folder;
  folder.write("motor.h", exported_c(model));
  folder.write("use.c",
               "#include \"motor.h\"\n#include \"motor.h\"\n#include <stdio.h>\nint main(void) {\n"
               "  printf(\"%d %.17g %.17g %.17g %.17g %d %.17g\\n\", MOTOR_POLE_PAIRS, MOTOR_R_S_OHM, "
               "MOTOR_L_L_H, MOTOR_T_L_M_H,\n"
               "         MOTOR_ROTOR_TIME_CONSTANT_S, MOTOR_MAGNETIZING_ROWS,\n"
               "         motor_magnetizing_L_m_H[MOTOR_MAGNETIZING_ROWS - 1]);\n  return 0;\n}\n");
  folder.write("alone.c",
               "#include \"motor.h\"\nint unused_tables_are_no_warning(void);\nint "
               "unused_tables_are_no_warning(void) { return 0; }\n");
  const std::string compile =
      fmt::format("'{}' -std=c99 -pedantic -Wall -Wextra -Werror -I'{}' ", IMRIG_C_COMPILER, folder.path());
  ASSERT_EQ(std::system((compile + fmt::format("-c '{0}/alone.c' -o '{0}/alone.o'", folder.path())).c_str()),
            0);
  ASSERT_EQ(
      std::system((compile + fmt::format("'{0}/use.c' -o '{0}/use' && '{0}/use' > '{0}/said'", folder.path()))
                      .c_str()),
      0);
  std::stringstream said(folder.read("said"));
  int pole_pairs = 0, rows = 0;
  double R_s = 0, L_l = 0, L_m = 0, tau = 0, last = 0;
  said >> pole_pairs >> R_s >> L_l >> L_m >> tau >> rows >> last;
  EXPECT_EQ(pole_pairs, 2);
  EXPECT_EQ(R_s, 0.39);
  EXPECT_EQ(L_l, 0.006);
  EXPECT_EQ(L_m, number_of(model, "T_L_m_H"));
  EXPECT_EQ(tau, 0.068 / 0.22);
  EXPECT_EQ(rows, static_cast<int>(model.tables[0].rows.size()));
  EXPECT_EQ(last, model.tables[0].rows.back()[2]);
}

TEST(Export, JsonHoldsEveryNumberAndTableAndSaysNullWhereNothingIsKnown) {
  const ExportedModel model = exported(motor());
  const auto json = nlohmann::json::parse(exported_json(model));
  EXPECT_EQ(json["pole_pairs"], 2);
  for (const auto& n : model.numbers)
    EXPECT_EQ(json["numbers"][n.name]["value"].get<double>(), n.value) << n.name;
  EXPECT_TRUE(json["numbers"]["L_m_H"]["ci95"][0].is_null());
  EXPECT_EQ(json["numbers"]["R_s_ohm"]["ci95"][1].get<double>(), 0.393);
  for (const auto& t : model.tables) {
    for (std::size_t c = 0; c < t.columns.size(); ++c)
      EXPECT_EQ(json["tables"][t.name]["columns"][t.columns[c]][3].get<double>(), t.rows[3][c]);
  }
}

TEST(Export, CsvRowsHaveAsManyCellsAsTheirHeader) {
  std::stringstream text(exported_csv(exported(saturated())));
  std::string line;
  std::size_t columns = 0, tables = 0, rows = 0;
  for (bool header = true; std::getline(text, line); ++rows) {
    if (line.empty()) {
      header = true;
      continue;
    }
    std::size_t cells = 1;
    bool inside = false;
    for (const char c : line) {
      if (c == '"') inside = !inside;
      if (c == ',' && !inside) ++cells;
    }
    if (header) {
      columns = cells;
      ++tables;
      header = false;
    }
    EXPECT_EQ(cells, columns) << line;
  }
  EXPECT_EQ(tables, 3u);
  EXPECT_GT(rows, 60u);
}

TEST(Export, TheRatedPointIsThePhasorCircuits) {
  const ExportedModel m = exported(motor());
  // Z at rated slip by hand: inverse gamma, 220 V, 60 Hz, 1750 of 1800 rpm.
  const double w = 2.0 * M_PI * 60.0, s = 50.0 / 1800.0, v = 220.0 * std::sqrt(2.0 / 3.0);
  const std::complex<double> jX(0.0, w * 0.068), rotor = 0.22 / s;
  const std::complex<double> i =
      v / (0.39 + std::complex<double>(0.0, w * 0.006) + jX * rotor / (jX + rotor));
  const std::complex<double> i_r = i * jX / (jX + rotor), psi = i_r * rotor / std::complex<double>(0.0, w);
  EXPECT_NEAR(number_of(m, "rated_psi_r_Wb"), std::abs(psi), 1e-9);
  EXPECT_NEAR(number_of(m, "rated_i_d_A"), std::abs(psi) / 0.068, 1e-6);
  EXPECT_NEAR(number_of(m, "rated_i_q_A"), std::abs(i_r), 1e-9);
  EXPECT_NEAR(number_of(m, "rated_torque_Nm"),
              number_of(m, "torque_per_psi_r_i_q") * std::abs(psi) * std::abs(i_r), 1e-9);
}

TEST(Export, WithoutEffectsTheTablesAreTheBaseParameters) {
  for (const auto& row : magnetizing_table(motor(), 0.6, 10)) {
    EXPECT_NEAR(row.L_m_H, 0.068, 1e-9);
    EXPECT_NEAR(row.L_m_incremental_H, 0.068, 1e-6);
    EXPECT_NEAR(row.i_d_A, row.psi_r_Wb / 0.068, 1e-7);
  }
  for (const auto& row : leakage_table(motor(), 0.45, 30.0, 10)) EXPECT_NEAR(row.L_l_H, 0.006, 1e-9);
}

// i_d = psi (1 + extra (psi/psi_ref)^n)/L_m by hand, saturation at the rotor flux.
TEST(Export, TheMagnetizingTableFollowsTheSaturationLaw) {
  for (const auto& row : magnetizing_table(saturated(), 0.6, 12)) {
    const double share = 0.8 * std::pow(row.psi_r_Wb / 0.5, 6);
    EXPECT_NEAR(row.i_d_A, row.psi_r_Wb * (1.0 + share) / 0.068, 1e-6);
    EXPECT_NEAR(row.L_m_incremental_H, 0.068 / (1.0 + 7.0 * share), 1e-6);
  }
}

TEST(Export, TheLeakageTableFollowsLeakageThatSaturatesSteeply) {
  Model m = motor();
  ActiveEffect effect;
  effect.name = "leakage_saturation";
  for (const auto& [name, value] :
       std::map<std::string, double>{{"extra", 8.0}, {"exponent", 5.0}, {"bend", 5.0}, {"psi_ref_Wb", 0.3},
                                     {"rotor_share", 0.5}})
    effect.parameters[name].value = value;
  m.effects.push_back(effect);
  const auto rows = leakage_table(m, 0.45, 60.0, 12);
  ASSERT_EQ(rows.size(), 12u);
  for (std::size_t k = 1; k < rows.size(); ++k) EXPECT_LE(rows[k].L_l_H, rows[k - 1].L_l_H * (1.0 + 1e-9)) << k;
  EXPECT_LT(rows.back().L_l_H, 0.5 * rows.front().L_l_H);
}

TEST(Export, AnIncompleteModelIsRefused) {
  Model m = motor();
  m.R_r = {};
  EXPECT_THROW(exported(m), Error);
}

}  // namespace
}  // namespace imrig::est
