#pragma once
// The emulated bench as a source of sample blocks, without processes: the plant driven by a rotating voltage that is
// held from sample to sample, loaded through its generator's field. What is true at its operating points is asked
// from the plant's truth.

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "estimators/model/model.h"
#include "estimators/online/operating_point.h"
#include "plant/operating_point.h"
#include "plant/plant.h"
#include "plant/plant_config.h"
#include "rig/base/space_vector.h"

namespace imrig::test {

class EmulatedMotor {
 public:
  using Take = std::function<void(const est::SampleBlock&)>;
  static constexpr std::size_t kBlock = 256;

  EmulatedMotor(const std::string& toml, Take take)
      : config_(plant::parse_plant_config(toml, "test")), plant_(config_), take_(std::move(take)) {}

  // Gates off.
  void rest(double seconds) { drive(seconds, [](double) { return plant::InverterCommand{}; }); }
  // Frequency and peak phase voltage run on straight lines from where they are.
  void run(double seconds, double f_Hz, double V) {
    const double f_0 = f_Hz_, V_0 = V_, h = sample_s();
    drive(seconds, [&](double share) {
      f_Hz_ = f_0 + share * (f_Hz - f_0);
      V_ = V_0 + share * (V - V_0);
      const SpaceVector v = std::polar(V_, angle_ + kPi * f_Hz_ * h);
      angle_ = std::remainder(angle_ + 2.0 * kPi * f_Hz_ * h, 2.0 * kPi);
      const auto p = phases(v);
      return plant::InverterCommand{{p[0], p[1], p[2]}, true};
    });
    f_Hz_ = f_Hz;
    V_ = V;
  }
  void excite(double field_A) { plant_.set_excitation({60.0, field_A, true, 0.0, 0.0}); }
  // Any voltage vector over the time since this call, s.
  void apply(double seconds, const std::function<SpaceVector(double)>& v) {
    drive(seconds, [&](double share) {
      const auto p = phases(v(share * seconds));
      return plant::InverterCommand{{p[0], p[1], p[2]}, true};
    });
  }

  const plant::PlantConfig& config() const { return config_; }
  const plant::Observed& state() const { return plant_.state(); }
  double sample_s() const { return 1e-9 * static_cast<double>(plant_.sample_time_ns()); }
  double time_s() const { return static_cast<double>(plant_.index()) * sample_s(); }
  double f_Hz() const { return f_Hz_; }
  // Of what is held, peak.
  double fundamental_V() const {
    const double x = kPi * f_Hz_ * sample_s();
    return V_ * std::sin(x) / x;
  }
  double slip() const {
    return 1.0 - config_.machine.pole_pairs * plant_.state().w_mech_rad_s / (2.0 * kPi * f_Hz_);
  }
  // What an ideal identification would find at a slip, with the temperatures of this moment.
  plant::OperatingPoint truth(double slip) const { return truth(slip, state().rotor_C); }
  plant::OperatingPoint truth(double slip, double rotor_C) const {
    plant::PointRequest at;
    at.f_Hz = f_Hz_;
    at.v_V = fundamental_V();
    at.slip = slip;
    at.stator_C = state().stator_C;
    at.rotor_C = rotor_C;
    return plant::find_operating_point(config_, at);
  }

