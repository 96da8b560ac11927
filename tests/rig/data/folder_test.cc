#include "rig/data/folder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>

#include "rig/data/manifest.h"
#include "tests/rig/data/scratch.h"

namespace imrig {
namespace {

using test::Bench;
using test::complaint;
using test::has;
using test::kOneRecord;
using test::manifest;
using test::Scratch;

DataSet read(const std::string& toml, const std::string& csv) {
  Scratch folder;
  folder.write("dataset.toml", toml);
  folder.write("r1.csv", csv);
  return read_folder(folder.path());
}

std::string trouble(const std::string& toml, const std::string& csv = Bench().csv()) {
  return complaint([&] { read(toml, csv); });
}

TEST(Folder, ASoundRecordIsReadWithoutAWord) {
  const DataSet data = read(manifest(kOneRecord), Bench().csv());
  ASSERT_EQ(data.records.size(), 1u);
  const Record& record = data.records[0];
  EXPECT_EQ(record.series.size(), 2000u);
  EXPECT_NEAR(record.series.sample_time_s, 1e-4, 1e-12);
  EXPECT_NEAR(std::abs(record.series.v[17]), 325.0, 1e-9);
  EXPECT_NEAR(record.series.speed_rad_s[3], 2.0 * kPi * 1455.0 / 60.0, 1e-12);
  EXPECT_TRUE(record.warnings.empty()) << record.warnings.front();
  EXPECT_TRUE(data.notes.empty());
  EXPECT_NE(data.hash, 0u);
}

TEST(Folder, ColumnsMayBeRenamedScaledAndOffset) {
  Bench bench;
  bench.header = "Zeit,ch1,ch2,ch3,ch4,ch5,ch6,n";
  const std::string columns =
      "columns.t_s = { from = \"Zeit\", scale = 1e-3 }\ncolumns.v_a_V = { from = \"ch1\", scale = 200 "
      "}\ncolumns.v_b_V = { from = \"ch2\", scale "
      "= 200 }\ncolumns.v_c_V = { from = \"ch3\", scale = 200 }\ncolumns.i_a_A = { from = \"ch4\" "
      "}\ncolumns.i_b_A = { from = \"ch5\", offset = "
      "-0.5 }\ncolumns.i_c_A = { from = \"ch6\" }\ncolumns.speed_rpm = { from = \"n\", scale = 60 }\n";
  const std::string csv = bench.csv([](int, std::vector<double>& x) {
    x[0] *= 1e3;
    for (std::size_t k = 1; k < 4; ++k) x[k] /= 200.0;
    x[5] += 0.5;
    x[7] /= 60.0;
    return true;
  });
  const DataSet data = read(manifest(std::string(kOneRecord) + columns), csv);
  const DataSet plain = read(manifest(kOneRecord), Bench().csv());
  for (std::size_t k = 0; k < 2000; ++k) {
    EXPECT_NEAR(std::abs(data.records[0].series.v[k] - plain.records[0].series.v[k]), 0.0, 1e-9);
    EXPECT_NEAR(std::abs(data.records[0].series.i[k] - plain.records[0].series.i[k]), 0.0, 1e-9);
  }
  EXPECT_NEAR(data.records[0].series.speed_rad_s[0], plain.records[0].series.speed_rad_s[0], 1e-9);
}

TEST(Folder, TheThirdCurrentFollowsFromTwo) {
  Bench bench;
  bench.header = "t_s,v_a_V,v_b_V,v_c_V,i_a_A,i_b_A,spare,speed_rpm";
  const DataSet data = read(manifest("noise = { current_A = 0.1 }\n" + std::string(kOneRecord)), bench.csv());
  EXPECT_NEAR(std::abs(data.records[0].series.i[5]), 10.0, 1e-9);
  EXPECT_NEAR(data.noise.current_A, 0.1 * std::sqrt(4.0 / 3.0), 1e-12);
  EXPECT_TRUE(has(data.records[0].warnings, "columns not used: spare"));
  Bench one_voltage_short;
  one_voltage_short.header = "t_s,v_a_V,spare,v_c_V,i_a_A,i_b_A,i_c_A,speed_rpm";
  EXPECT_NE(trouble(manifest(kOneRecord), one_voltage_short.csv()).find("\"v_b_V\" is missing"),
            std::string::npos)
      << "phase voltages need not sum to zero";
}

TEST(Folder, EveryMistakeInTheManifestIsOneSentenceWithLineAndKey) {
  const std::string head = "name = \"test\"\npole_pairs = 2\nconnection = \"star\"\nquantities = \"phase\"\n";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"name = ", "dataset.toml:1: is no TOML"},
      {"name = \"x\"\n", "pole_pairs is missing"},
      {"name = 5\npole_pairs = 2\nconnection = \"star\"\nquantities = \"phase\"\n",
       "dataset.toml:1: name is a number"},
      {"name = \"x\"\npole_pairs = 0\n", "dataset.toml:2: pole_pairs is 0"},
      {"name = \"x\"\npole_pairs = 2.5\n", "it must be a whole number"},
      {"name = \"x\"\npole_pairs = 2\nconnection = \"triangle\"\n",
       "connection is \"triangle\"; it must be one of \"star\", \"delta\""},
      {head, "record is missing"},
      {head + "colour = 1\n" + kOneRecord, "dataset.toml:5: colour is not known here"},
      {head + kOneRecord + "speed = 3\n", "record[0].speed is not known here"},
      {head + "noise = { current_A = -1 }\n" + kOneRecord, "noise.current_A is -1"},
      {head + "noise = { current = 1 }\n" + kOneRecord, "noise.current is not known here"},
      {head + "[[record]]\nid = \"a\"\nkind = \"run\"\nfile = \"r1.csv\"\n", "record[0].kind is \"run\""},
      {head + "[[record]]\nid = \"\"\nkind = \"dc\"\nfile = \"r1.csv\"\n", "record[0].id is empty"},
      {head + kOneRecord + kOneRecord, "id \"r1\" is there twice"},
      {head + kOneRecord + "repeat_of = \"r2\"\n", "repeat_of is \"r2\""},
      {head + "[[record]]\nid = \"a\"\nkind = \"dc\"\nfile = \"../r1.csv\"\n",
       "leaves the data set's folder"},
      {head + "[[record]]\nid = \"a\"\nkind = \"dc\"\nfile = \"/etc/passwd\"\n",
       "leaves the data set's folder"},
      {head + "[[record]]\nid = \"a\"\nkind = \"dc\"\nfile = \"r1.xls\"\n", "its name must end in"},
      {head + "[[record]]\nid = \"a\"\nkind = \"steady\"\nfile = \"none.csv\"\n", "none.csv: cannot be read"},
      {head + kOneRecord + "columns.i_x_A = { from = \"x\" }\n", "i_x_A is no column that imrig knows"},
      {head + kOneRecord + "columns.i_a_A = { from = \"nix\" }\n", "columns.i_a_A is taken from \"nix\""},
      {head + kOneRecord + "columns.i_a_A = { scale = 0 }\n", "scale is 0"},
      {head + kOneRecord + "columns.i_a_A = { gain = 1 }\n", "gain is not known here"},
      {head + kOneRecord + "sample_time_s = 1e-3\n",
       "sample_time_s is 0.001 s, but t_s advances by 0.0001 s"},
  };
  for (const auto& [toml, part] : cases) {
    const std::string said = trouble(toml);
    EXPECT_NE(said.find(part), std::string::npos) << "said: " << said << "\nwanted: " << part;
    EXPECT_EQ(said.find('\n'), std::string::npos);
  }
}

