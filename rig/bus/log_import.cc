#include "rig/bus/log_import.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <imrig_msg/dataset_t.hpp>
#include <imrig_msg/record_t.hpp>
#include <imrig_msg/remark_t.hpp>
#include <map>

#include "rig/base/error.h"
#include "rig/bus/channels.h"
#include "rig/bus/event_log.h"
#include "rig/bus/guarded_decode.h"
#include "rig/bus/series_columns.h"

namespace imrig {

namespace {

constexpr char kPrefix[] = "IMRIG_";

std::string checked_text(const std::string& text, const std::string& what) {
  if (text.size() >= static_cast<std::size_t>(guard::kMaxTextBytes) || text.find('\0') != std::string::npos) {
    throw Error(what, "a text is longer than " + std::to_string(guard::kMaxTextBytes - 1) +
                          " bytes or holds a zero byte");
  }
  return text;
}

// Writes messages with rising seq per channel and the time of the sample they begin with.
class Importer {
 public:
  explicit Importer(const std::string& path) : log_(path, LogOpen::kReplace) {}

  template <class Message>
  void write(const char* channel, Message message) {
    message.utime = utime_;
    message.seq = seq_[channel]++;
    buffer_.resize(static_cast<std::size_t>(message.getEncodedSize()));
    message.encode(buffer_.data(), 0, static_cast<int>(buffer_.size()));
    log_.write(utime_, std::string(kPrefix) + channel, buffer_);
  }
  void pass(double seconds) {
    constexpr double kLongest_s = 1e9;
    utime_ += std::llround(1e6 * std::clamp(std::isfinite(seconds) ? seconds : 0.0, 0.0, kLongest_s));
  }
  void close() { log_.close(); }

 private:
  EventLogWriter log_;
  std::int64_t utime_ = 0;
  std::map<std::string, std::int64_t> seq_;
  std::vector<std::uint8_t> buffer_;
};

imrig_msg::dataset_t dataset_message(const DataSet& data) {
  imrig_msg::dataset_t m = {};
  m.dataset_v1 = 1;
  m.name = checked_text(data.name, "data set");
  m.pole_pairs = data.pole_pairs;
  m.delta = data.delta ? 1 : 0;
  m.noise_current_A = data.noise.current_A;
  m.noise_voltage_V = data.noise.voltage_V;
  m.noise_speed_rad_s = data.noise.speed_rad_s;
  m.noise_torque_Nm = data.noise.torque_Nm;
  m.noise_power_W = data.noise.power_W;
  m.accuracy_current_gain = data.accuracy.current_gain;
  m.accuracy_voltage_gain = data.accuracy.voltage_gain;
  return m;
}

imrig_msg::remark_t remark(std::int32_t number, const std::string& text) {
  imrig_msg::remark_t m = {};
  m.remark_v1 = 1;
  m.number = number;
  m.text = checked_text(text, "remark");
  return m;
}

imrig_msg::record_t record_message(const DataSet& data, const Record& record, std::int32_t number) {
  imrig_msg::record_t m = {};
  m.record_v1 = 1;
  m.phase = imrig_msg::record_t::BEGIN;
  m.number = number;
  m.id = checked_text(record.id, "record");
  m.kind = record_kind_word(record.kind);
  m.campaign = "import";
  m.plan_point = -1;
  m.pole_pairs = data.pole_pairs;
  m.set_frequency_Hz = record.set.f_Hz;
  m.set_voltage_V = record.set.v_peak_V;
  m.set_step = record.set.step;
  m.set_load_Nm = record.set.load_Nm;
  m.set_excitation_A = record.set.excitation_A;
  m.holdout = record.holdout ? 1 : 0;
  m.repeat_of = checked_text(record.repeat_of, "record " + record.id);
  m.status = imrig_msg::record_t::COMPLETE;
  return m;
}

void check(const Record& record) {
  const TimeSeries& s = record.series;
  for (const std::size_t n : {s.v.size(), s.speed_rad_s.size(), s.torque_Nm.size(), s.stator_C.size(),
                              s.segment.size(), s.gates_on.size()}) {
    if (n != 0 && n != s.size()) throw Error("record " + record.id, "its columns have different lengths");
  }
  if ((s.size() == 0) == record.points.empty()) {
    throw Error("record " + record.id, "it must hold a time series or points, one of them");
  }
}

void write_record(Importer& out, const DataSet& data, const Record& record, std::int32_t number) {
  check(record);
  imrig_msg::record_t message = record_message(data, record, number);
  out.write(channel::kRecord, message);
  for (const auto& warning : record.warnings) out.write(channel::kRemark, remark(number, warning));
  const TimeSeries& series = record.series;
  for (std::size_t first = 0; first < series.size(); first += kRowsPerMessage) {
    imrig_msg::series_t rows = series_rows(series, first, std::min(kRowsPerMessage, series.size() - first));
    rows.series_v1 = 1;
    rows.number = number;
    const double length_s = series.sample_time_s * rows.n_samples;
    out.write(channel::kSeries, rows);
    out.pass(length_s);
  }
  for (std::size_t first = 0; first < record.points.size(); first += kRowsPerMessage) {
    imrig_msg::points_t rows =
        point_rows(record.points, first, std::min(kRowsPerMessage, record.points.size() - first));
    rows.points_v1 = 1;
    rows.number = number;
    out.write(channel::kPoints, rows);
  }
  message.phase = imrig_msg::record_t::END;
  message.samples = static_cast<std::int64_t>(series.size() + record.points.size());
  out.write(channel::kRecord, message);
}

void write_all(const DataSet& data, const std::string& path) {
  Importer out(path);
  out.write(channel::kDataset, dataset_message(data));
  for (const auto& note : data.notes) out.write(channel::kRemark, remark(0, note));
  std::int32_t number = 0;
  for (const auto& record : data.records) write_record(out, data, record, ++number);
  out.close();
}

}  // namespace

void write_log(const DataSet& data, const std::string& path) {
  const std::string part = path + ".part" + std::to_string(::getpid());
  try {
    write_all(data, part);
    std::filesystem::rename(part, path);
  } catch (const std::filesystem::filesystem_error& e) {
    std::filesystem::remove(part);
    throw Error(path, "cannot be written: " + e.code().message());
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove(part, ignored);
    throw;
  }
}

}  // namespace imrig
