#pragma once
// Sums over windows of measured shaft torque (torque_windows.h): errors e = model - measured over their
// sigma, and what a gain and an offset of the transducer inside their accuracy may take of them:
//   chi2_beside = min over g, o of  sum ((e - g T - o)/sigma)^2 + (g/sigma_g)^2 + (o/sigma_o)^2.

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>
#include <limits>

namespace imrig::est {

// What the zero of a torque bridge is good for, of its range.
inline constexpr double kTorqueZero = 5e-4;

// One sigma of what a torque transducer may be off by everywhere.
struct TransducerAccuracy {
  double gain = 0.002;  // class 0.2
  double zero_Nm = 0.0;
};

class TorqueSums {
 public:
  void add(double error_Nm, double measured_Nm, double sigma_Nm) {
    const Eigen::Vector2d by(measured_Nm / sigma_Nm, 1.0 / sigma_Nm);
    const double error = error_Nm / sigma_Nm;
    chi2_ += error * error;
    error2_ += error_Nm * error_Nm;
    along_ += error * by;
    normal_ += by * by.transpose();
    values_ += 1.0;
  }
  void add(const TorqueSums& more) {
    chi2_ += more.chi2_, error2_ += more.error2_, values_ += more.values_;
    along_ += more.along_, normal_ += more.normal_;
  }

  double values() const { return values_; }
  double rmse_Nm() const {  // NaN without any
    return values_ > 0.0 ? std::sqrt(error2_ / values_) : std::numeric_limits<double>::quiet_NaN();
  }
  double chi2_beside(const TransducerAccuracy& accuracy) const {
    const Eigen::Vector2d known(std::pow(accuracy.gain, -2), std::pow(accuracy.zero_Nm, -2));
    const Eigen::Matrix2d H = normal_ + Eigen::Matrix2d(known.asDiagonal());
    return values_ > 0.0 ? chi2_ - along_.dot(H.ldlt().solve(along_)) : 0.0;
  }

 private:
  double chi2_ = 0.0, error2_ = 0.0, values_ = 0.0;
  Eigen::Vector2d along_ = Eigen::Vector2d::Zero();
  Eigen::Matrix2d normal_ = Eigen::Matrix2d::Zero();
};

}  // namespace imrig::est
