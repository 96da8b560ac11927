#pragma once
// The least-squares problem behind fit_points: residuals of each point in units of its noise, with the
// point's true speed eliminated.

#include <Eigen/Core>
#include <vector>

#include "estimators/model/steady_state.h"
#include "rig/data/record.h"

namespace imrig::est {

struct PointsLinearization {
  double error = 0.0;                                  // chi^2
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();    // in theta, speeds eliminated
  Eigen::Vector4d gradient = Eigen::Vector4d::Zero();  // half the gradient of chi^2
  std::size_t residuals = 0;  // those that measurements give, without the speeds' own
};

class PointsProblem {
 public:
  // Points must have voltage, frequency and speed; noise must be complete.
  PointsProblem(std::vector<SteadyPoint> points, const Noise& noise, int pole_pairs);

  const std::vector<SteadyPoint>& points() const { return points_; }
  int pole_pairs() const { return pole_pairs_; }
  const Noise& noise() const { return noise_; }

  // Sum over the points at their best speeds.
  PointsLinearization linearize(const MachineParameters<double>& theta) const;

  // Best shift of a point's mechanical speed, rad/s.
  double speed_shift(const MachineParameters<double>& theta, const SteadyPoint& point) const;

 private:
  std::vector<SteadyPoint> points_;
  Noise noise_;
  int pole_pairs_;
};

}  // namespace imrig::est
