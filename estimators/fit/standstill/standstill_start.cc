#include "estimators/fit/standstill/standstill_start.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "estimators/fit/standstill/parametric.h"

namespace imrig::est {

namespace {

// x/(s + rate), x on straight lines between samples, exactly.
class FirstOrder {
 public:
  FirstOrder(double rate, double h) {
    decay_ = std::exp(-rate * h);
    const double slope = (1.0 - decay_) / (rate * h);
    old_ = (slope - decay_) / rate;
    fresh_ = (1.0 - slope) / rate;
  }
  double take(double x) {
    if (!started_) last_ = x;
    started_ = true;
    y_ = decay_ * y_ + old_ * last_ + fresh_ * x;
    last_ = x;
    return y_;
  }

 private:
  double decay_, old_, fresh_;
  double y_ = 0.0, last_ = 0.0;
  bool started_ = false;
};

constexpr double kForgotten = 5.0;  // time constants of the slower filter that are left out

std::optional<MachineParameters<double>> least_squares_start(const AxisRecord& r,
                                                             const StandstillFilters& h) {
  FirstOrder u_1(h.h_1, r.sample_time_s), u_0(h.h_0, r.sample_time_s), i_1(h.h_1, r.sample_time_s),
      i_0(h.h_0, r.sample_time_s);
  const auto skipped = static_cast<std::size_t>(kForgotten / h.h_0 / r.sample_time_s);
  using Row = Eigen::Matrix<double, 5, 1>;  // and a constant, for the sensors' zeros
  Eigen::Matrix<double, 5, 5> normal = Eigen::Matrix<double, 5, 5>::Zero();
  Row right = Row::Zero();
  for (std::size_t k = 0; k < r.size(); ++k) {
    Row row;
    row << u_1.take(r.u[k]), u_0.take(r.u[k]), i_1.take(r.i[k]), i_0.take(r.i[k]), 1.0;
    if (k < skipped) continue;
    normal += row * row.transpose();
    right += row * r.i[k];
  }
  const Row c = normal.ldlt().solve(right);
  const auto circuit = circuit_of({c[0], c[1], c[2], c[3]}, h);
  if (!circuit) return std::nullopt;
  return inverse_gamma_of(*circuit);
}

double rms(const std::vector<double>& x) {
  double sum = 0.0, square = 0.0;
  for (const double v : x) {
    sum += v;
    square += v * v;
  }
  const auto n = static_cast<double>(x.size());
  return std::sqrt(std::max(0.0, square / n - sum * sum / (n * n)));
}

}  // namespace

std::vector<MachineParameters<double>> standstill_starts(const AxisRecord& record) {
  std::vector<MachineParameters<double>> starts;
  // Slow filters for large motors, fast ones for small.
  for (const double scale : {1.0, 0.3, 3.0}) {
    const auto start = least_squares_start(record, {40.0 * scale, 160.0 * scale});
    if (start) starts.push_back(*start);
  }
  if (!starts.empty()) return starts;
  const double ohm = rms(record.u) / rms(record.i);
  for (const double share : {0.3, 0.6}) {
    for (const double leakage_s : {0.003, 0.01, 0.03}) {
      for (const double rotor_s : {0.1, 0.4}) {
        const double R_r = (0.9 - share) * ohm;
        starts.push_back({share * ohm, R_r, leakage_s * ohm, rotor_s * R_r});
      }
    }
  }
  return starts;
}

}  // namespace imrig::est
