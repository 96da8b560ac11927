#include "rig/data/data_hash.h"

#include <string_view>

#include "rig/base/file.h"

namespace imrig {

namespace {

class Hash {
 public:
  template <class T>
  void values(const std::vector<T>& all) {
    number(static_cast<double>(all.size()));
    bytes({reinterpret_cast<const char*>(all.data()), all.size() * sizeof(T)});
  }
  void number(double x) {
    if (x != x) x = kMissing;  // one NaN for all
    bytes({reinterpret_cast<const char*>(&x), sizeof x});
  }
  void text(const std::string& word) {
    number(static_cast<double>(word.size()));
    bytes(word);
  }
  std::uint64_t value() const { return value_; }

 private:
  void bytes(std::string_view raw) { value_ = fnv1a64(raw, value_); }
  std::uint64_t value_ = fnv1a64("imrig data 1");
};

void add(Hash& hash, const TimeSeries& series) {
  hash.number(series.sample_time_s);
  hash.number(series.voltage_filter_s);
  hash.values(series.v);
  hash.values(series.i);
  hash.values(series.speed_rad_s);
  hash.values(series.torque_Nm);
  for (const double x : series.stator_C) hash.number(x);
}

void add(Hash& hash, const SteadyPoint& p) {
  for (const double x : {p.v_peak_V, p.f_Hz, p.i_peak_A, p.p_in_W, p.power_factor, p.q_var, p.speed_rad_s,
                         p.torque_Nm, p.p_out_W, p.stator_C}) {
    hash.number(x);
  }
}

}  // namespace

std::uint64_t hash_of(const DataSet& data) {
  Hash hash;
  hash.number(data.pole_pairs);
  hash.number(data.delta ? 1.0 : 0.0);
  for (const auto& record : data.records) {
    hash.text(record.id);
    hash.text(record_kind_word(record.kind));
    hash.number(record.holdout ? 1.0 : 0.0);
    hash.text(record.repeat_of);
    add(hash, record.series);
    for (const auto& point : record.points) add(hash, point);
  }
  return hash.value();
}

}  // namespace imrig
