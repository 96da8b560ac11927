#include "rig/bus/log_import.h"

#include <gtest/gtest.h>

#include <bit>
#include <filesystem>
#include <random>

#include "rig/base/error.h"
#include "rig/base/file.h"
#include "rig/bus/log_records.h"
#include "rig/data/data_hash.h"
#include "tests/e2e/command.h"
#include "tests/rig/bus/campaign_log.h"

namespace imrig::test {
namespace {

// Numbers of every kind: what must come back is the bits.
class Numbers {
 public:
  double next() {
    const double special[] = {0.0, -0.0, kMissing, 1e-310, -1e308, 1.0 / 3.0};
    if (random_() % 10 == 0) return special[random_() % 6];
    return std::bit_cast<double>((random_() & 0x800fffffffffffffull) | ((1000 + random_() % 60) << 52));
  }
  template <class T = double>
  std::vector<T> column(std::size_t n) {
    std::vector<T> out(n);
    for (auto& x : out) x = static_cast<T>(next());
    return out;
  }

 private:
  std::mt19937_64 random_{5};
};

std::vector<SpaceVector> vectors(Numbers& numbers, std::size_t n) {
  std::vector<SpaceVector> out(n);
  for (auto& x : out) x = {numbers.next(), numbers.next()};
  return out;
}

DataSet made_up() {
  Numbers numbers;
  DataSet data;
  data.name = "bench 3, März";
  data.pole_pairs = 3;
  data.delta = true;
  data.noise = {0.05, kMissing, rad_s_of_rpm(0.5), 0.1, kMissing};
  data.accuracy = {0.002, 1.0 / 3.0};
  data.notes = {"first note", "second note"};
  for (const std::size_t n : {1u, 499u, 500u, 501u, 1300u}) {
    Record r;
    r.id = "r" + std::to_string(n);
    r.kind = RecordKind::kStartup;
    r.holdout = n % 2 == 0;
    r.repeat_of = n == 501 ? "r500" : "";
    r.set = {60.0, kMissing, 0.1, -2.0, kMissing};
    r.series.sample_time_s = 1.0 / 3.0;
    r.series.first_index = n == 499 ? 123456789012 : 0;
    r.series.voltage_filter_s = 1e-4 / 3.0;
    r.series.i = vectors(numbers, n);
    if (n != 1) r.series.v = vectors(numbers, n);
    if (n != 499) r.series.speed_rad_s = numbers.column(n);
    if (n != 500) r.series.torque_Nm = numbers.column(n);
    if (n == 1300) {
      r.series.stator_C = numbers.column(n);
      for (std::size_t k = 0; k < n; ++k) {
        r.series.segment.push_back(static_cast<std::int32_t>(k % 7) - 1);
        r.series.gates_on.push_back(k % 3 == 0 ? 1 : 0);
      }
    }
    if (n == 501) r.warnings = {"phase order swapped", "gap at 0.1 s"};
    data.records.push_back(r);
  }
  Record points;
  points.id = "table";
  points.kind = RecordKind::kPoints;
  for (int k = 0; k < 700; ++k) {
    points.points.push_back({numbers.next(), numbers.next(), numbers.next(), numbers.next(), numbers.next(),
                             numbers.next(), numbers.next(), numbers.next(), numbers.next(), numbers.next()});
  }
  data.records.push_back(points);
  data.hash = hash_of(data);
  return data;
}

// Everything a data set holds, as bits.
class Bits {
 public:
  void add(double x) { out_.push_back(std::bit_cast<std::uint64_t>(x)); }
  void add(SpaceVector x) {
    add(x.real());
    add(x.imag());
  }
  void add(std::integral auto x) { out_.push_back(static_cast<std::uint64_t>(x)); }
  void add(const std::string& text) {
    add(text.size());
    for (const char c : text) add(static_cast<unsigned char>(c));
  }
  template <class T>
  void add(const std::vector<T>& all) {
    add(all.size());
    for (const auto& x : all) add(x);
  }
  void add(const SteadyPoint& p) {
    for (const double x : {p.v_peak_V, p.f_Hz, p.i_peak_A, p.p_in_W, p.power_factor, p.q_var, p.speed_rad_s,
                           p.torque_Nm, p.p_out_W, p.stator_C})
      add(x);
  }
  void add(const Record& r) {
    add(r.id);
    add(static_cast<int>(r.kind));
    add(r.holdout);
    add(r.repeat_of);
    for (const double x : {r.set.f_Hz, r.set.v_peak_V, r.set.step, r.set.load_Nm, r.set.excitation_A}) add(x);
    add(r.series.sample_time_s);
    add(r.series.first_index);
    add(r.series.v);
    add(r.series.i);
    add(r.series.speed_rad_s);
    add(r.series.torque_Nm);
    add(r.series.stator_C);
    add(r.series.segment);
    add(r.series.gates_on);
    add(r.series.voltage_filter_s);
    add(r.points);
    add(r.warnings);
  }
  std::vector<std::uint64_t> out_;
};

std::vector<std::uint64_t> bits(const DataSet& data) {
  Bits all;
  all.add(data.name);
  all.add(data.pole_pairs);
  all.add(data.delta);
  for (const double x :
       {data.noise.current_A, data.noise.voltage_V, data.noise.speed_rad_s, data.noise.torque_Nm,
        data.noise.power_W, data.accuracy.current_gain, data.accuracy.voltage_gain}) {
    all.add(x);
  }
  all.add(data.records);
  all.add(data.notes);
  return all.out_;
}

TEST(LogImport, DataSetComesBackToTheBit) {
  const Folder folder;
  const DataSet data = made_up();
  write_log(data, folder / "a.lcm");
  const DataSet back = read_log(folder / "a.lcm");
  EXPECT_EQ(bits(back), bits(data));
  EXPECT_EQ(back.hash, data.hash);
}

TEST(LogImport, MeasuredDataSetComesBackToTheBitToo) {
  const Folder folder;
  CampaignLog log(folder / "campaign.lcm");
  log.rest(0.3);
  log.current_A = [](double t) { return std::polar(10.0, 377.0 * t); };
  log.angle_rad = [](double t) { return 180.0 * t; };
  log.take(1, "p1", 1777);
  log.take(2, "p2", 1000);
  log.close();
  const DataSet data = read_log(folder / "campaign.lcm");
  write_log(data, folder / "copy.lcm");
  EXPECT_EQ(bits(read_log(folder / "copy.lcm")), bits(data));
}

TEST(LogImport, SameDataGivesTheSameBytes) {
  const Folder folder;
  write_log(made_up(), folder / "a.lcm");
  write_log(made_up(), folder / "b.lcm");
  EXPECT_EQ(read_text(folder / "a.lcm"), read_text(folder / "b.lcm"));
  EXPECT_EQ(folder.names(), (std::vector<std::string>{"a.lcm", "b.lcm"}));
}

TEST(LogImport, ImportedRecordsBehindACampaignAreReadWithIt) {
  const Folder folder;
  CampaignLog log(folder / "campaign.lcm");
  log.rest(0.3);
  log.take(1, "measured", 1000);
  log.close();
  DataSet table = made_up();
  table.pole_pairs = 2;
  table.delta = false;
  table.records.erase(table.records.begin(), table.records.end() - 1);
  write_log(table, folder / "table.lcm");
  write_text_atomically(folder / "both.lcm",
                        read_text(folder / "campaign.lcm") + read_text(folder / "table.lcm"));
  const DataSet both = read_log(folder / "both.lcm");
  ASSERT_EQ(both.records.size(), 2u);
  EXPECT_EQ(both.records[0].id, "measured");
  EXPECT_EQ(both.records[0].series.size(), 1000u);
  EXPECT_EQ(both.records[1].points.size(), 700u);
}

TEST(LogImport, WhatCannotBeToldExactlyIsRefusedAndLeavesNothingBehind) {
  const Folder folder;
  DataSet data = made_up();
  data.records[2].series.speed_rad_s.pop_back();
  EXPECT_THROW(write_log(data, folder / "a.lcm"), Error);
  data = made_up();
  data.records[2].warnings = {std::string(5000, 'x')};
  EXPECT_THROW(write_log(data, folder / "a.lcm"), Error);
  data = made_up();
  data.records.push_back({});
  EXPECT_THROW(write_log(data, folder / "a.lcm"), Error);
  EXPECT_TRUE(folder.names().empty());
  EXPECT_THROW(write_log(made_up(), folder / "none/a.lcm"), Error);
}

}  // namespace
}  // namespace imrig::test
