#pragma once
// The network of Proca and Keyhani 2002, (16)-(17): two inputs, one layer of tanh, one linear output,
//   y = W_2 tanh(W_1 x + B_1) + B_2
// on inputs and output scaled to zero mean and unit deviation. Trained on the mean squared error with a small
// weight decay by NLopt's L-BFGS with exact gradients (back-propagation), from several seeded starts; the best
// is kept. Same input, same bits.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace imrig::est {

struct TanhNetwork {
  Eigen::MatrixXd W_1;  // hidden x 2
  Eigen::VectorXd B_1;  // hidden
  Eigen::RowVectorXd W_2;
  double B_2 = 0.0;
  Eigen::Vector2d input_mean = Eigen::Vector2d::Zero(), input_scale = Eigen::Vector2d::Ones();
  double output_mean = 0.0, output_scale = 1.0;
  double at(double x_0, double x_1) const;
};

struct TrainingOptions {
  int hidden = 4;
  int starts = 8;
  int evaluations = 2000;  // a start
  double decay = 1e-5;
  std::uint64_t seed = 1;
};

// x: n x 2, y: n. Throws Error with fewer points than a tenth of the weights, or none that vary.
TanhNetwork train(const Eigen::MatrixXd& x, const Eigen::VectorXd& y, const TrainingOptions& options = {});

}  // namespace imrig::est
