#pragma once
// A small campaign of an independent simulation (synthetic.h), with a flaw put into its records by hand or
// into the motor that makes them.

#include <fmt/format.h>

#include <functional>

#include "estimators/model/model.h"
#include "tests/estimators/fit/synthetic.h"

namespace imrig::est {

using Flaw = std::function<void(Record&)>;
using MotorOf = std::function<synthetic::Motor(std::size_t record)>;

inline Model model_of(const synthetic::Motor& m) {
  const double L_s = m.L_ls + m.L_m, L_r = m.L_lr + m.L_m, k = m.L_m / L_r;
  Model model;
  model.pole_pairs = m.pole_pairs;
  model.R_s = {m.R_s, 0.995 * m.R_s, 1.005 * m.R_s, "ohm", "dc test, 3 records"};
  model.R_r = {m.R_r * k * k, kMissing, kMissing, "ohm", ""};
  model.L_l = {L_s - m.L_m * k, kMissing, kMissing, "H", ""};
  model.L_m = {m.L_m * k, kMissing, kMissing, "H", ""};
  return model;
}

// 18 records over frequency, flux and slip, every fifth held out. noise: of the current, share of rated.
inline DataSet grid(const synthetic::Motor& motor, std::uint64_t seed, const Flaw& flaw = {},
                    const MotorOf& motor_of = {}, double noise = 2e-3) {
  DataSet data;
  data.name = "bench";
  data.pole_pairs = motor.pole_pairs;
  const double rated_A = motor.v_peak_V / (20.0 * motor.R_s);
  data.noise = {noise * rated_A, 1e-3 * motor.v_peak_V, 0.05, kMissing, kMissing};
  std::size_t n = 0;
  for (const double f : {0.4, 0.7, 1.0}) {
    for (const double flux : {0.5, 0.9}) {
      for (const double slip : {0.1, 0.5, 1.0}) {
        Record record;
        record.id = fmt::format("f{}_psi{}_s{}", f, flux, slip);
        record.kind = RecordKind::kStep;
        record.holdout = n % 5 == 3;
        const synthetic::Motor m = motor_of ? motor_of(n) : motor;
        record.series =
            synthetic::record(m, synthetic::step_case(m, flux * f, f, slip * motor.slip / f, 200e-6, 1500));
        if (flaw) flaw(record);
        synthetic::add_noise(record.series, data.noise.current_A, data.noise.voltage_V,
                             data.noise.speed_rad_s, seed + n);
        data.records.push_back(std::move(record));
        ++n;
      }
    }
  }
  return data;
}

}  // namespace imrig::est
