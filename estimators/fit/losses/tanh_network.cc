#include "estimators/fit/losses/tanh_network.h"

#include <cmath>
#include <limits>
#include <nlopt.hpp>
#include <random>

#include "rig/base/error.h"

namespace imrig::est {

namespace {

constexpr Eigen::Index kFewestPoints = 6;

// Weights in one vector: W_1 by columns, B_1, W_2, B_2.
struct Problem {
  Eigen::MatrixXd x;  // 2 x n, scaled
  Eigen::RowVectorXd y;
  Eigen::Index hidden = 0;
  double decay = 0.0;
  Eigen::Index size() const { return 4 * hidden + 1; }

  double error(const double* weights, double* gradient) const {
    const Eigen::Map<const Eigen::MatrixXd> W_1(weights, hidden, 2);
    const Eigen::Map<const Eigen::VectorXd> B_1(weights + 2 * hidden, hidden);
    const Eigen::Map<const Eigen::RowVectorXd> W_2(weights + 3 * hidden, hidden);
    const double n = static_cast<double>(y.size());
    const Eigen::MatrixXd layer = ((W_1 * x).colwise() + B_1).array().tanh();
    const Eigen::RowVectorXd left = (W_2 * layer).array() + weights[4 * hidden] - y.array();
    if (gradient != nullptr) {
      const Eigen::MatrixXd back = (W_2.transpose() * left).array() * (1.0 - layer.array().square());
      Eigen::Map<Eigen::MatrixXd>(gradient, hidden, 2) = 2.0 / n * back * x.transpose() + 2.0 * decay * W_1;
      Eigen::Map<Eigen::VectorXd>(gradient + 2 * hidden, hidden) = 2.0 / n * back.rowwise().sum();
      Eigen::Map<Eigen::RowVectorXd>(gradient + 3 * hidden, hidden) =
          2.0 / n * left * layer.transpose() + 2.0 * decay * W_2;
      gradient[4 * hidden] = 2.0 / n * left.sum();
    }
    return left.squaredNorm() / n + decay * (W_1.squaredNorm() + W_2.squaredNorm());
  }
};

double objective(unsigned, const double* weights, double* gradient, void* problem) {
  return static_cast<const Problem*>(problem)->error(weights, gradient);
}

// The standard generator's bits are specified, its normal distribution's are not.
double uniform(std::mt19937_64& bits) {
  return 2.0 * static_cast<double>(bits() >> 11) * 0x1p-53 - 1.0;
}

double deviation(const Eigen::VectorXd& x) {
  return std::sqrt((x.array() - x.mean()).square().mean());
}

}  // namespace

double TanhNetwork::at(double x_0, double x_1) const {
  const Eigen::Vector2d x = (Eigen::Vector2d(x_0, x_1) - input_mean).cwiseQuotient(input_scale);
  const Eigen::VectorXd layer = (W_1 * x + B_1).array().tanh();
  return output_mean + output_scale * (W_2.dot(layer) + B_2);
}

TanhNetwork train(const Eigen::MatrixXd& x, const Eigen::VectorXd& y, const TrainingOptions& options) {
  if (x.rows() < kFewestPoints) throw Error("network", "has too few points to train on");
  TanhNetwork net;
  net.output_mean = y.mean();
  net.output_scale = deviation(y);
  Problem problem;
  problem.hidden = options.hidden;
  problem.decay = options.decay;
  problem.x.resize(2, x.rows());
  for (Eigen::Index k = 0; k < 2; ++k) {
    net.input_mean[k] = x.col(k).mean();
    net.input_scale[k] = deviation(x.col(k));
    if (!(net.input_scale[k] > 0.0)) throw Error("network", "has an input that never changes");
    problem.x.row(k) = (x.col(k).array() - net.input_mean[k]) / net.input_scale[k];
  }
  if (!(net.output_scale > 0.0)) throw Error("network", "has an output that never changes");
  problem.y = (y.array() - net.output_mean) / net.output_scale;

  std::mt19937_64 bits(options.seed);
  std::vector<double> best(static_cast<std::size_t>(problem.size()));
  double least = std::numeric_limits<double>::infinity();
  for (int start = 0; start < options.starts; ++start) {
    std::vector<double> weights(best.size());
    for (double& w : weights) w = uniform(bits);
    nlopt::opt search(nlopt::LD_LBFGS, static_cast<unsigned>(weights.size()));
    search.set_min_objective(objective, &problem);
    search.set_maxeval(options.evaluations);
    search.set_ftol_rel(1e-10);
    double error = 0.0;
    try {
      search.optimize(weights, error);
    } catch (const std::runtime_error&) {
      error = problem.error(weights.data(), nullptr);  // rounding ends the line search: what was reached counts
    }
    if (error < least) {
      least = error;
      best = weights;
    }
  }
  const Eigen::Index h = problem.hidden;
  net.W_1 = Eigen::Map<const Eigen::MatrixXd>(best.data(), h, 2);
  net.B_1 = Eigen::Map<const Eigen::VectorXd>(best.data() + 2 * h, h);
  net.W_2 = Eigen::Map<const Eigen::RowVectorXd>(best.data() + 3 * h, h);
  net.B_2 = best.back();
  return net;
}

}  // namespace imrig::est
