#include "rig/data/csv.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/rig/data/scratch.h"

namespace imrig {
namespace {

using test::complaint;

ColumnTable parse(const std::string& text) { return parse_csv(text, "x.csv"); }

void expect_values(const ColumnTable& table, const std::vector<std::vector<double>>& columns) {
  ASSERT_EQ(table.columns.size(), columns.size());
  for (std::size_t c = 0; c < columns.size(); ++c) {
    ASSERT_EQ(table.columns[c].size(), columns[c].size()) << "column " << c;
    for (std::size_t k = 0; k < columns[c].size(); ++k) {
      if (std::isnan(columns[c][k])) {
        EXPECT_TRUE(std::isnan(table.columns[c][k]));
      } else {
        EXPECT_EQ(table.columns[c][k], columns[c][k]) << "column " << c << " row " << k;
      }
    }
  }
}

const double kNone = std::nan("");

TEST(Csv, CommaSemicolonAndTabAreTold) {
  for (const std::string sep : {",", ";", "\t"}) {
    const auto table = parse("a" + sep + "b\n1.5" + sep + "-2e3\n3" + sep + "4\n");
    EXPECT_EQ(table.names, (std::vector<std::string>{"a", "b"}));
    expect_values(table, {{1.5, 3.0}, {-2000.0, 4.0}});
  }
}

TEST(Csv, DecimalCommaIsReadWhereTheSeparatorIsNoComma) {
  expect_values(parse("a;b\n1,5;-2,25e1\n0,125;7\n"), {{1.5, 0.125}, {-22.5, 7.0}});
  expect_values(parse("a\tb\n1,5\t2\n"), {{1.5}, {2.0}});
  expect_values(parse("a\n1,5\n-3\n"), {{1.5, -3.0}});
}

TEST(Csv, QuotedNamesAndCellsMayHoldSeparators) {
  const auto table = parse("\"u, v\",\"say \"\"x\"\"\"\n\"1.5\",2\n");
  EXPECT_EQ(table.names, (std::vector<std::string>{"u, v", "say \"x\""}));
  expect_values(table, {{1.5}, {2.0}});
}

TEST(Csv, ByteOrderMarkCarriageReturnsCommentsBlankLinesAndMissingEndOfLineAreFine) {
  expect_values(parse("\xef\xbb\xbf# by hand\r\n\r\na,b\r\n1,2\r\n# middle\r\n  \r\n3,4"),
                {{1.0, 3.0}, {2.0, 4.0}});
}

TEST(Csv, EmptyCellsAndNanAreMissingValues) {
  expect_values(parse("a,b,c\n,2,\nNaN,NA,n/a\n1, ,3\n"),
                {{kNone, kNone, 1.0}, {2.0, kNone, kNone}, {kNone, kNone, 3.0}});
}

TEST(Csv, SpacesPlusSignsAndTrailingSeparatorsAreFine) {
  expect_values(parse("a , b,\n +1 ,\t2 ,\n3,4,\n"), {{1.0, 3.0}, {2.0, 4.0}});
  expect_values(parse("a,b\n1,2,\n"), {{1.0}, {2.0}});
}

TEST(Csv, ARowOfUnitsUnderTheNamesIsKeptApart) {
  const auto table = parse("Time,CH1,CH2,\n(ms),(V),\"[mA]\",\n\n1,2,3\n");
  EXPECT_EQ(table.units, (std::vector<std::string>{"(ms)", "(V)", "[mA]"}));
  expect_values(table, {{1.0}, {2.0}, {3.0}});
  EXPECT_EQ(table.lines, (std::vector<std::uint32_t>{4}));
  EXPECT_EQ(parse("a;n\ns;1/min\n1;2\n").units.size(), 2u);
  EXPECT_TRUE(parse("a,b\n1,2\n").units.empty());
  EXPECT_NE(complaint([] { parse("a,b\nfast,slow\n1,2\n"); }), "") << "words that are no units";
  EXPECT_NE(complaint([] { parse("a,b\ns,5A\n1,2\n"); }), "") << "a broken number";
  EXPECT_NE(complaint([] { parse("a,b\n1,2\ns,V\n"); }), "") << "only right under the names";
}

TEST(Csv, LinesAreCountedAsAnEditorShowsThem) {
  const auto table = parse("# one\na\n\n5\n# five\n6\n");
  EXPECT_EQ(table.lines, (std::vector<std::uint32_t>{4, 6}));
  EXPECT_EQ(table.where(1), "x.csv:6");
}

TEST(Csv, ComplaintsNameFileLineAndColumn) {
  EXPECT_EQ(complaint([] { parse("a,speed_rpm\n1,2\n3,fast\n"); }),
            "x.csv:3: column \"speed_rpm\" holds \"fast\"; a finite number or nothing belongs there");
  EXPECT_EQ(complaint([] { parse("a,b\n1\n"); }), "x.csv:2: has 1 cells; the header names 2 columns");
  EXPECT_EQ(complaint([] { parse("a,b\n1,2,3\n"); }), "x.csv:2: has 3 cells; the header names 2 columns");
  EXPECT_EQ(complaint([] { parse("a,a\n1,2\n"); }),
            "x.csv:1: column \"a\" is there twice; names must differ");
  EXPECT_EQ(complaint([] { parse("a,,b\n"); }), "x.csv:1: column 2 has no name; each column needs one");
  EXPECT_EQ(complaint([] { parse("1,2\n3,4\n"); }),
            "x.csv:1: the first line holds numbers; a header line with the columns' names is needed");
  EXPECT_EQ(complaint([] { parse(""); }), "x.csv: is empty; a header line with the columns' names is needed");
  EXPECT_EQ(complaint([] {
              parse(
                  "\xff\xfe"
                  "a\0");
            }),
            "x.csv: is UTF-16 text; save it as UTF-8 or plain ASCII");
  EXPECT_NE(complaint([] { read_csv("/nowhere/x.csv"); }).find("/nowhere/x.csv: cannot be read"),
            std::string::npos);
}

TEST(Csv, NumbersThatAreNoneAreRefused) {
  for (const char* cell : {"1.2.3", "1e999", "inf", "-inf", "0x10", "1 2", "--1", "+-1", "1e", "\"",
                           "1\xc2\xa0"
                           "000",
                           "5A"}) {
    EXPECT_NE(complaint([&] { parse(std::string("a,b\n1,") + cell + "\n"); }), "") << cell;
  }
}

TEST(Csv, LimitsAreKept) {
  EXPECT_NE(complaint([] {
              parse_csv("a,b,c\n1,2,3\n", "x.csv", {.max_bytes = 100, .max_columns = 2, .max_cells = 100});
            }),
            "");
  EXPECT_NE(complaint([] {
              parse_csv("a,b\n1,2\n3,4\n", "x.csv", {.max_bytes = 100, .max_columns = 2, .max_cells = 3});
            }),
            "");
  EXPECT_NE(complaint([] {
              parse_csv("a,b\n1,2\n3,4\n", "x.csv", {.max_bytes = 5, .max_columns = 2, .max_cells = 9});
            }),
            "");
}

TEST(Csv, EveryBitOfANumberIsKept) {
  for (const double x : {1.0 / 3.0, 4.9406564584124654e-324, 1.7976931348623157e308, -0.0, 0.1}) {
    char text[64];
    std::snprintf(text, sizeof text, "a\n%.17g\n", x);
    const double got = parse(text).columns[0][0];
    EXPECT_EQ(got, x);
    EXPECT_EQ(std::signbit(got), std::signbit(x));
  }
}

}  // namespace
}  // namespace imrig
