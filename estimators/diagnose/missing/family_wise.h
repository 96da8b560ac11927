#pragma once
// How likely it is that noise alone makes the largest of many scores: family-wise p-values without a word about
// the noise's distribution or colour. Data are cut into blocks (stretches of records); u_b is a candidate's
// gradient over block b with the free parameters projected out, and
//   T = s' V^-1 s,  s = sum of u_b,  V = sum of u_b u_b'
// With nothing missing a block's gradient may as well have the other sign, so random signs draw from the
// distribution of the largest T over all candidates. Wu 1986 and Liu 1988, Annals of Statistics (wild bootstrap);
// Romano and Wolf 2005, JASA (the largest of many).

#include <Eigen/Core>
#include <vector>

namespace imrig::est {

// Gradients of one candidate, its amplitudes in rows, blocks in columns.
using BlockScores = Eigen::MatrixXd;

// T of each candidate: 0 where its V cannot be inverted.
std::vector<double> block_statistics(const std::vector<BlockScores>& candidates);

// Share of draws whose largest T reaches that of each candidate; blocks of all candidates must be the same ones.
// The smallest value is 1/(draws + 1).
std::vector<double> family_wise_p(const std::vector<BlockScores>& candidates, int draws = 999);

}  // namespace imrig::est
