#include "estimators/fit/global/settle.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "estimators/model/effects/registry.h"

namespace imrig::est {

namespace {

constexpr int kMostRounds = 25;
constexpr double kEnough = 1e-6, kEnoughAbsolute = 1e-3;  // of chi2: a step that wins less is the last
constexpr double kTurning_rad_s = 30.0;                   // field below which a voltage tells no flux

// Gauss and Newton's step, and what it promises to take from chi2.
struct Move {
  LocalVector<double> to;
  double promise = 0.0;
};

Move move_of(const LocalVector<double>& from, const std::vector<std::size_t>& free, const RecordTerms& terms,
             double damping) {
  Eigen::MatrixXd D = terms.normal;
  D.diagonal() *= 1.0 + damping + 1e-12;
  D.diagonal().array() += 1e-12;
  const Eigen::VectorXd step = bounded_step(D, terms.gradient, free, from);
  Move out{from, -step.dot(terms.gradient)};
  for (std::size_t m = 0; m < free.size(); ++m) out.to[free[m]] += step[static_cast<Eigen::Index>(m)];
  return out;
}

// Fluxes that were never estimated start from those of a steady state at the first sample.
void guess_fluxes(const FrameRecord& frame, const SharedVector<double>& shared, LocalVector<double>& local) {
  if (std::any_of(local.begin(), local.begin() + kStates, [](double x) { return x != 0.0; })) return;
  if (std::abs(frame.w_k) < kTurning_rad_s || frame.size() == 0) return;
  const std::complex<double> stator =
      (frame.v[0] - shared[0] * frame.i[0]) / std::complex<double>(0.0, frame.w_k);
  const std::complex<double> rotor = stator - shared[2] * frame.i[0];
  local[0] = stator.real(), local[1] = stator.imag();
  local[2] = rotor.real(), local[3] = rotor.imag();
}

// Of what is physically possible, or of a rounding; infinite for the initial state.
double local_prior_sigma(std::size_t entry) {
  static const std::size_t rounding = kLocalPlace[*effect_number("speed_bias")];
  if (entry < kStates) return std::numeric_limits<double>::infinity();
  return entry == rounding ? 1.0 : 0.2;
}

}  // namespace

void add_local_priors(const std::vector<std::size_t>& free, const LocalVector<double>& x, Eigen::Index first,
                      RecordTerms& terms) {
  for (std::size_t m = 0; m < free.size(); ++m) {
    const double sigma = local_prior_sigma(free[m]);
    if (!std::isfinite(sigma)) continue;
    const auto d = first + static_cast<Eigen::Index>(m);
    const double off = x[free[m]] / sigma;
    terms.chi2 += off * off;
    terms.normal(d, d) += 1.0 / (sigma * sigma);
    terms.gradient[d] += off / sigma;
    const EffectParameter& p = local_parameter(free[m]);
    const double close = 1e-9 * (p.high - p.low);  // a step ends an ulp inside at times
    const bool held = (x[free[m]] <= p.low + close && terms.gradient[d] > 0.0) ||
                      (x[free[m]] >= p.high - close && terms.gradient[d] < 0.0);
    if (!held) continue;
    terms.normal.row(d).setZero();
    terms.normal.col(d).setZero();
    terms.normal(d, d) = 1.0;
    terms.gradient[d] = 0.0;
  }
}

Eigen::VectorXd bounded_step(const Eigen::MatrixXd& D, const Eigen::VectorXd& g,
                             const std::vector<std::size_t>& free, const LocalVector<double>& x) {
  const auto n = g.size();
  Eigen::VectorXd low = Eigen::VectorXd::Constant(n, -std::numeric_limits<double>::infinity()), high = -low;
  for (Eigen::Index d = 0; d < n; ++d) {
    const std::size_t entry = free[static_cast<std::size_t>(d)];
    if (entry < kStates) continue;
    low[d] = local_parameter(entry).low - x[entry];
    high[d] = local_parameter(entry).high - x[entry];
  }
  std::vector<bool> held(static_cast<std::size_t>(n), false);
  Eigen::VectorXd step = Eigen::VectorXd::Zero(n);
  const auto solve = [&] {
    Eigen::MatrixXd A = D;
    Eigen::VectorXd b = -g;
    for (Eigen::Index d = 0; d < n; ++d) {
      if (!held[static_cast<std::size_t>(d)]) continue;
      b -= step[d] * A.col(d);
      A.row(d).setZero(), A.col(d).setZero();
      A(d, d) = 1.0;
    }
    for (Eigen::Index d = 0; d < n; ++d) {
      if (held[static_cast<std::size_t>(d)]) b[d] = step[d];
    }
    step = A.ldlt().solve(b);
  };
  solve();
  for (Eigen::Index round = 0; round < 4 * n; ++round) {
    // Outside its bound the farthest, else held where it would rather go back.
    Eigen::Index worst = -1;
    double most = 0.0;
    for (Eigen::Index d = 0; d < n; ++d) {
      const double inside = std::clamp(step[d], low[d], high[d]);
      const double beyond = std::abs(step[d] - inside) * std::sqrt(std::max(0.0, D(d, d)));
      if (!held[static_cast<std::size_t>(d)] && beyond > most) worst = d, most = beyond;
    }
    if (worst >= 0) {
      held[static_cast<std::size_t>(worst)] = true;
      step[worst] = std::clamp(step[worst], low[worst], high[worst]);
    } else {
      const Eigen::VectorXd slope = D * step + g;
      for (Eigen::Index d = 0; d < n; ++d) {
        const double back = step[d] <= low[d] ? -slope[d] : slope[d];
        const double gain = back / std::sqrt(std::max(1e-300, D(d, d)));
        if (held[static_cast<std::size_t>(d)] && gain > most) worst = d, most = gain;
      }
      if (worst < 0) break;
      held[static_cast<std::size_t>(worst)] = false;
    }
    solve();
  }
  return step.cwiseMax(low).cwiseMin(high);
}

void settle_record(const DrivenRecord& record, const Whitener& whitener, int steps,
                   const SharedVector<double>& shared, const std::vector<std::size_t>& free,
                   LocalVector<double>& local) {
  guess_fluxes(record.frame, shared, local);
  LocalVector<double> x = local;
  RecordTerms best;
  best.chi2 = std::numeric_limits<double>::infinity();
  double damping = 0.0;
  for (int round = 0; round < kMostRounds; ++round) {
    RecordTerms terms = record_terms(record, whitener, steps, shared, x, {{}, free});
    add_local_priors(free, x, 0, terms);
    if (std::isfinite(terms.chi2) && terms.chi2 < best.chi2) {
      const double won = best.chi2 - terms.chi2;
      best = std::move(terms);
      local = x;
      damping = damping < 1e-5 ? 0.0 : 0.1 * damping;
      if (won < kEnough * best.chi2 + kEnoughAbsolute) return;
    } else {
      if (best.gradient.size() == 0 || damping > 1e6) return;
      damping = damping == 0.0 ? 1e-3 : 10.0 * damping;
    }
    const Move next = move_of(local, free, best, damping);
    x = next.to;
    if (damping == 0.0 && next.promise < kEnough * best.chi2 + kEnoughAbsolute) {
      local = x;
      return;
    }
  }
}

}  // namespace imrig::est
