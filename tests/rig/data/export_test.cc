#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <filesystem>
#include <random>

#include "rig/data/data_hash.h"
#include "rig/data/folder.h"
#include "tests/rig/data/scratch.h"

namespace imrig {
namespace {

using test::complaint;
using test::Scratch;

// Bits, with all NaN alike.
void same(double a, double b) {
  if (std::isnan(a) && std::isnan(b)) return;
  EXPECT_EQ(std::bit_cast<std::uint64_t>(a), std::bit_cast<std::uint64_t>(b)) << a << " and " << b;
}

void same(const std::vector<double>& a, const std::vector<double>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k) same(a[k], b[k]);
}

void same(const std::vector<SpaceVector>& a, const std::vector<SpaceVector>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k) {
    same(a[k].real(), b[k].real());
    same(a[k].imag(), b[k].imag());
  }
}

void same(const Record& a, const Record& b) {
  EXPECT_EQ(a.id, b.id);
  EXPECT_EQ(a.kind, b.kind);
  EXPECT_EQ(a.holdout, b.holdout);
  EXPECT_EQ(a.repeat_of, b.repeat_of);
  same({a.set.f_Hz, a.set.v_peak_V, a.set.step, a.set.load_Nm, a.set.excitation_A},
       std::vector<double>{b.set.f_Hz, b.set.v_peak_V, b.set.step, b.set.load_Nm, b.set.excitation_A});
  same(a.series.sample_time_s, b.series.sample_time_s);
  same(a.series.voltage_filter_s, b.series.voltage_filter_s);
  EXPECT_EQ(a.series.first_index, b.series.first_index);
  same(a.series.v, b.series.v);
  same(a.series.i, b.series.i);
  same(a.series.speed_rad_s, b.series.speed_rad_s);
  same(a.series.torque_Nm, b.series.torque_Nm);
  same(a.series.stator_C, b.series.stator_C);
  EXPECT_EQ(a.series.segment, b.series.segment);
  EXPECT_EQ(a.series.gates_on, b.series.gates_on);
  ASSERT_EQ(a.points.size(), b.points.size());
  for (std::size_t k = 0; k < a.points.size(); ++k) {
    const SteadyPoint &p = a.points[k], &q = b.points[k];
    same({p.v_peak_V, p.f_Hz, p.i_peak_A, p.p_in_W, p.power_factor, p.q_var, p.speed_rad_s, p.torque_Nm,
          p.p_out_W, p.stator_C},
         std::vector<double>{q.v_peak_V, q.f_Hz, q.i_peak_A, q.p_in_W, q.power_factor, q.q_var, q.speed_rad_s,
                             q.torque_Nm, q.p_out_W, q.stator_C});
  }
}

// Numbers with every bit in use, odd names, all optional columns.
DataSet odd_set(bool delta) {
  std::mt19937_64 random(99);
  std::normal_distribution<double> any(0.0, 100.0);
  DataSet data;
  data.name = "odd \"set\" \\ with ünïcode";
  data.pole_pairs = 3;
  data.delta = delta;
  data.noise = {any(random) * any(random) + 1e6, 1.0 / 3.0, 0.1, kMissing, 5.0};
  data.accuracy = {0.002, 1.0 / 7.0};
  for (int r = 0; r < 3; ++r) {
    Record record;
    record.id = "re/cord, " + std::to_string(r);
    record.kind = r == 2 ? RecordKind::kStartup : RecordKind::kStep;
    record.holdout = r == 1;
    if (r > 0) record.repeat_of = data.records[0].id;
    record.set = {50.0, any(random), kMissing, 0.1, any(random)};
    TimeSeries& s = record.series;
    s.sample_time_s = 60e-6 / 7.0;
    s.first_index = 123456789012 * r;
    s.voltage_filter_s = r == 0 ? 0.0 : 1e-3 / 3.0;
    for (int k = 0; k < 300; ++k) {
      s.v.emplace_back(any(random), k == 5 ? -0.0 : any(random));
      s.i.emplace_back(any(random) * 1e-300, any(random) * 1e100);
      s.speed_rad_s.push_back(any(random));
      if (r > 0) s.torque_Nm.push_back(any(random));
      if (r > 1) s.stator_C.push_back(k % 3 == 0 ? any(random) : kMissing);
      if (r > 1) s.segment.push_back(k / 100 - 1);
      if (r > 1) s.gates_on.push_back(k % 2 == 0);
    }
    data.records.push_back(record);
  }
  Record table;
  table.id = "table";
  table.kind = RecordKind::kPoints;
  for (int k = 0; k < 5; ++k) {
    SteadyPoint p;
    p.v_peak_V = std::abs(any(random)) + 1.0;
    p.f_Hz = 50.0 / 3.0;
    p.i_peak_A = std::abs(any(random));
    p.speed_rad_s = any(random);
    p.p_in_W = k == 2 ? kMissing : any(random);
    p.power_factor = any(random);
    table.points.push_back(p);
  }
  data.records.push_back(table);
  data.hash = hash_of(data);
  return data;
}

