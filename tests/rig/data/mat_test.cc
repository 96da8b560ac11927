#include "rig/data/mat.h"

#include <gtest/gtest.h>
#include <matio.h>

#include <array>
#include <cmath>
#include <fstream>
#include <iterator>

#include "rig/data/folder.h"
#include "tests/rig/data/scratch.h"

namespace imrig {
namespace {

using test::complaint;

class MatFile {
 public:
  MatFile(const std::string& path, mat_ft version) : file_(Mat_CreateVer(path.c_str(), nullptr, version)) {}
  ~MatFile() { Mat_Close(file_); }
  template <class T>
  void add(const char* name, std::vector<T> x, matio_classes kind, matio_types type, bool row = false) {
    std::array<std::size_t, 2> dims = {row ? 1 : x.size(), row ? x.size() : 1};
    put(Mat_VarCreate(name, kind, type, 2, dims.data(), x.data(), 0));
  }
  void add_matrix(const char* name) {
    std::vector<double> x(12, 1.0);
    std::array<std::size_t, 2> dims = {3, 4};
    put(Mat_VarCreate(name, MAT_C_DOUBLE, MAT_T_DOUBLE, 2, dims.data(), x.data(), 0));
  }

 private:
  void put(matvar_t* variable) {
    Mat_VarWrite(file_, variable, MAT_COMPRESSION_ZLIB);
    Mat_VarFree(variable);
  }
  mat_t* file_;
};

TEST(Mat, EveryRealVectorIsAColumn) {
  test::Scratch scratch;
  {
    MatFile file(scratch.path("x.mat"), MAT_FT_MAT5);
    file.add<double>("u", {1.5, NAN, -2.0}, MAT_C_DOUBLE, MAT_T_DOUBLE);
    file.add<float>("n", {0.5f, 1.0f, 2.0f}, MAT_C_SINGLE, MAT_T_SINGLE, true);
    file.add<std::int16_t>("raw", {-5, 0, 7}, MAT_C_INT16, MAT_T_INT16);
    file.add<double>("Ts", {1e-4}, MAT_C_DOUBLE, MAT_T_DOUBLE);
    file.add_matrix("M");
  }
  const ColumnTable table = read_mat(scratch.path("x.mat"));
  EXPECT_EQ(table.names, (std::vector<std::string>{"u", "n", "raw"}));
  EXPECT_EQ(table.columns[0][0], 1.5);
  EXPECT_TRUE(std::isnan(table.columns[0][1]));
  EXPECT_EQ(table.columns[1], (std::vector<double>{0.5, 1.0, 2.0}));
  EXPECT_EQ(table.columns[2], (std::vector<double>{-5.0, 0.0, 7.0}));
}

TEST(Mat, Level4AndLevel73AreReadToo) {
  for (const mat_ft version : {MAT_FT_MAT4, MAT_FT_MAT73}) {
    test::Scratch scratch;
    {
      MatFile file(scratch.path("x.mat"), version);
      file.add<double>("u", {1.5, NAN, -2.0}, MAT_C_DOUBLE, MAT_T_DOUBLE);
      file.add<double>("n", {1.0 / 3.0, 1.0, 2.0}, MAT_C_DOUBLE, MAT_T_DOUBLE, true);
    }
    const ColumnTable table = read_mat(scratch.path("x.mat"));
    ASSERT_EQ(table.names.size(), 2u);  // in any order
    EXPECT_EQ(table.columns[static_cast<std::size_t>(table.find("u"))][2], -2.0);
    EXPECT_EQ(table.columns[static_cast<std::size_t>(table.find("n"))][0], 1.0 / 3.0);
  }
}

// Bytes from outside: any cut and any flipped byte ends in a table or an Error.
TEST(Mat, DamagedFilesAreRefusedOrReadNeverMore) {
  test::Scratch scratch;
  {
    MatFile file(scratch.path("x.mat"), MAT_FT_MAT5);
    file.add<double>("u", std::vector<double>(40, 1.5), MAT_C_DOUBLE, MAT_T_DOUBLE);
    file.add<std::int16_t>("raw", {-5, 0, 7}, MAT_C_INT16, MAT_T_INT16);
  }
  std::ifstream in(scratch.path("x.mat"), std::ios::binary);
  const std::string whole((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  for (std::size_t cut = 0; cut < whole.size(); cut += 3) {
    scratch.write("cut.mat", whole.substr(0, cut));
    complaint([&] { EXPECT_LE(read_mat(scratch.path("cut.mat")).columns.size(), 2u); });
  }
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ 0x55);
    scratch.write("bent.mat", bytes);
    complaint([&] { EXPECT_LE(read_mat(scratch.path("bent.mat")).columns.size(), 2u); });
  }
}

TEST(Mat, ARecordFromMatEqualsTheOneFromCsv) {
  test::Scratch scratch;
  const test::Bench bench;
  const char* names[] = {"t_s", "v_a_V", "v_b_V", "v_c_V", "i_a_A", "i_b_A", "i_c_A", "speed_rpm"};
  {
    MatFile file(scratch.path("r1.mat"), MAT_FT_MAT5);
    for (std::size_t c = 0; c < 8; ++c) {
      std::vector<double> x;
      for (int k = 0; k < bench.samples; ++k) x.push_back(bench.row(k)[c]);
      file.add(names[c], x, MAT_C_DOUBLE, MAT_T_DOUBLE);
    }
  }
  scratch.write("r1.csv", bench.csv());
  scratch.write(
      "dataset.toml",
      test::manifest(
          "[[record]]\nid = \"m\"\nkind = \"steady\"\nfile = \"r1.mat\"\n[[record]]\nid = \"c\"\nkind = "
          "\"steady\"\nfile = \"r1.csv\"\n"));
  const DataSet data = read_folder(scratch.path());
  EXPECT_EQ(data.records[0].series.v, data.records[1].series.v);
  EXPECT_EQ(data.records[0].series.i, data.records[1].series.i);
  EXPECT_EQ(data.records[0].series.sample_time_s, data.records[1].series.sample_time_s);
}

TEST(Mat, ColumnsOfDifferentLengthAreRefused) {
  test::Scratch scratch;
  {
    MatFile file(scratch.path("r1.mat"), MAT_FT_MAT5);
    for (const char* name : {"v_a_V", "v_b_V", "v_c_V", "i_a_A", "i_b_A", "i_c_A"})
      file.add(name, std::vector<double>(50, 1.0), MAT_C_DOUBLE, MAT_T_DOUBLE);
    file.add("speed_rpm", std::vector<double>(49, 1.0), MAT_C_DOUBLE, MAT_T_DOUBLE);
  }
  scratch.write(
      "dataset.toml",
      test::manifest("[[record]]\nid = \"m\"\nkind = \"steady\"\nfile = \"r1.mat\"\nsample_time_s = 1e-4\n"));
  EXPECT_NE(
      complaint([&] { read_folder(scratch.path()); }).find("\"speed_rpm\" has 49 values, \"v_a_V\" has 50"),
      std::string::npos);
}

TEST(Mat, WhatIsNoMatFileIsSaid) {
  test::Scratch scratch;
  scratch.write("x.mat",
                "not a mat file at all, only a line of text that is a bit longer than the header of level 4, "
                "which has 20 bytes");
  EXPECT_NE(complaint([&] { read_mat(scratch.path("x.mat")); }), "");
  scratch.write("empty.mat", "");
  EXPECT_NE(complaint([&] { read_mat(scratch.path("empty.mat")); }), "");
  EXPECT_NE(complaint([&] { read_mat(scratch.path("none.mat")); }).find("cannot be read"), std::string::npos);
}

}  // namespace
}  // namespace imrig