TEST(Folder, MissingColumnsAreNamedWithWhatTheFileHas) {
  Bench bench;
  bench.header = "t_s,v_a_V,v_b_V,v_c_V,i_a_A,i_b_A,i_c_A,n";
  EXPECT_NE(trouble(manifest(kOneRecord), bench.csv())
                .find("r1.csv: column \"speed_rpm\" is missing; it has t_s, v_a_V, v_b_V, v_c_V, i_a_A, "
                      "i_b_A, i_c_A, n; rename in dataset.toml "
                      "with columns.speed_rpm"),
            std::string::npos);
  bench.header = "zeit,v_a_V,v_b_V,v_c_V,i_a_A,i_b_A,i_c_A,speed_rpm";
  EXPECT_NE(trouble(manifest(kOneRecord), bench.csv()).find("has neither sample_time_s nor a column t_s"),
            std::string::npos);
}

TEST(Folder, NoFolderAndNoManifestAreSaid) {
  Scratch folder;
  EXPECT_NE(complaint([&] { read_folder(folder.path("none")); }).find("is no folder"), std::string::npos);
  EXPECT_NE(complaint([&] { read_folder(folder.path()); }).find("dataset.toml: cannot be read"),
            std::string::npos);
}

TEST(Folder, StandingMotorsNeedNoSpeedColumn) {
  Bench bench;
  bench.header = "t_s,v_a_V,v_b_V,v_c_V,i_a_A,i_b_A,i_c_A,spare";
  const DataSet data =
      read(manifest("[[record]]\nid = \"a\"\nkind = \"locked_sweep\"\nfile = \"r1.csv\"\n"), bench.csv());
  EXPECT_EQ(data.records[0].series.speed_rad_s, std::vector<double>(2000, 0.0));
}

