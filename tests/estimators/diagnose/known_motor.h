#pragma once
// Measurements of a motor whose behaviour is known by phasors, written without the code under test: Z = R_s +
// j X_l + (j X_m R_r/s)/(R_r/s + j X_m).

#include <cmath>
#include <random>
#include <string>

#include "estimators/model/model.h"
#include "rig/base/space_vector.h"
#include "rig/data/record.h"

namespace imrig::est::test {

struct KnownMotor {
  double R_s = 0.39, R_r = 0.22, L_l = 0.006, L_m = 0.068;
  int pole_pairs = 2;

  SpaceVector impedance(double f_Hz, double slip) const {
    const double w = 2.0 * kPi * f_Hz;
    const SpaceVector jXm(0.0, w * L_m);
    return R_s + SpaceVector(0.0, w * L_l) + jXm * (R_r / slip) / (R_r / slip + jXm);
  }
  Model model() const {
    Model m;
    m.name = "known";
    m.pole_pairs = pole_pairs;
    m.R_s.value = R_s;
    m.R_r.value = R_r;
    m.L_l.value = L_l;
    m.L_m.value = L_m;
    return m;
  }
};

struct SteadyRun {
  double f_Hz = 50.0, slip = 0.03, v_V = 200.0, phase = 0.4, sample_time_s = 2e-4;
  int samples = 5000;
  double sigma_i = 0.0, sigma_v = 0.0, sigma_w = 0.0;  // of each component, A, V, rad/s
  unsigned seed = 1;
};

inline Record steady_record(const KnownMotor& motor, const std::string& id, const SteadyRun& run) {
  Record record;
  record.id = id;
  record.kind = RecordKind::kSteady;
  TimeSeries& s = record.series;
  s.sample_time_s = run.sample_time_s;
  std::mt19937_64 random(run.seed);
  std::normal_distribution<double> draw(0.0, 1.0);
  const auto noise = [&](double sigma) {
    const double a = draw(random), b = draw(random);
    return sigma * SpaceVector(a, b);
  };
  const SpaceVector i0 = run.v_V / motor.impedance(run.f_Hz, run.slip);
  for (int k = 0; k < run.samples; ++k) {
    const SpaceVector turn = std::polar(1.0, 2.0 * kPi * run.f_Hz * run.sample_time_s * k + run.phase);
    s.v.push_back(run.v_V * turn + noise(run.sigma_v));
    s.i.push_back(i0 * turn + noise(run.sigma_i));
    s.speed_rad_s.push_back(2.0 * kPi * run.f_Hz * (1.0 - run.slip) / motor.pole_pairs +
                            run.sigma_w * draw(random));
  }
  return record;
}

inline SteadyPoint steady_point(const KnownMotor& motor, double f_Hz, double slip, double v_V) {
  const SpaceVector i = v_V / motor.impedance(f_Hz, slip);
  SteadyPoint p;
  p.v_peak_V = v_V;
  p.f_Hz = f_Hz;
  p.i_peak_A = std::abs(i);
  p.p_in_W = 1.5 * v_V * i.real();
  p.power_factor = i.real() / std::abs(i);
  p.speed_rad_s = 2.0 * kPi * f_Hz * (1.0 - slip) / motor.pole_pairs;
  const double air_gap_W = p.p_in_W - 1.5 * motor.R_s * std::norm(i);
  p.torque_Nm = air_gap_W / (2.0 * kPi * f_Hz / motor.pole_pairs);
  p.p_out_W = p.torque_Nm * p.speed_rad_s;
  return p;
}

inline DataSet data_set(std::vector<Record> records) {
  DataSet data;
  data.name = "bench";
  data.pole_pairs = 2;
  data.records = std::move(records);
  return data;
}

inline DataSet table_set(std::vector<SteadyPoint> points, double current_noise_A) {
  Record table;
  table.id = "table";
  table.kind = RecordKind::kPoints;
  table.points = std::move(points);
  DataSet data = data_set({table});
  data.noise.current_A = current_noise_A;
  data.noise.power_W = 5.0;
  data.noise.speed_rad_s = rad_s_of_rpm(0.3);
  return data;
}

}  // namespace imrig::est::test
