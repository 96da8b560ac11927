#pragma once
// The least-squares problem of a standstill record: residual of the current over ln theta, both initial
// fluxes and a constant current, with exact derivatives by the circuit, summed block by block.

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "estimators/fit/standstill/axis_record.h"
#include "estimators/fit/standstill/standstill_fit.h"

namespace imrig::est::standstill {

inline constexpr int kTheta = static_cast<int>(kStandstillParameters);
inline constexpr int kAll = kTheta + 3;  // ln theta, psi_s(0), psi_r(0), constant current

using Vector = Eigen::Matrix<double, kAll, 1>;
using Matrix = Eigen::Matrix<double, kAll, kAll>;
using Vector4 = Eigen::Matrix<double, kTheta, 1>;
using Matrix4 = Eigen::Matrix<double, kTheta, kTheta>;

// Sums over a stretch of samples: of the Jacobian's products, of its products with the residual, of r^2.
struct Sums {
  Matrix H = Matrix::Zero();
  Vector g = Vector::Zero();
  double cost = 0.0;
  std::size_t n = 0;
  void add(const Vector& row, double r) {
    H.selfadjointView<Eigen::Lower>().rankUpdate(row);
    g += row * r;
    cost += r * r;
    ++n;
  }
  Sums& operator+=(const Sums& other) {
    H += other.H;
    g += other.g;
    cost += other.cost;
    n += other.n;
    return *this;
  }
};

struct Point {
  Vector4 log_theta = Vector4::Zero();
  double psi_s = 0.0, psi_r = 0.0, constant = 0.0;
  Point moved(const Vector& step) const {
    return {log_theta + step.head<kTheta>(), psi_s + step[4], psi_r + step[5], constant + step[6]};
  }
};

MachineParameters<double> theta_of(const Point& p);
Point point_of(const MachineParameters<double>& p);

// Whether the sample time is short enough for standstill_response.h.
bool steppable(const MachineParameters<double>& p, double h);

// Residual and Jacobian over the first n samples, summed per block; residuals also in `kept` where wanted.
std::vector<Sums> evaluate(const AxisRecord& record, const Point& at, std::size_t n, std::size_t blocks,
                           std::vector<double>* kept = nullptr);

Sums whole(const std::vector<Sums>& blocks);

// Solves in columns of equal length: volts, webers and ampere do not mix well otherwise.
struct Scaled {
  Vector scale;
  Eigen::LDLT<Matrix> solver;
  Scaled(const Matrix& H, double damping) {
    for (int k = 0; k < kAll; ++k) scale[k] = 1.0 / std::sqrt(std::max(H(k, k), 1e-300));
    Matrix S = scale.asDiagonal() * H * scale.asDiagonal();
    S.diagonal().array() += damping;
    solver.compute(S);
  }
  Vector solve(const Vector& right) const {
    return scale.cwiseProduct(solver.solve(scale.cwiseProduct(right)));
  }
  Matrix inverse() const {
    const Matrix S = solver.solve(Matrix::Identity());
    return scale.asDiagonal() * S * scale.asDiagonal();
  }
};

// R_s from elsewhere: weight (ln R_s - value)^2 is added to the cost.
struct Prior {
  double log_R_s = 0.0;
  double weight = 0.0;
  Sums with(Sums sums, const Point& at) const {
    const double off = at.log_theta[0] - log_R_s;
    sums.H(0, 0) += weight;
    sums.g[0] += weight * off;
    sums.cost += weight * off * off;
    return sums;
  }
};

}  // namespace imrig::est::standstill