 private:
  template <class Command>
  void drive(double seconds, const Command& command) {
    const auto n = static_cast<std::size_t>(std::llround(seconds / sample_s()));
    for (std::size_t from = 0; from < n; from += kBlock) {
      const std::size_t count = std::min(kBlock, n - from);
      const std::int64_t first = plant_.index();
      for (std::size_t k = 0; k < count; ++k) {
        const auto cmd = command(static_cast<double>(from + k + 1) / static_cast<double>(n));
        samples_[k] = plant_.step(cmd);
        gates_ = cmd.gates_on;
      }
      hand_over(first, count);
    }
  }
  void hand_over(std::int64_t first, std::size_t n) {
    for (std::size_t k = 0; k < n; ++k) {
      for (std::size_t p = 0; p < 3; ++p) {
        i_[p][k] = samples_[k].i[p];
        v_[p][k] = samples_[k].v[p];
      }
      encoder_[k] = samples_[k].encoder;
    }
    const plant::SensorScale scale = plant_.scale();
    est::SampleBlock b;
    b.boot_id = 1;
    b.first_index = first;
    b.sample_time_ns = plant_.sample_time_ns();
    b.gates_on = gates_;
    b.current_A_per_count = scale.current_A_per_count;
    b.voltage_V_per_count = scale.voltage_V_per_count;
    b.voltage_filter_s = scale.voltage_filter_s;
    b.encoder_counts_per_rev = scale.encoder_counts_per_rev;
    b.stator_C = static_cast<double>(samples_[n - 1].stator_C);
    const auto cut = [n](const auto& all) { return std::span(all.data(), n); };
    b.i_a = cut(i_[0]);
    b.i_b = cut(i_[1]);
    b.i_c = cut(i_[2]);
    b.v_a = cut(v_[0]);
    b.v_b = cut(v_[1]);
    b.v_c = cut(v_[2]);
    b.encoder = cut(encoder_);
    take_(b);
  }

  plant::PlantConfig config_;
  plant::Plant plant_;
  Take take_;
  std::array<plant::RawSample, kBlock> samples_;
  std::array<std::int16_t, kBlock> i_[3], v_[3];
  std::array<std::int32_t, kBlock> encoder_;
  bool gates_ = false;
  double f_Hz_ = 0.0, V_ = 0.0, angle_ = 0.0;
};

// The model that an ideal identification of the plant would write, cold, at the motor's rated voltage and frequency:
// base parameters, the rotor's part that goes with slip and its temperature coefficient, from four points of truth; its
// intervals are how far these differ, since no constant serves all of them better.
inline est::Model true_model(const plant::PlantConfig& config, double f_Hz, double V, double cold_C, double warm_C) {
  const auto at = [&](double slip, double rotor_C) {
    plant::PointRequest r;
    r.f_Hz = f_Hz;
    r.v_V = V;
    r.slip = slip;
    r.stator_C = cold_C;
    r.rotor_C = rotor_C;
    return plant::find_operating_point(config, r);
  };
  const plant::OperatingPoint low = at(0.01, cold_C), middle = at(0.03, cold_C),
                              high = at(0.06, cold_C), warm = at(0.01, warm_C);
  const auto rise = [&](const plant::OperatingPoint& to) {
    return (to.secant.R_r_ohm - low.secant.R_r_ohm) / (to.w_slip_rad_s - low.w_slip_rad_s);
  };
  const double k_6 = rise(high), R_1 = low.secant.R_r_ohm - k_6 * low.w_slip_rad_s;
  const auto parameter = [](double value, double doubt, const char* unit) {
    const double half = std::max(std::abs(doubt), 1e-3 * value);
    return est::Parameter{value, value - half, value + half, unit, "truth"};
  };
  est::Model model;
  model.name = "truth";
  model.pole_pairs = config.machine.pole_pairs;
  model.R_s = parameter(low.secant.R_s_ohm, 0.0, "ohm");
  model.R_r = parameter(R_1, middle.secant.R_r_ohm - R_1 - k_6 * middle.w_slip_rad_s, "ohm");
  model.L_l = parameter(low.secant.L_l_H, high.secant.L_l_H - low.secant.L_l_H, "H");
  model.L_m = parameter(low.secant.L_m_H, high.secant.L_m_H - low.secant.L_m_H, "H");
  model.R_s_stator_C = cold_C;
  model.effects.push_back({"rotor_skin_effect", "line", {{"k6_ohm_s", parameter(k_6, rise(middle) - k_6, "ohm s")}}});
  model.effects.push_back({"rotor_heating",
                           "by winding temperature",
                           {{"per_K", parameter((warm.secant.R_r_ohm / low.secant.R_r_ohm - 1.0) / (warm_C - cold_C), 0.0, "1/K")},
                            {"reference_C", parameter(cold_C, 0.0, "C")}}});
  return model;
}

}  // namespace imrig::test