TEST(Export, ReadingBackGivesTheSameBits) {
  for (const bool delta : {false, true}) {
    Scratch scratch;
    const DataSet data = odd_set(delta);
    write_folder(data, scratch.path("out"));
    const DataSet back = read_folder(scratch.path("out"));
    EXPECT_EQ(back.name, data.name);
    EXPECT_EQ(back.pole_pairs, data.pole_pairs);
    EXPECT_EQ(back.delta, delta);
    same({back.noise.current_A, back.noise.voltage_V, back.noise.speed_rad_s, back.noise.torque_Nm,
          back.noise.power_W},
         std::vector<double>{data.noise.current_A, data.noise.voltage_V, data.noise.speed_rad_s,
                             data.noise.torque_Nm, data.noise.power_W});
    same(back.accuracy.voltage_gain, data.accuracy.voltage_gain);
    ASSERT_EQ(back.records.size(), data.records.size());
    for (std::size_t k = 0; k < data.records.size(); ++k) same(back.records[k], data.records[k]);
    EXPECT_EQ(back.hash, data.hash);
  }
}

TEST(Export, TheMeasuredTableSurvives) {
  Scratch scratch;
  const DataSet data = read_folder(std::string(IMRIG_SOURCE_DIR) + "/tests/data/motor_18k5");
  write_folder(data, scratch.path("out"));
  const DataSet back = read_folder(scratch.path("out"));
  same(back.records[0], data.records[0]);
  same(back.noise.current_A, data.noise.current_A);
  EXPECT_EQ(back.hash, data.hash);
}

TEST(Export, NothingHalfWrittenIsLeft) {
  Scratch scratch;
  DataSet data = odd_set(false);
  data.records[2].series.torque_Nm[7] = INFINITY;
  EXPECT_NE(complaint([&] { write_folder(data, scratch.path("out")); }).find("infinite"), std::string::npos);
  data = odd_set(false);
  data.records[1].series.torque_Nm.pop_back();
  EXPECT_NE(complaint([&] { write_folder(data, scratch.path("out")); }).find("different lengths"),
            std::string::npos);
  EXPECT_TRUE(std::filesystem::is_empty(scratch.path()));
}

TEST(Export, WhatIsThereIsNotTouched) {
  Scratch scratch;
  std::filesystem::create_directory(scratch.path("out"));
  write_folder(odd_set(false), scratch.path("out"));
  EXPECT_TRUE(std::filesystem::exists(scratch.path("out/dataset.toml")));
  EXPECT_NE(complaint([&] { write_folder(odd_set(false), scratch.path("out")); }).find("is there already"),
            std::string::npos);
  EXPECT_NE(
      complaint([&] { write_folder(odd_set(false), scratch.path("none/out")); }).find("cannot be written"),
      std::string::npos);
}

}  // namespace
}  // namespace imrig
