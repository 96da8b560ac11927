#include "tests/estimators/fit/standstill/standing_motor.h"

#include <Eigen/Dense>
#include <cmath>
#include <complex>
#include <random>
#include <unsupported/Eigen/MatrixFunctions>

namespace imrig::est::standing {

namespace {

// States: i_s, i_r, filtered voltage; input: voltage.
struct Discrete {
  Eigen::Matrix3d F;
  Eigen::Vector3d g;
};

Discrete discrete(const Motor& m, const Experiment& e) {
  Eigen::Matrix2d L;
  L << m.L_ls + m.L_m, m.L_m, m.L_m, m.L_lr + m.L_m;
  const Eigen::Matrix2d inverse = L.inverse();
  Eigen::Matrix2d R;
  R << m.R_s, 0.0, 0.0, m.R_r;
  Eigen::Matrix4d A = Eigen::Matrix4d::Zero();
  A.topLeftCorner<2, 2>() = -inverse * R;
  A.block<2, 1>(0, 3) = inverse.col(0);
  const double rate = e.filter_s > 0.0 ? 1.0 / e.filter_s : 0.0;
  A(2, 2) = -rate;
  A(2, 3) = rate;
  const Eigen::Matrix4d whole = (A * e.sample_time_s).exp();
  return {whole.topLeftCorner<3, 3>(), whole.topRightCorner<3, 1>()};
}

}  // namespace

TimeSeries record(const Motor& motor, const Experiment& e) {
  const Discrete step = discrete(motor, e);
  std::mt19937_64 random(e.seed);
  std::normal_distribution<double> normal;
  const std::complex<double> axis = std::polar(1.0, e.axis_rad);
  TimeSeries out;
  out.sample_time_s = e.sample_time_s;
  out.voltage_filter_s = e.filter_s;
  Eigen::Vector3d x = Eigen::Vector3d::Zero();
  double u = 0.0, integral = 0.0;
  const auto n = static_cast<std::size_t>(e.seconds / e.sample_time_s);
  for (std::size_t k = 0; k < n; ++k) {
    const double t = static_cast<double>(k) * e.sample_time_s;
    const std::complex<double> i_noise(e.current_noise_A * normal(random),
                                       e.current_noise_A * normal(random));
    const std::complex<double> v_noise(e.voltage_noise_V * normal(random),
                                       e.voltage_noise_V * normal(random));
    const double seen_A = x[0] + i_noise.real();
    const double v = e.filter_s > 0.0 ? x[2] : u;  // without a filter: the voltage that has acted until here
    out.i.push_back(axis * (x[0] + e.current_zero_A + i_noise));
    out.v.push_back(axis * (v + e.voltage_zero_V + v_noise));
    out.speed_rad_s.push_back(0.0);
    if (k % static_cast<std::size_t>(e.regulator_every) == 0) {
      double wanted = e.offset_A;
      for (const Tone& tone : e.tones) wanted += tone.amplitude_A * std::sin(tone.w_rad_s * t);
      integral += e.ki * (wanted - seen_A) * e.sample_time_s * e.regulator_every;
      u = e.kp * (wanted - seen_A) + integral;
    }
    x = step.F * x + step.g * u;
  }
  return out;
}

}  // namespace imrig::est::standing
