#pragma once
// A campaign's log made by construction: currents, voltages and angle are known functions of time, the
// sensors have known zeros and noise and round to whole counts.

#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <random>
#include <string>

#include "rig/base/space_vector.h"
#include "rig/bus/channels.h"
#include "rig/bus/event_log.h"
#include "tests/rig/bus/messages.h"

namespace imrig::test {

class CampaignLog {
 public:
  static constexpr double kT = 60e-6;
  static constexpr int kPerRev = 4096;
  static constexpr double kAmpere = 0.02F;  // a count; float, as in the message
  static constexpr double kVolt = 0.2F;

  explicit CampaignLog(const std::string& path, const std::string& prefix = "IMRIG")
      : log_(path), prefix_(prefix) {}

  // What the machine does at time t of the device's clock.
  std::function<SpaceVector(double)> current_A = [](double) { return SpaceVector(); };
  std::function<SpaceVector(double)> voltage_V = [](double) { return SpaceVector(); };
  std::function<double(double)> angle_rad = [](double) { return 0.0; };
  std::array<double, 6> zero = {3.3, -2.1, 0.4, -1.7, 2.6, 0.9};  // counts
  double noise = 1.2;                                             // counts, one sigma, before rounding
  std::int64_t boot_id = 77;
  std::int64_t index = 0;
  std::int64_t wall_utime = 1700000000000000;
  std::int32_t block_samples = 256;
  std::function<bool(std::int64_t first_index)> lose = [](std::int64_t) { return false; };

  double now_s() const { return static_cast<double>(index) * kT; }

  template <class Message>
  void write(const char* name, Message message) {
    message.seq = seq_[name]++;
    log_.write(wall_utime, prefix_ + "_" + name, encoded(message));
    wall_utime += 500;
  }
  void write_raw(const std::string& channel, const ByteVector& data) {
    log_.write(wall_utime, channel, data);
  }

  imrig_msg::record_t mark(std::int32_t number, const std::string& id,
                           const std::string& kind = "step") const {
    imrig_msg::record_t m = record(id);
    m.number = number;
    m.kind = kind;
    m.repeat_of = "";
    m.set_frequency_Hz = 60.0;
    m.set_voltage_V = 100.0;
    m.set_step = 0.1;
    m.set_load_Nm = std::nan("");
    m.set_excitation_A = 1.5;
    return m;
  }
  void begin(std::int32_t number, const std::string& id) { write(channel::kRecord, mark(number, id)); }
  void end(std::int32_t number, const std::string& id, std::int64_t samples,
           std::int32_t status = imrig_msg::record_t::COMPLETE) {
    imrig_msg::record_t m = mark(number, id);
    m.phase = imrig_msg::record_t::END;
    m.samples = samples;
    m.status = status;
    write(channel::kRecord, m);
  }
  // One whole record.
  void take(std::int32_t number, const std::string& id, std::int64_t samples) {
    begin(number, id);
    run(samples, number, true, 2);
    end(number, id, samples);
  }

  imrig_msg::samples_t block(std::int32_t n, std::int32_t number, bool gates, std::int32_t segment) {
    imrig_msg::samples_t m = samples(n);
    m.utime = index * 60;
    m.boot_id = boot_id;
    m.first_index = index;
    m.segment = segment;
    m.record = number;
    m.gates_on = gates ? 1 : 0;
    m.voltage_filter_s = 0.0004F;
    m.stator_C = 40.0F;
    for (std::int32_t k = 0; k < n; ++k, ++index) fill(m, static_cast<std::size_t>(k));
    return m;
  }
  void run(std::int64_t n, std::int32_t number, bool gates, std::int32_t segment = -1) {
    while (n > 0) {
      const auto part = static_cast<std::int32_t>(std::min<std::int64_t>(n, block_samples));
      n -= part;
      const std::int64_t first = index;
      const auto m = block(part, number, gates, segment);
      if (!lose(first)) write(channel::kSamples, m);
    }
  }
  void rest(double seconds) { run(static_cast<std::int64_t>(std::llround(seconds / kT)), 0, false); }
  void close() { log_.close(); }

 private:
  std::int16_t count(double value, double per_count, std::size_t channel) {
    const double clipped =
        std::clamp(std::round(value / per_count + zero[channel] + noise * gauss_(random_)), -2047.0, 2047.0);
    return static_cast<std::int16_t>(clipped);
  }
  void fill(imrig_msg::samples_t& m, std::size_t k) {
    const double t = now_s();
    const auto i = phases(current_A(t));
    const auto v = phases(voltage_V(t));
    m.i_a[k] = count(i[0], kAmpere, 0);
    m.i_b[k] = count(i[1], kAmpere, 1);
    m.i_c[k] = count(i[2], kAmpere, 2);
    m.v_a[k] = count(v[0], kVolt, 3);
    m.v_b[k] = count(v[1], kVolt, 4);
    m.v_c[k] = count(v[2], kVolt, 5);
    m.encoder[k] = static_cast<std::int32_t>(std::floor(angle_rad(t) / (2.0 * kPi) * kPerRev));
  }

  EventLogWriter log_;
  std::string prefix_;
  std::map<std::string, std::int64_t> seq_;
  std::mt19937_64 random_{1};
  std::normal_distribution<double> gauss_;
};

}  // namespace imrig::test