TEST(Folder, GapsAreSaidAndTheLongestStretchKept) {
  const std::string csv = Bench().csv([](int k, std::vector<double>&) { return k < 500 || k >= 600; });
  const DataSet data = read(manifest(kOneRecord), csv);
  EXPECT_EQ(data.records[0].series.size(), 1400u);
  EXPECT_TRUE(has(data.records[0].warnings, "1 gap in time"));
}

TEST(Folder, MissingCurrentsEndAStretchAndSlowSpeedIsJoined) {
  const std::string csv = Bench().csv([](int k, std::vector<double>& x) {
    if (k >= 1500 && k < 1504) x[4] = NAN;
    if (k % 10 != 0) x[7] = NAN;
    return true;
  });
  const DataSet data = read(manifest(kOneRecord), csv);
  EXPECT_EQ(data.records[0].series.size(), 1500u);
  EXPECT_TRUE(has(data.records[0].warnings, "joined by straight lines"));
  EXPECT_TRUE(has(data.records[0].warnings, "13 of 2000 rows miss"))
      << "the nine after the last speed and the four without current";
}

// Of 325 V at 50 Hz and 0.1 ms the cubic misses 1.5 (w h)^4, 0.5 mV; a straight line would miss 50 mV and
// more.
TEST(Folder, LostCellsAreFilledFromTheirNeighbours) {
  const std::string csv = Bench().csv([](int k, std::vector<double>& x) {
    if (k == 100 || k == 700 || k == 701 || k == 702) x[1] = NAN;
    if (k == 300) x[4] = NAN;
    return true;
  });
  const DataSet data = read(manifest(kOneRecord), csv);
  const DataSet whole = read(manifest(kOneRecord), Bench().csv());
  ASSERT_EQ(data.records[0].series.size(), 2000u);
  for (std::size_t k = 0; k < 2000; ++k) {
    EXPECT_NEAR(std::abs(data.records[0].series.v[k] - whole.records[0].series.v[k]), 0.0, 6e-4) << k;
    EXPECT_NEAR(std::abs(data.records[0].series.i[k] - whole.records[0].series.i[k]), 0.0, 6e-4) << k;
  }
  EXPECT_TRUE(has(data.records[0].warnings, "5 values of voltage or current are missing"));
}

TEST(Folder, LostCellsBesideAGapStayLostAndADerivedPhaseIsFilledLikeTheOthers) {
  const std::string gap = Bench().csv([](int k, std::vector<double>& x) {
    if (k == 1000) x[1] = NAN;
    return k < 990 || k >= 999;
  });
  EXPECT_EQ(read(manifest(kOneRecord), gap).records[0].series.size(), 999u)
      << "from the sample behind the lost one";
  Bench two;
  two.header = "t_s,v_a_V,v_b_V,v_c_V,i_a_A,i_b_A,speed_rpm";
  const std::string csv = two.csv([](int k, std::vector<double>& x) {
    if (k % 150 == 50) x[4] = NAN;
    if (k % 150 == 100) x[5] = NAN;
    x.erase(x.begin() + 6);
    return true;
  });
  EXPECT_EQ(read(manifest(kOneRecord), csv).records[0].series.size(), 2000u);
}

TEST(Folder, ALostTimeStampBesideALostCellIsRefused) {
  const std::string csv = Bench().csv([](int k, std::vector<double>& x) {
    if (k == 700) x[0] = NAN;
    if (k == 900) x[1] = NAN;
    return true;
  });
  EXPECT_NE(trouble(manifest(kOneRecord), csv).find("sample 701 has no time stamp"), std::string::npos);
}

