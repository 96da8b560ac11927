#include "estimators/diagnose/missing/family_wise.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <random>

namespace imrig::est {

namespace {

constexpr std::uint64_t kSeed = 1;

// Rows that make V the unit matrix, so that T is a plain square; no rows where V is singular.
Eigen::MatrixXd whitened(const BlockScores& u) {
  const Eigen::MatrixXd V = u * u.transpose();
  const Eigen::LLT<Eigen::MatrixXd> llt(V);
  if (V.size() == 0 || llt.info() != Eigen::Success || !(V.diagonal().minCoeff() > 0.0)) return {};
  return llt.matrixL().solve(u);
}

}  // namespace

std::vector<double> block_statistics(const std::vector<BlockScores>& candidates) {
  std::vector<double> out;
  for (const BlockScores& u : candidates) {
    const Eigen::MatrixXd w = whitened(u);
    out.push_back(w.size() == 0 ? 0.0 : w.rowwise().sum().squaredNorm());
  }
  return out;
}

std::vector<double> family_wise_p(const std::vector<BlockScores>& candidates, int draws) {
  const std::vector<double> T = block_statistics(candidates);
  std::vector<Eigen::MatrixXd> w;
  for (const BlockScores& u : candidates) {
    w.push_back(whitened(u));
    if (w.back().size() == 0) w.pop_back();
  }
  std::vector<int> reached(candidates.size(), 0);
  std::mt19937_64 bits(kSeed);
  const Eigen::Index blocks = w.empty() ? 0 : w.front().cols();
  Eigen::VectorXd sign(blocks);
  for (int n = 0; n < draws; ++n) {
    for (Eigen::Index b = 0; b < blocks; ++b) sign[b] = (bits() >> 63) != 0 ? 1.0 : -1.0;
    double largest = 0.0;
    for (const Eigen::MatrixXd& x : w) largest = std::max(largest, (x * sign).squaredNorm());
    for (std::size_t c = 0; c < T.size(); ++c) reached[c] += largest >= T[c] ? 1 : 0;
  }
  std::vector<double> out;
  for (const int r : reached) out.push_back((1.0 + r) / (1.0 + draws));
  return out;
}

}  // namespace imrig::est
