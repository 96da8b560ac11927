// info, import, export, identify, compare and model show as a user runs them, on real files.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "rig/data/folder.h"
#include "tests/rig/cli/data_verbs/process.h"
#include "tests/rig/data/scratch.h"

namespace imrig {
namespace {

using nlohmann::json;
using test::Finished;
using test::Scratch;

const std::string kTable = std::string(IMRIG_SOURCE_DIR) + "/tests/data/motor_18k5";

class DataVerbs : public ::testing::Test {
 protected:
  Finished run(const std::vector<std::string>& arguments) const {
    return test::run(scratch.path(), arguments);
  }
  json ask(const std::vector<std::string>& arguments) const {
    const Finished done = run(arguments);
    EXPECT_EQ(done.exit_code, 0) << done.err;
    return json::parse(done.out, nullptr, false);
  }
  // One sentence on stderr, exit 2, nothing on stdout.
  std::string refusal(const std::vector<std::string>& arguments) const {
    const Finished done = run(arguments);
    EXPECT_EQ(done.exit_code, 2) << done.out << done.err;
    EXPECT_EQ(done.out, "");
    EXPECT_EQ(std::count(done.err.begin(), done.err.end(), '\n'), 1) << done.err;
    EXPECT_TRUE(done.err.starts_with("imrig: ")) << done.err;
    return done.err;
  }
  void expect_nothing_written(const std::vector<std::string>& known) const {
    for (const auto& entry : std::filesystem::directory_iterator(scratch.path())) {
      const std::string name = entry.path().filename().string();
      EXPECT_TRUE(name.starts_with(".std") || std::find(known.begin(), known.end(), name) != known.end())
          << name;
    }
  }
  Scratch scratch;
};

TEST_F(DataVerbs, InfoTellsConditionsOfTheMeasuredTable) {
  const json out = ask({"info", kTable, "--json"});
  EXPECT_EQ(out["pole_pairs"], 2);
  EXPECT_EQ(out["connection"], "delta");
  EXPECT_EQ(out["records"][0]["points"], 14);
  EXPECT_NEAR(out["records"][0]["conditions"]["f_Hz"].get<double>(), 50.0, 1e-9);
  const Finished text = run({"info", kTable});
  EXPECT_EQ(text.exit_code, 0);
  EXPECT_NE(text.out.find("load_curve"), std::string::npos);
}

TEST_F(DataVerbs, TheMeasuredTableIsIdentifiedAndComparedPointByPoint) {
  const std::string model = scratch.path("m.toml");
  const json identified = ask({"identify", kTable, "--out", model, "--json"});
  for (const char* name : {"R_s", "R_r", "L_l", "L_m"})
    EXPECT_GT(identified["model"][name]["value"].get<double>(), 0.0) << name;
  const json compared = ask({"compare", model, kTable, "--json"});
  const json& points = compared["records"][0]["points"];
  ASSERT_EQ(points.size(), 14u);
  for (std::size_t k = 1; k < points.size(); ++k) {
    const json& channels = points[k]["channels"];
    const double i = channels["current_A"]["measured"], p = channels["input_power_W"]["measured"];
    EXPECT_NEAR(channels["current_A"]["predicted"].get<double>(), i, 0.03 * i) << "point " << k;
    EXPECT_NEAR(channels["input_power_W"]["predicted"].get<double>(), p, 0.06 * p) << "point " << k;
  }
  // The source's own current at rated load is 32.85 A.
  EXPECT_EQ(points[10]["channels"]["current_A"]["measured"].get<double>(), 32.85);
  EXPECT_LT(compared["fitted"]["nrmse"].get<double>(), 0.02);
  EXPECT_TRUE(compared["holdout"]["nrmse"].is_null());
}

// At synchronous speed the model's shaft power is zero but for the rounding of powers of many kilowatts.
TEST_F(DataVerbs, RoundingDustIsPrintedAsZero) {
  const std::string model = scratch.path("m.toml"), report = scratch.path("report");
  ASSERT_EQ(run({"identify", kTable, "--out", model}).exit_code, 0);
  const Finished text = run({"compare", model, kTable, "--report", report});
  ASSERT_EQ(text.exit_code, 0) << text.err;
  const auto row = text.out.find("\n  50       1500  ");
  ASSERT_NE(row, std::string::npos) << text.out;
  const std::string line = text.out.substr(row + 1, text.out.find('\n', row + 1) - row - 1);
  EXPECT_TRUE(line.ends_with("  0       0      -")) << line;
  std::ifstream page(report + "/report.html");
  const std::string html((std::istreambuf_iterator<char>(page)), std::istreambuf_iterator<char>());
  EXPECT_NE(html.find("load_curve"), std::string::npos);
  EXPECT_EQ(text.out.find("e-1"), std::string::npos) << text.out;
  const auto table = html.substr(html.find("P out W"));
  EXPECT_EQ(table.substr(0, table.find("</table>")).find("e-1"), std::string::npos);
}

TEST_F(DataVerbs, ImportedLogAndExportedFolderHoldTheSameData) {
  const std::string log = scratch.path("t.lcm"), back = scratch.path("back");
  EXPECT_EQ(run({"import", kTable, "--out", log}).exit_code, 0);
  EXPECT_EQ(run({"export", log, "--out", back}).exit_code, 0);
  const auto hash = ask({"info", kTable, "--json"})["hash"];
  EXPECT_EQ(ask({"info", log, "--json"})["hash"], hash);
  EXPECT_EQ(ask({"info", back, "--json"})["hash"], hash);
  EXPECT_EQ(read_folder(back).records[0].points.size(), 14u);
}

TEST_F(DataVerbs, SeveralSetsAreTakenTogether) {
  const json out = ask({"info", kTable, kTable, "--json"});
  EXPECT_EQ(out["records"].size(), 2u);
  EXPECT_NE(out["records"][0]["id"], out["records"][1]["id"]);
}

TEST_F(DataVerbs, BadInputIsOneSentenceAndNothingIsWritten) {
  scratch.write("garbage.lcm", std::string(5000, 'x'));
  scratch.write("m.toml", "version = 1\nname = 3\n");
  scratch.write("table.csv", "a,b\n1,2\n");
  std::filesystem::create_directory(scratch.path("bad"));
  scratch.write("bad/dataset.toml", test::manifest(test::kOneRecord));
  scratch.write("bad/r1.csv", "t_s,v_a_V\n0,zero\n");
  const std::vector<std::string> known = {"garbage.lcm", "m.toml", "table.csv", "bad"};
  const std::string none = scratch.path("none"), out = scratch.path("out");
  EXPECT_NE(refusal({"info", none}).find("none: is not there"), std::string::npos);
  EXPECT_NE(refusal({"info", scratch.path("table.csv")}).find("is a bare table"), std::string::npos);
  refusal({"info", scratch.path("garbage.lcm")});
  EXPECT_NE(refusal({"info", scratch.path("bad")}).find("r1.csv:2: column \"v_a_V\" holds \"zero\""),
            std::string::npos);
  refusal({"import", scratch.path("bad"), "--out", out});
  refusal({"import", kTable, "--out", none + "/deeper/x.lcm"});
  refusal({"export", scratch.path("bad"), "--out", out});
  refusal({"export", kTable, "--out", scratch.path("bad")});
  refusal({"identify", scratch.path("bad"), "--out", out});
  refusal({"identify", kTable, "--out", out, "--method", "magic"});
  refusal({"identify", kTable, "--out", out, "--method", "dc"});
  refusal({"compare", scratch.path("m.toml"), kTable, "--report", out});
  refusal({"compare", none, kTable});
  refusal({"model", "show", scratch.path("m.toml")});
  refusal({"model", "show"});
  refusal({"info"});
  refusal({"identify", kTable});
  expect_nothing_written(known);
}

TEST_F(DataVerbs, AReportIsOneFileThatEscapesWhatComesFromData) {
  std::filesystem::create_directory(scratch.path("evil"));
  const std::string name = "<script>alert(1)</script>";
  scratch.write("evil/dataset.toml", "name = \"" + name +
                                         "\"\npole_pairs = 2\nconnection = \"star\"\nquantities = "
                                         "\"phase\"\n[[record]]\nid = \"</script><b>x\"\nkind = "
                                         "\"steady\"\nfile = \"r1.csv\"\n");
  scratch.write("evil/r1.csv", test::Bench().csv());
  const std::string model = scratch.path("m.toml");
  ASSERT_EQ(run({"identify", kTable, "--out", model}).exit_code, 0);
  const Finished done = run({"compare", model, scratch.path("evil"), "--report", scratch.path("a/b")});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const std::string html = test::text_of(scratch.path("a/b/report.html"));
  EXPECT_EQ(html.find(name), std::string::npos);
  EXPECT_EQ(html.find("<b>x"), std::string::npos);
  EXPECT_NE(html.find("&lt;script&gt;alert(1)"), std::string::npos);
  EXPECT_NE(html.find("Chart.js v3"), std::string::npos);
  for (const char* outside : {"src=\"http", "href=\"http", "<link", "@import"})
    EXPECT_EQ(html.find(outside), std::string::npos) << outside;
}

TEST_F(DataVerbs, ModelShowPutsTruthBesideWhatWasIdentified) {
  const std::string model = scratch.path("m.toml");
  ASSERT_EQ(run({"identify", kTable, "--out", model}).exit_code, 0);
  const double R_r = ask({"model", "show", model, "--json"})["model"]["R_r"]["value"];
  scratch.write("truth.json", "{\"parameters\":{\"R_r\":{\"value\":" + std::to_string(2.0 * R_r) +
                                  ",\"unit\":\"ohm\"},\"J\":{\"value\":1,\"unit\":\"kgm2\"}}}");
  const json beside = ask({"model", "show", model, "--json", "--truth", scratch.path("truth.json")});
  EXPECT_NEAR(beside["truth"]["R_r"]["error_percent"].get<double>(), -50.0, 0.01);
  EXPECT_FALSE(beside["truth"]["R_r"]["in_interval"].get<bool>());
  EXPECT_NE(
      run({"model", "show", model, "--truth", scratch.path("truth.json")}).out.find("outside the interval"),
      std::string::npos);
  for (const char* bad : {"[]", "{", "{\"parameters\":{\"R_r\":1}}", "{\"parameters\":{}}",
                          "{\"parameters\":{\"R_r\":{\"value\":1,\"unit\":\"mohm\"}}}"}) {
    scratch.write("bad.json", bad);
    EXPECT_NE(refusal({"model", "show", model, "--truth", scratch.path("bad.json")}).find("bad.json"),
              std::string::npos)
        << bad;
  }
}

// A file that knows the pole pairs and R_s alone: compare says what to do, diagnose and improve do it.
TEST_F(DataVerbs, AModelThatLacksParametersIsFilledFromTheDataOrToldHow) {
  scratch.write("m.toml",
                "version = 1\npole_pairs = 2\nconnection = \"delta\"\ncircuit = \"inverse-gamma\"\n[parameters.R_s]\nvalue = "
                "0.25\nunit = \"ohm\"\n");
  const std::string model = scratch.path("m.toml"), better = scratch.path("better.toml");
  const std::string why = refusal({"compare", model, kTable});
  EXPECT_NE(why.find("does not know R_r; imrig identify"), std::string::npos) << why;
  const Finished told = run({"diagnose", model, kTable, "--json"});
  EXPECT_EQ(told.err, "");
  const json diagnosis = json::parse(told.out, nullptr, false);
  EXPECT_NE(diagnosis["explanation"][0].get<std::string>().find("R_r, L_l and L_m"), std::string::npos) << told.out;
  const Finished done = run({"improve", model, kTable, "--out", better});
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(run({"compare", better, kTable}).exit_code, 0);
}

TEST_F(DataVerbs, HelpIsThereForEachVerb) {
  for (const char* verb : {"info", "import", "export", "identify", "compare", "model"}) {
    const Finished done = run({verb, "--help"});
    EXPECT_EQ(done.exit_code, 0) << verb;
    EXPECT_NE(done.out.find("--help"), std::string::npos) << verb;
  }
}

}  // namespace
}  // namespace imrig