TEST(Folder, AUnitOfTheFileThatContradictsTheNameIsRefusedWithTheScale) {
  std::string csv = Bench().csv();
  csv.insert(csv.find('\n') + 1, "ms,V,V,V,A,A,A,1/min\n");
  EXPECT_NE(trouble(manifest(kOneRecord), csv).find("columns.t_s = { from = \"t_s\", scale = 0.001 }"),
            std::string::npos);
  const std::string overruled = std::string(kOneRecord) + "columns.t_s = { from = \"t_s\", scale = 1 }\n";
  EXPECT_EQ(read(manifest(overruled), csv).records[0].series.size(), 2000u);
  csv = Bench().csv();
  csv.insert(csv.find('\n') + 1, "s,A,V,V,A,A,A,rpm\n");
  EXPECT_NE(trouble(manifest(kOneRecord), csv).find("\"v_a_V\" is in A by the row under the names"),
            std::string::npos);
  csv = Bench().csv();
  csv.insert(csv.find('\n') + 1, "[s],[V],[V],[V],[A],[A],[A],[rpm]\n");
  EXPECT_EQ(read(manifest(kOneRecord), csv).records[0].series.size(), 2000u);
}

TEST(Folder, TimesInMsAreDoubted) {
  const std::string csv = Bench().csv([](int, std::vector<double>& x) { return x[0] *= 1e3, true; });
  EXPECT_TRUE(has(read(manifest(kOneRecord), csv).records[0].warnings, "are the times in ms"));
}

TEST(Folder, ARecordThatCannotBeUsedIsLeftOutWithItsReason) {
  Scratch folder;
  folder.write("dataset.toml", manifest(std::string(kOneRecord) +
                                        "[[record]]\nid = \"short\"\nkind = \"free\"\nfile = \"s.csv\"\n"));
  folder.write("r1.csv", Bench().csv());
  folder.write("s.csv", Bench().csv([](int k, std::vector<double>&) { return k < 12; }));
  const DataSet data = read_folder(folder.path());
  EXPECT_EQ(data.records.size(), 1u);
  EXPECT_TRUE(has(data.notes, "record \"short\" left out: has 12 samples; at least 16 are needed"));
}

TEST(Folder, ASetWithoutAnyUsableRecordIsAnError) {
  EXPECT_NE(trouble(manifest(kOneRecord), Bench().csv([](int k, std::vector<double>&) {
              return k < 12;
            })).find("holds no record that can be used"),
            std::string::npos);
}

TEST(Folder, TheMeasured18kWTableBecomesStarPeakValues) {
  const DataSet data = read_folder(std::string(IMRIG_SOURCE_DIR) + "/tests/data/motor_18k5");
  ASSERT_EQ(data.records.size(), 1u);
  const Record& record = data.records[0];
  ASSERT_EQ(record.points.size(), 14u);
  EXPECT_TRUE(data.delta);
  EXPECT_EQ(data.pole_pairs, 2);
  const SteadyPoint& rated = record.points[10];
  EXPECT_NEAR(rated.v_peak_V, 400.0 * std::sqrt(2.0 / 3.0), 1e-9);
  EXPECT_NEAR(rated.i_peak_A, 32.85 * std::sqrt(2.0), 1e-9);
  EXPECT_NEAR(rated.p_in_W / (1.5 * rated.v_peak_V * rated.i_peak_A), 0.896, 1e-4)
      << "power and power factor agree in the star";
  EXPECT_NEAR(data.noise.current_A, 0.03 * std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(data.noise.speed_rad_s, 0.3 * 2.0 * kPi / 60.0, 1e-12);
  EXPECT_TRUE(record.warnings.empty()) << record.warnings.front();
}

TEST(Folder, TheDocumentedExampleIsAValidManifest) {
  std::ifstream file(std::string(IMRIG_SOURCE_DIR) + "/docs/data-sets.md");
  const std::string page((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const std::string fence = "```toml\n";
  const auto begin = page.find(fence, page.find("## A complete example"));
  ASSERT_NE(begin, std::string::npos);
  const auto text =
      page.substr(begin + fence.size(), page.find("```", begin + fence.size()) - begin - fence.size());
  const Manifest example = parse_manifest(text, "docs/data-sets.md", "folder");
  ASSERT_EQ(example.records.size(), 4u);
  EXPECT_TRUE(example.wiring.delta);
  EXPECT_EQ(example.wiring.quantities, Quantities::kLine);
  EXPECT_EQ(example.records[0].columns.at("v_a_V").scale, 200.0);
  EXPECT_EQ(example.records[1].columns.size(), example.records[0].columns.size());
  EXPECT_TRUE(example.records[3].holdout);
}

}  // namespace
}  // namespace imrig
