#include "tests/estimators/fit/synthetic.h"

#include <Eigen/Dense>
#include <cmath>
#include <random>
#include <unsupported/Eigen/MatrixFunctions>

namespace imrig::est::synthetic {

namespace {

using Complex = std::complex<double>;

// States: psi_s, psi_r, supply u (du/dt = j w_e u), filtered voltage.
Eigen::Matrix4cd system_matrix(const Motor& m, double w_e, double w_r, double filter_s) {
  Eigen::Matrix2d inductance;
  inductance << m.L_ls + m.L_m, m.L_m, m.L_m, m.L_lr + m.L_m;
  const Eigen::Matrix2d to_current = inductance.inverse();
  Eigen::Matrix4cd a = Eigen::Matrix4cd::Zero();
  a.topLeftCorner<1, 2>() = (-m.R_s * to_current.row(0)).cast<Complex>();
  a.block<1, 2>(1, 0) = (-m.R_r * to_current.row(1)).cast<Complex>();
  a(1, 1) += Complex(0.0, w_r);
  a(0, 2) = 1.0;
  a(2, 2) = Complex(0.0, w_e);
  if (filter_s > 0.0) {
    a(3, 2) = 1.0 / filter_s;
    a(3, 3) = -1.0 / filter_s;
  }
  return a;
}

Complex stator_current(const Motor& m, const Eigen::Vector4cd& x) {
  const double L_s = m.L_ls + m.L_m;
  const double L_r = m.L_lr + m.L_m;
  return (L_r * x[0] - m.L_m * x[1]) / (L_s * L_r - m.L_m * m.L_m);
}

Eigen::Vector4cd steady(const Eigen::Matrix4cd& a, double w_e, Complex u, double filter_s) {
  Eigen::Vector4cd x = Eigen::Vector4cd::Zero();
  const Eigen::Matrix2cd turning = Complex(0.0, w_e) * Eigen::Matrix2cd::Identity() - a.topLeftCorner<2, 2>();
  x.head<2>() = turning.fullPivLu().solve(Eigen::Vector2cd(u, 0.0));
  x[2] = u;
  x[3] = filter_s > 0.0 ? u / Complex(1.0, w_e * filter_s) : u;
  return x;
}

}  // namespace

const std::vector<Motor>& motors() {
  static const std::vector<Motor> all{
      {"0.5 kW", 2, 12.0, 10.5, 0.032, 0.038, 0.62, 325.0, 50.0, 0.07},
      {"3.7 kW (2002 paper)", 2, 0.39, 0.2395, 0.003105, 0.003105, 0.070895, 179.6, 60.0, 0.028},
      {"18.5 kW", 2, 0.238, 0.178, 0.001613, 0.002451, 0.07045, 326.6, 50.0, 0.025},
      {"50 kW", 3, 0.045, 0.032, 0.00035, 0.00042, 0.0115, 326.6, 50.0, 0.014},
  };
  return all;
}

Case step_case(const Motor& motor, double relative_voltage, double relative_frequency, double slip,
               double sample_time_s, std::size_t samples) {
  Case c;
  c.f_Hz = motor.f_Hz * relative_frequency;
  c.v_peak_V = motor.v_peak_V * relative_voltage;
  c.sample_time_s = sample_time_s;
  c.samples = samples;
  c.step_at_s = std::floor(0.4 * static_cast<double>(samples)) * sample_time_s;
  const double speed = (1.0 - slip) * 2.0 * kPi * c.f_Hz / motor.pole_pairs;
  c.speed_rad_s = [speed](double) { return speed; };
  return c;
}

TimeSeries record(const Motor& m, const Case& c) {
  TimeSeries series;
  series.sample_time_s = c.sample_time_s;
  series.voltage_filter_s = c.filter_s;
  const double w_e = 2.0 * kPi * c.f_Hz;
  const double h = c.sample_time_s / c.fine;
  double w_r = m.pole_pairs * c.speed_rad_s(0.0);
  Eigen::Matrix4cd a = system_matrix(m, w_e, w_r, c.filter_s);
  Eigen::Matrix4cd ahead = (a * h).exp();
  Eigen::Vector4cd x = steady(a, w_e, c.from_rest ? 0.0 : c.v_peak_V, c.filter_s);
  x[2] = c.v_peak_V;
  x[0] += c.start_off_stator_Wb;
  x[1] += c.start_off_rotor_Wb;
  if (c.filter_s <= 0.0) x[3] = x[2];
  bool stepped = false;
  for (std::size_t k = 0; k < c.samples; ++k) {
    const double t = static_cast<double>(k) * c.sample_time_s;
    if (!stepped && c.step_at_s > 0.0 && t >= c.step_at_s - 1e-9) {
      x[2] *= 1.0 + c.step;
      stepped = true;
    }
    series.i.push_back(stator_current(m, x));
    series.v.push_back(c.filter_s > 0.0 ? x[3] : x[2]);
    series.speed_rad_s.push_back(c.speed_rad_s(t));
    for (int part = 0; part < c.fine; ++part) {
      const double w_next = m.pole_pairs * c.speed_rad_s(t + (part + 0.5) * h);
      if (w_next != w_r) {
        w_r = w_next;
        a = system_matrix(m, w_e, w_r, c.filter_s);
        ahead = (a * h).exp();
      }
      x = ahead * x;
    }
  }
  return series;
}

void add_noise(TimeSeries& series, double current_A, double voltage_V, double speed_rad_s,
               std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  for (std::size_t k = 0; k < series.size(); ++k) {
    series.i[k] += current_A * Complex(normal(random), normal(random));
    series.v[k] += voltage_V * Complex(normal(random), normal(random));
    series.speed_rad_s[k] += speed_rad_s * normal(random);
  }
}

}  // namespace imrig::est::synthetic
