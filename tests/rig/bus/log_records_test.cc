#include "rig/bus/log_records.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "rig/base/error.h"
#include "rig/base/file.h"
#include "tests/e2e/command.h"
#include "tests/rig/bus/campaign_log.h"

namespace imrig::test {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

constexpr double kSpin = 180.0;  // rad/s

SpaceVector rotating(double amplitude, double t) { return std::polar(amplitude, 2.0 * kPi * 60.0 * t); }

std::string complaint_of(const std::function<void()>& body) {
  try {
    body();
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

// At rest for a second, then a motor that turns and carries current.
void start_turning(CampaignLog& log) {
  log.rest(1.0);
  const double start = log.now_s();
  log.current_A = [](double t) { return rotating(10.0, t); };
  log.voltage_V = [](double t) { return rotating(100.0, t); };
  log.angle_rad = [start](double t) { return kSpin * (t - start); };
}

bool same_values(const Record& a, const Record& b) {
  return a.id == b.id && a.series.v == b.series.v && a.series.i == b.series.i &&
         a.series.speed_rad_s == b.series.speed_rad_s && a.series.segment == b.series.segment &&
         a.series.first_index == b.series.first_index;
}

TEST(LogRecords, CampaignLogGivesItsRecordsInUnits) {
  const Folder folder;
  CampaignLog log(folder / "a.lcm");
  imrig_msg::dataset_t facts = dataset("bench 3");
  facts.accuracy_current_gain = 0.002;
  facts.noise_current_A = facts.noise_voltage_V = facts.noise_speed_rad_s = facts.noise_torque_Nm =
      facts.noise_power_W = std::nan("");
  log.write(channel::kDataset, facts);
  start_turning(log);
  log.run(1000, 0, true, 0);
  log.begin(1, "f60");
  const std::int64_t first = log.index;
  log.run(300, 1, true, 1);
  log.run(2000, 1, true, 2);
  log.end(1, "f60", 2300);
  log.run(1000, 0, true, 3);
  log.close();

  const DataSet data = read_log(folder / "a.lcm");
  EXPECT_EQ(data.name, "bench 3");
  EXPECT_EQ(data.pole_pairs, 2);
  EXPECT_EQ(data.accuracy.current_gain, 0.002);
  ASSERT_EQ(data.records.size(), 1u);
  const Record& record = data.records[0];
  EXPECT_EQ(record.id, "f60");
  EXPECT_EQ(record.kind, RecordKind::kStep);
  EXPECT_EQ(record.set.f_Hz, 60.0);
  EXPECT_EQ(record.set.excitation_A, 1.5);
  EXPECT_TRUE(std::isnan(record.set.load_Nm));
  EXPECT_TRUE(record.warnings.empty());
  const TimeSeries& s = record.series;
  ASSERT_EQ(s.size(), 2300u);
  EXPECT_EQ(s.first_index, first);
  EXPECT_DOUBLE_EQ(s.sample_time_s, CampaignLog::kT);
  EXPECT_NEAR(s.voltage_filter_s, 0.0004, 1e-9);
  EXPECT_EQ(s.segment[299], 1);
  EXPECT_EQ(s.segment[300], 2);
  EXPECT_EQ(s.gates_on[0], 1);
  EXPECT_EQ(s.stator_C[7], 40.0);
  double i2 = 0.0;
  double v2 = 0.0;
  SpaceVector i_mean;
  for (std::size_t k = 0; k < s.size(); ++k) {
    const double t = static_cast<double>(first + static_cast<std::int64_t>(k)) * CampaignLog::kT;
    i2 += std::norm(s.i[k] - rotating(10.0, t)) / 2.0;
    v2 += std::norm(s.v[k] - rotating(100.0, t)) / 2.0;
    i_mean += (s.i[k] - rotating(10.0, t)) / 2300.0;
    EXPECT_NEAR(s.speed_rad_s[k], kSpin, 6.0 * data.noise.speed_rad_s) << k;
  }
  const double component = std::sqrt(2.0 / 3.0 * (1.44 + 1.0 / 12.0));  // counts
  EXPECT_NEAR(std::sqrt(i2 / 2300.0), component * CampaignLog::kAmpere,
              0.05 * component * CampaignLog::kAmpere);
  EXPECT_NEAR(std::sqrt(v2 / 2300.0), component * CampaignLog::kVolt, 0.05 * component * CampaignLog::kVolt);
  EXPECT_LT(std::abs(i_mean), 5.0 * component * CampaignLog::kAmpere / std::sqrt(2300.0));
  EXPECT_NEAR(data.noise.current_A, component * CampaignLog::kAmpere,
              0.03 * component * CampaignLog::kAmpere);
  EXPECT_NEAR(data.noise.voltage_V, component * CampaignLog::kVolt, 0.03 * component * CampaignLog::kVolt);
  EXPECT_THAT(data.notes, Contains(HasSubstr("sensor zeros from 15")));  // 1 s less 50 ms, in whole blocks
}

TEST(LogRecords, ZerosTakeNoSamplesOfATurningShaftNorOfFluxThatStillDecays) {
  const Folder folder;
  CampaignLog log(folder / "a.lcm");
  log.index =
      100000;  // booted long ago: the log's first sample does not tell how long the gates have been off
  log.noise = 0.5;
  log.rest(1.0);
  log.run(1000, 0, true);
  const double open = log.now_s();
  log.voltage_V = [open](double t) {
    return SpaceVector(40.0 * std::exp(-(t - open) / 0.05));
  };  // flux dies away
  log.rest(0.7);
  log.voltage_V = [](double) { return SpaceVector(30.0); };
  log.angle_rad = [](double t) { return kSpin * t; };
  log.rest(1.0);  // coasting
  log.angle_rad = [](double) { return 0.0; };
  log.voltage_V = [](double) { return SpaceVector(); };
  log.take(1, "r", 500);
  log.close();
  const DataSet data = read_log(folder / "a.lcm");
  SpaceVector v;
  for (const auto& x : data.records[0].series.v) v += x / 500.0;
  EXPECT_LT(std::abs(v), 0.03);  // V; a count is 0.2 V, 500 samples of half a count average to 0.005 V
}

// After DC tests most of the samples with gates off show decaying flux: the rest before them is what counts.
TEST(LogRecords, ZerosPreferTheCampaignsOwnRestToDecayingFluxAfterIt) {
  const Folder folder;
  CampaignLog log(folder / "a.lcm");
  log.noise = 0.5;
  log.rest(0.2);
  imrig_msg::dataset_t facts = dataset();
  facts.utime = static_cast<std::int64_t>(1e6 * log.now_s());
  log.write(channel::kDataset, facts);
  log.rest(0.3);
  for (int k = 1; k <= 5; ++k) {
    log.voltage_V = [](double) { return SpaceVector(); };
    log.take(k, std::string("dc_").append(std::to_string(k)), 1000);
    const double open = log.now_s();
    log.voltage_V = [open](double t) { return SpaceVector(3.0 * std::exp(-(t - open) / 0.4)); };
    log.rest(1.0);
  }
  log.close();
  const DataSet data = read_log(folder / "a.lcm");
  SpaceVector v;
  for (const auto& x : data.records[0].series.v) v += x / 1000.0;
  EXPECT_LT(std::abs(v), 0.03);  // V; the decaying flux would make 0.5 V
  EXPECT_THAT(data.notes, Contains(HasSubstr("sensor zeros from 5000 samples")));
}

TEST(LogRecords, WithoutACampaignsRestZerosWaitUntilFluxHasDecayed) {
  const Folder folder;
  CampaignLog log(folder / "a.lcm");
  log.noise = 0.5;
  for (int k = 1; k <= 3; ++k) {
    log.voltage_V = [](double) { return SpaceVector(); };
    log.take(k, std::string("dc_").append(std::to_string(k)), 1000);
    const double open = log.now_s();
    log.voltage_V = [open](double t) { return SpaceVector(3.0 * std::exp(-(t - open) / 0.4)); };
    log.rest(2.5);
  }
  log.close();
  const DataSet data = read_log(folder / "a.lcm");
  SpaceVector v;
  for (const auto& x : data.records[0].series.v) v += x / 1000.0;
  EXPECT_LT(std::abs(v), 0.05);
}

TEST(LogRecords, NoiseBelowOneCountIsNeverTakenForNone) {
  const Folder folder;
  CampaignLog log(folder / "a.lcm");
  log.noise = 0.0;
  log.rest(0.5);
  log.take(1, "r", 500);
  log.close();
  const DataSet data = read_log(folder / "a.lcm");
  EXPECT_NEAR(data.noise.current_A, CampaignLog::kAmpere * std::sqrt(2.0 / 3.0 / 12.0), 1e-6);
  EXPECT_NEAR(data.noise.voltage_V, CampaignLog::kVolt * std::sqrt(2.0 / 3.0 / 12.0), 1e-6);
}

TEST(LogRecords, DeclaredNoiseComesBeforeMeasuredNoise) {
  const Folder folder;
  CampaignLog log(folder / "a.lcm");
  imrig_msg::dataset_t facts = dataset();
  facts.noise_current_A = 0.123;
  facts.noise_voltage_V = facts.noise_speed_rad_s = std::nan("");
  log.write(channel::kDataset, facts);
  log.rest(0.5);
  log.take(1, "r", 500);
  log.close();
  const DataSet data = read_log(folder / "a.lcm");
  EXPECT_EQ(data.noise.current_A, 0.123);
  EXPECT_GT(data.noise.voltage_V, 0.1);
  EXPECT_GT(data.noise.speed_rad_s, 0.0);
}

TEST(LogRecords, WithoutSamplesAtRestTheNotesSaySo) {
  const Folder folder;
  CampaignLog log(folder / "a.lcm");
  log.take(1, "r", 500);
  log.close();
  const DataSet data = read_log(folder / "a.lcm");
  EXPECT_TRUE(std::isnan(data.noise.current_A));
  EXPECT_THAT(data.notes, Contains(HasSubstr("zeros are taken as 0")));
}

TEST(LogRecords, LostBlockLeavesItsRecordOutByName) {
  const Folder folder;
  CampaignLog log(folder / "a.lcm");
  start_turning(log);
  log.take(1, "whole", 2000);
  std::int64_t lost = -1;
  log.lose = [&](std::int64_t first) {
    if (lost < 0 && log.index > 20000) lost = first;
    return first == lost;
  };
  log.take(2, "holed", 8000);
  log.close();
  ASSERT_GT(lost, 0);
  const DataSet data = read_log(folder / "a.lcm");
  ASSERT_EQ(data.records.size(), 1u);
  EXPECT_THAT(data.notes,
              Contains("record holed is left out: 256 of its 8000 samples are missing, the first at index " +
                       std::to_string(lost)));
}

TEST(LogRecords, BlocksTwiceOrOutOfOrderMakeNoDifference) {
  const Folder folder;
  const auto write = [&](const std::string& name, bool disturbed) {
    CampaignLog log(folder / name);
    start_turning(log);
    log.run(300, 0, true);
    log.begin(1, "r");
    std::vector<imrig_msg::samples_t> blocks;
    for (int k = 0; k < 8; ++k) blocks.push_back(log.block(250, 1, true, 2));
    std::vector<std::size_t> order = {0, 1, 2, 3, 4, 5, 6, 7};
    if (disturbed) order = {0, 2, 1, 1, 3, 4, 4, 6, 5, 7, 0};
    for (const auto k : order) log.write(channel::kSamples, blocks[k]);
    log.end(1, "r", 2000);
    log.run(300, 0, true);
    log.close();
    return read_log(folder / name);
  };
  const DataSet clean = write("a.lcm", false);
  const DataSet disturbed = write("b.lcm", true);
  ASSERT_EQ(disturbed.records.size(), 1u);
  // The margin behind the last block is not found when an old block comes after it: speed there rests on the
  // record alone.
  const Record& a = clean.records[0];
  const Record& b = disturbed.records[0];
  EXPECT_EQ(a.series.i, b.series.i);
  EXPECT_EQ(a.series.v, b.series.v);
  EXPECT_EQ(a.series.segment, b.series.segment);
  EXPECT_EQ(clean.hash, disturbed.hash);
}

TEST(LogRecords, LaterWholeRecordReplacesTheAbortedOneOfTheSameName) {
  const Folder folder;
  CampaignLog log(folder / "a.lcm");
  start_turning(log);
  log.begin(1, "p1");
  log.run(700, 1, true);
  log.end(1, "p1", 1000, imrig_msg::record_t::ABORTED);
  log.run(300, 1, true);  // the profile goes on for a moment
  log.take(2, "p1", 1000);
  log.take(3, "p2", 1000);
  log.take(4, "p2", 1200);
  log.begin(5, "p2");
  log.run(500, 5, true);
  log.end(5, "p2", 1200, imrig_msg::record_t::ABORTED);  // takes nothing away
  log.close();
  const DataSet data = read_log(folder / "a.lcm");
  ASSERT_EQ(data.records.size(), 2u);
  EXPECT_EQ(data.records[0].id, "p1");
  EXPECT_EQ(data.records[0].series.size(), 1000u);
  EXPECT_EQ(data.records[1].series.size(), 1200u);
  EXPECT_THAT(data.notes, Contains("record p1 is left out: it was aborted"));
  EXPECT_THAT(data.notes, Contains("record p2 was taken more than once: the last one counts"));
}

TEST(LogRecords, DeviceRestartWithinARecordLeavesItOut) {
  const Folder folder;
  CampaignLog log(folder / "a.lcm");
  start_turning(log);
  log.take(1, "fine", 1000);
  log.begin(2, "broken");
  log.run(500, 2, true);
  log.boot_id = 78;
  log.index = 0;
  log.run(500, 2, true);
  log.end(2, "broken", 1000);
  log.close();
  const DataSet data = read_log(folder / "a.lcm");
  EXPECT_EQ(data.records.size(), 1u);
  EXPECT_THAT(data.notes, Contains("record broken is left out: the device was restarted within it"));
}

TEST(LogRecords, SpeedAtTheEndsUsesSamplesFromOutsideTheRecord) {
  const Folder folder;
  CampaignLog log(folder / "a.lcm");
  log.rest(0.5);
  // Speed that curves strongly: a fit that stops at the record's ends would be off there.
  log.angle_rad = [](double t) { return 180.0 * t + 0.02 * std::sin(2.0 * kPi * 25.0 * t); };
  log.run(500, 0, true);
  const double begin_s = log.now_s();
  log.take(1, "r", 1000);
  log.run(500, 0, true);
  log.close();
  const Record record = read_log(folder / "a.lcm").records[0];
  const auto truth = [&](double t) {
    return 180.0 + 0.02 * 2.0 * kPi * 25.0 * std::cos(2.0 * kPi * 25.0 * t);
  };
  double middle = 0.0;
  double ends = 0.0;
  for (std::size_t k = 0; k < 1000; ++k) {
    const double error =
        std::abs(record.series.speed_rad_s[k] - truth(begin_s + CampaignLog::kT * static_cast<double>(k)));
    double& worst = k < 84 || k >= 916 ? ends : middle;
    worst = std::max(worst, error);
  }
  EXPECT_LT(ends, 1.2 * middle);
}

TEST(LogRecords, ClippedConverterIsSaid) {
  const Folder folder;
  CampaignLog log(folder / "a.lcm");
  log.rest(0.5);
  log.current_A = [](double t) { return rotating(45.0, t); };  // full scale is 40.9 A
  log.take(1, "r", 1000);
  log.close();
  const DataSet data = read_log(folder / "a.lcm");
  EXPECT_EQ(data.records[0].warnings.size(), 3u);
  EXPECT_THAT(data.records[0].warnings, Contains(HasSubstr("current b is at the converter's full scale in")));
}

TEST(LogRecords, OtherTrafficIsCountedAndThePrefixIsFound) {
  const Folder folder;
  CampaignLog log(folder / "a.lcm", "LAB_BENCH_3");
  log.rest(0.2);
  log.write_raw("CAMERA", ByteVector(1000));
  log.write_raw("CAMERA_RECORD", ByteVector(40));  // ends like ours, is none
  log.write_raw("LAB_BENCH_3_SAMPLES", ByteVector(10));
  log.take(1, "r", 1000);
  log.close();
  const DataSet data = read_log(folder / "a.lcm");
  EXPECT_EQ(data.records.size(), 1u);
  EXPECT_THAT(data.notes, Contains("2 messages on 2 other channels are ignored"));
  EXPECT_THAT(data.notes, Contains("1 malformed messages are ignored"));
}

TEST(LogRecords, TwoRigsInOneLogNeedAPrefix) {
  const Folder folder;
  CampaignLog a(folder / "a.lcm", "A");
  a.rest(0.2);
  a.take(1, "of_a", 600);
  a.close();
  CampaignLog b(folder / "b.lcm", "B");
  b.rest(0.2);
  b.take(1, "of_b", 600);
  b.close();
  write_text_atomically(folder / "ab.lcm", read_text(folder / "a.lcm") + read_text(folder / "b.lcm"));
  EXPECT_THAT(complaint_of([&] { read_log(folder / "ab.lcm"); }), HasSubstr("records of several rigs: A, B"));
  EXPECT_EQ(read_log(folder / "ab.lcm", "B").records[0].id, "of_b");
}

TEST(LogRecords, LogsWithoutRecordsAreRefusedWithASentence) {
  const Folder folder;
  CampaignLog samples_only(folder / "samples.lcm");
  samples_only.rest(0.5);
  samples_only.close();
  EXPECT_THAT(complaint_of([&] { read_log(folder / "samples.lcm"); }),
              HasSubstr("is a log of IMRIG but holds no record"));
  CampaignLog foreign(folder / "foreign.lcm");
  foreign.write_raw("CAMERA", ByteVector(100));
  foreign.close();
  EXPECT_THAT(complaint_of([&] { read_log(folder / "foreign.lcm"); }),
              HasSubstr("without any message of imrig"));
  CampaignLog aborted(folder / "aborted.lcm");
  aborted.begin(1, "p1");
  aborted.run(100, 1, true);
  aborted.close();
  EXPECT_THAT(complaint_of([&] { read_log(folder / "aborted.lcm"); }), HasSubstr("holds no whole record"));
  write_text_atomically(folder / "text.lcm", "t_s,v_a_V\n0,1\n");
  EXPECT_THAT(complaint_of([&] { read_log(folder / "text.lcm"); }), HasSubstr("is no LCM event log"));
}

TEST(LogRecords, TornLogKeepsTheRecordsThatAreWhole) {
  const Folder folder;
  CampaignLog log(folder / "a.lcm");
  log.rest(0.2);
  log.take(1, "p1", 3000);
  log.take(2, "p2", 3000);
  log.close();
  const std::string whole = read_text(folder / "a.lcm");
  const DataSet all = read_log(folder / "a.lcm");
  ASSERT_EQ(all.records.size(), 2u);
  const std::size_t first_end =
      whole.rfind("IMRIG_RECORD", whole.rfind("IMRIG_RECORD", whole.rfind("IMRIG_RECORD") - 1) - 1);
  for (std::size_t size = first_end + 400; size < whole.size(); size += 6007) {
    write_text_atomically(folder / "b.lcm", whole.substr(0, size));
    const DataSet part = read_log(folder / "b.lcm");
    ASSERT_EQ(part.records.size(), 1u) << size;
    EXPECT_TRUE(same_values(part.records[0], all.records[0])) << size;
    EXPECT_THAT(part.notes, Contains(HasSubstr("the log ends inside an event")));
  }
}

// The recorder and lcm-logger start and stop at different moments, and see the same samples at other times of
// day.
TEST(LogRecords, SameMeasurementLoggedTwiceGivesTheSameNumbers) {
  const Folder folder;
  const auto write = [&](const std::string& name, std::int64_t wall, bool late, double tail_s, double noise) {
    CampaignLog log(folder / name);
    log.wall_utime = wall;
    log.noise = noise;
    log.lose = [late](std::int64_t first) { return late && first < 5000; };
    log.rest(0.5);
    imrig_msg::dataset_t facts = dataset();
    facts.noise_current_A = facts.noise_voltage_V = std::nan("");
    facts.utime = static_cast<std::int64_t>(1e6 * log.now_s());
    log.write(channel::kDataset, facts);
    log.rest(0.4);
    log.current_A = [](double t) { return rotating(10.0, t); };
    log.take(1, "p1", 2000);
    log.current_A = [](double) { return SpaceVector(); };
    log.rest(tail_s);
    log.close();
    return read_log(folder / name);
  };
  const DataSet a = write("a.lcm", 1700000000000000, false, 0.1, 1.2);
  const DataSet b = write("b.lcm", 1800000000000000, true, 2.0, 1.2);
  const DataSet c = write("c.lcm", 1700000000000000, false, 0.1, 1.3);
  EXPECT_TRUE(same_values(a.records[0], b.records[0]));
  EXPECT_EQ(a.noise.current_A, b.noise.current_A);
  EXPECT_EQ(a.hash, b.hash);
  EXPECT_NE(a.hash, c.hash);
}

TEST(LogRecords, RateOfReadingIsPrinted) {
  const Folder folder;
  CampaignLog log(folder / "a.lcm");
  log.noise = 0.0;
  log.rest(0.5);
  for (int k = 1; k <= 10; ++k) log.take(k, std::string(1, static_cast<char>('a' + k)), 200000);
  log.close();
  const auto begin = std::chrono::steady_clock::now();
  const DataSet data = read_log(folder / "a.lcm");
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const double MB = static_cast<double>(std::filesystem::file_size(folder / "a.lcm")) / 1e6;
  std::printf("read %.0f MB in %.2f s: %.0f MB/s\n", MB, seconds, MB / seconds);
  EXPECT_EQ(data.records.size(), 10u);
  EXPECT_EQ(data.records[9].series.size(), 200000u);
}

}  // namespace
}  // namespace imrig::test
