#include "estimators/diagnose/missing/score_test.h"

#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <optional>

#include "estimators/diagnose/missing/family_wise.h"
#include "estimators/model/effects/registry.h"

namespace imrig::est {

namespace {

std::vector<std::size_t> amplitudes_of(const Candidate& candidate) {
  std::vector<std::size_t> out;
  for (const std::size_t e : shared_entries(candidate)) {
    if (shared_parameter(e).role == Role::kAmplitude) out.push_back(e);
  }
  return out;
}

bool one_sided(std::size_t entry) { return shared_parameter(entry).low >= shared_parameter(entry).neutral; }

Eigen::MatrixXd solve_spd(const Eigen::MatrixXd& H, const Eigen::MatrixXd& B) {
  if (B.size() == 0) return B;
  const Eigen::VectorXd s = H.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd scaled = s.asDiagonal() * H * s.asDiagonal();
  scaled.diagonal().array() += 1e-11;
  return s.asDiagonal() * scaled.ldlt().solve(s.asDiagonal() * B);
}

// Sums with the free parameters projected out, over a list of amplitudes.
struct Projected {
  std::vector<std::size_t> entries;
  Eigen::MatrixXd M;
  Eigen::VectorXd g;
  Eigen::MatrixXd blocks;  // g by stretches of records
};

// Gradients over the stretches of all records, their own unknowns eliminated: shared entries x blocks.
Eigen::MatrixXd block_gradients(const std::vector<RecordTerms>& records, Eigen::Index shared) {
  std::vector<Eigen::MatrixXd> parts;
  Eigen::Index columns = 0;
  for (const RecordTerms& r : records) {
    Eigen::MatrixXd g = r.stretch_gradient.size() > 0 ? r.stretch_gradient : Eigen::MatrixXd(r.gradient);
    const Eigen::Index l = g.rows() - shared;
    Eigen::MatrixXd own = g.topRows(shared);
    if (l > 0)
      own -= r.normal.topRightCorner(shared, l) *
             solve_spd(r.normal.bottomRightCorner(l, l), g.bottomRows(l));
    columns += own.cols();
    parts.push_back(std::move(own));
  }
  Eigen::MatrixXd out(shared, columns);
  columns = 0;
  for (const Eigen::MatrixXd& part : parts) {
    out.middleCols(columns, part.cols()) = part;
    columns += part.cols();
  }
  return out;
}

// terms: first those that are projected out, last the entries; what lies between is left out.
Projected project(const GlobalTerms& terms, std::size_t free, const std::vector<std::size_t>& entries) {
  const auto f = static_cast<Eigen::Index>(free), c = static_cast<Eigen::Index>(entries.size());
  const Eigen::MatrixXd H_fc = terms.normal.topRightCorner(f, c);
  const Eigen::MatrixXd X = solve_spd(terms.normal.topLeftCorner(f, f), H_fc);
  Projected out;
  out.entries = entries;
  out.M = terms.normal.bottomRightCorner(c, c) - H_fc.transpose() * X;
  out.g = terms.gradient.tail(c) - X.transpose() * terms.gradient.head(f);
  const Eigen::MatrixXd blocks = block_gradients(terms.records, terms.normal.rows());
  out.blocks = blocks.bottomRows(c) - X.transpose() * blocks.topRows(f);
  return out;
}

std::vector<Eigen::Index> places(const Projected& p, const std::vector<std::size_t>& entries) {
  std::vector<Eigen::Index> out;
  for (const std::size_t e : entries)
    out.push_back(std::find(p.entries.begin(), p.entries.end(), e) - p.entries.begin());
  return out;
}

Eigen::MatrixXd block(const Eigen::MatrixXd& M, const std::vector<Eigen::Index>& rows,
                      const std::vector<Eigen::Index>& columns) {
  Eigen::MatrixXd out(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(columns.size()));
  for (Eigen::Index a = 0; a < out.rows(); ++a) {
    for (Eigen::Index b = 0; b < out.cols(); ++b)
      out(a, b) = M(rows[static_cast<std::size_t>(a)], columns[static_cast<std::size_t>(b)]);
  }
  return out;
}

// lambda over a set of amplitudes, or nothing where the data say nothing of one of them.
Score score_of(const Projected& p, const Candidate& candidate, const std::vector<std::size_t>& entries,
               const Eigen::MatrixXd& whole) {
  Score out;
  out.candidate = candidate;
  out.dof = static_cast<double>(entries.size());
  out.amplitudes = entries;
  const auto rows = places(p, entries);
  for (const Eigen::Index r : rows) {
    if (!(p.M(r, r) > 1e-9 * whole(r, r))) return out;
  }
  const Eigen::MatrixXd M = block(p.M, rows, rows);
  Eigen::VectorXd g(M.rows());
  for (Eigen::Index a = 0; a < g.size(); ++a) g[a] = p.g[rows[static_cast<std::size_t>(a)]];
  const Eigen::MatrixXd inverse = solve_spd(M, Eigen::MatrixXd::Identity(M.rows(), M.cols()));
  const Eigen::VectorXd change = -inverse * g;
  for (Eigen::Index a = 0; a < g.size(); ++a) {
    out.change.push_back(change[a]);
    out.sigma.push_back(std::sqrt(std::max(0.0, inverse(a, a))));
  }
  for (std::size_t a = 0; a < entries.size(); ++a) {
    if (one_sided(entries[a]) && out.change[a] < 0.0)
      return out;  // the plainer forms are tested by themselves
  }
  out.lambda = g.dot(inverse * g);
  return out;
}

Score score_of_local(const GlobalProblem& problem, const WorkingModel& model, const Candidate& candidate,
                     const std::vector<std::size_t>& which, double base_drop) {
  Score out;
  out.candidate = candidate;
  Freedom free = model.freedom();
  const auto extra = local_entries(candidate);
  free.local.insert(free.local.end(), extra.begin(), extra.end());
  const GlobalTerms terms = problem.evaluate(model.at, free, which, model.live_priors());
  // Drop of chi2 with everything free, less what the free parameters alone would bring.
  double drop = 0.0;
  for (std::size_t k = 0; k < which.size(); ++k) {
    const auto l = static_cast<Eigen::Index>(problem.locals_of(which[k], free.local).size());
    if (l == 0) continue;
    const RecordTerms& r = terms.records[k];
    const Eigen::MatrixXd D = r.normal.bottomRightCorner(l, l);
    drop += r.gradient.tail(l).dot(solve_spd(D, r.gradient.tail(l)).col(0));
    out.dof += static_cast<double>(extra.size());
  }
  drop += terms.gradient.dot(solve_spd(terms.normal, terms.gradient).col(0));
  out.lambda = std::max(0.0, drop - base_drop);
  return out;
}

// A sensor error that is free inside its accuracy: how far it stretches that accuracy.
std::optional<Score> score_of_admitted(const WorkingModel& model, const Candidate& candidate) {
  const auto entries = amplitudes_of(candidate);
  if (entries.empty() ||
      std::find(model.nuisances.begin(), model.nuisances.end(), entries.front()) == model.nuisances.end())
    return std::nullopt;
  Score out;
  out.candidate = candidate;
  out.dof = static_cast<double>(entries.size());
  out.amplitudes = entries;
  for (const std::size_t e : entries) {
    for (const Prior& p : model.priors) {
      if (p.entry != e) continue;
      const double off = model.at.shared[e] - p.value;
      out.lambda += off * off / (p.sigma * p.sigma);
      out.change.push_back(off);
      out.sigma.push_back(p.sigma);
    }
  }
  return out;
}

// What the free parameters by themselves would still win: close to nothing at a minimum.
double base_drop(const GlobalProblem& problem, const WorkingModel& model,
                 const std::vector<std::size_t>& which) {
  const Freedom free = model.freedom();
  const GlobalTerms terms = problem.evaluate(model.at, free, which, model.live_priors());
  double drop = terms.gradient.dot(solve_spd(terms.normal, terms.gradient).col(0));
  for (std::size_t k = 0; k < which.size(); ++k) {
    const auto l = static_cast<Eigen::Index>(problem.locals_of(which[k], free.local).size());
    if (l == 0) continue;
    const RecordTerms& r = terms.records[k];
    drop += r.gradient.tail(l).dot(solve_spd(r.normal.bottomRightCorner(l, l), r.gradient.tail(l)).col(0));
  }
  return drop;
}

// The gradients of a candidate's amplitudes over blocks.
BlockScores blocks_of(const Projected& p, const Score& score) {
  const auto rows = places(p, score.amplitudes);
  BlockScores out(static_cast<Eigen::Index>(rows.size()), p.blocks.cols());
  for (std::size_t k = 0; k < rows.size(); ++k) out.row(static_cast<Eigen::Index>(k)) = p.blocks.row(rows[k]);
  return out;
}

// Of scores whose shapes were scanned, every scan counts as a candidate.
void add_p_values(const std::vector<Projected>& scans, std::vector<Score>& scores) {
  std::vector<BlockScores> candidates;
  for (const Projected& p : scans) {
    for (const Score& s : scores) candidates.push_back(blocks_of(p, s));
  }
  const auto p_values = family_wise_p(candidates);
  for (std::size_t k = 0; k < scores.size(); ++k) {
    // The random signs do not know that an amplitude cannot be negative.
    if (scores[k].lambda > 0.0) scores[k].p_value = p_values[scores[k].scan * scores.size() + k];
  }
}

// Cosine of the smallest angle between the spaces that two sets of amplitudes span.
double cosine_of(const Projected& p, const Score& a, const Score& b) {
  const auto rows = places(p, a.amplitudes), columns = places(p, b.amplitudes);
  const Eigen::MatrixXd A = block(p.M, rows, rows), B = block(p.M, columns, columns),
                        C = block(p.M, rows, columns);
  const Eigen::LLT<Eigen::MatrixXd> la(A), lb(B);
  if (la.info() != Eigen::Success || lb.info() != Eigen::Success) return 0.0;
  Eigen::MatrixXd X = la.matrixL().solve(C);
  X = lb.matrixL().solve(X.transpose()).transpose();
  return std::min(1.0, Eigen::JacobiSVD<Eigen::MatrixXd>(X).singularValues()[0]);
}

}  // namespace

SharedVector<double> scanned(const WorkingModel& model, std::size_t n) {
  SharedVector<double> out = model.at.shared;
  for (std::size_t e = kBase; e < kShared; ++e) {
    const EffectParameter& p = shared_parameter(e);
    if (p.role != Role::kShape || p.scan.empty() || model.has(effect_of_shared(e))) continue;
    out[e] = p.scan[std::min(n, p.scan.size() - 1)];
  }
  return out;
}

double ScoreTest::separation(std::size_t a, std::size_t b) const {
  const auto x = static_cast<Eigen::Index>(a), y = static_cast<Eigen::Index>(b);
  return std::sqrt(std::max(scores[a].lambda, scores[b].lambda)) *
         std::sin(0.5 * std::acos(std::min(1.0, cosine(x, y))));
}

ScoreTest score_test(const GlobalProblem& problem, const WorkingModel& model,
                     const std::vector<Candidate>& candidates, const std::vector<std::size_t>& which) {
  ScoreTest out;
  Freedom free = model.freedom();
  const std::size_t fixed = free.shared.size();
  std::vector<std::size_t> entries;
  std::vector<Score> admitted;
  for (const Candidate& c : candidates) {
    if (const auto score = score_of_admitted(model, c)) {
      admitted.push_back(*score);
      continue;
    }
    for (const std::size_t e : amplitudes_of(c)) {
      if (std::find(entries.begin(), entries.end(), e) == entries.end()) entries.push_back(e);
    }
  }
  const std::size_t room = kMostLanes - free.shared.size() - free.local.size();
  const std::size_t considered = std::min(model.considered.size(), room);
  entries.resize(std::min(entries.size(), room - considered));
  std::vector<Prior> priors = model.live_priors();
  for (std::size_t k = 0; k < considered; ++k) {
    free.shared.push_back(model.considered[k].entry);
    priors.push_back(model.considered[k]);
  }
  free.shared.insert(free.shared.end(), entries.begin(), entries.end());

  std::vector<Projected> scans;
  for (std::size_t n = 0; n < kScans; ++n) {
    GlobalPoint at = model.at;
    at.shared = scanned(model, n);
    const GlobalTerms terms = problem.evaluate(at, free, which, priors);
    scans.push_back(project(terms, fixed, entries));
    const Projected beside = considered > 0 ? project(terms, fixed + considered, entries) : Projected{};
    const Eigen::MatrixXd whole = terms.normal.bottomRightCorner(static_cast<Eigen::Index>(entries.size()),
                                                                 static_cast<Eigen::Index>(entries.size()));
    for (const Candidate& c : candidates) {
      const auto amplitudes = amplitudes_of(c);
      const bool known = std::all_of(amplitudes.begin(), amplitudes.end(), [&](std::size_t e) {
        return std::find(entries.begin(), entries.end(), e) != entries.end();
      });
      if (amplitudes.empty() || !known) continue;
      Score score = score_of(scans.back(), c, amplitudes, whole);
      score.scan = n;
      if (considered > 0 && score.lambda > 0.0) {
        // What the transducer's accuracy leaves of it.
        const Score sure = score_of(beside, c, amplitudes, whole);
        score.lambda = sure.lambda;
        if (!sure.sigma.empty()) score.sigma = sure.sigma;
      }
      const auto same = std::find_if(out.scores.begin(), out.scores.end(),
                                     [&](const Score& s) { return s.candidate == c; });
      if (same == out.scores.end()) {
        out.scores.push_back(std::move(score));
      } else if (score.lambda > same->lambda) {
        *same = std::move(score);
      }
    }
  }
  add_p_values(scans, out.scores);
  const bool any_local =
      std::any_of(candidates.begin(), candidates.end(), [](const Candidate& c) { return form_of(c).local; });
  const double base = any_local ? base_drop(problem, model, which) : 0.0;
  for (const Candidate& c : candidates) {
    if (form_of(c).local) out.scores.push_back(score_of_local(problem, model, c, which, base));
  }
  out.scores.insert(out.scores.end(), admitted.begin(), admitted.end());
  std::stable_sort(out.scores.begin(), out.scores.end(),
                   [](const Score& a, const Score& b) { return a.lambda > b.lambda; });
  const auto n = static_cast<Eigen::Index>(out.scores.size());
  out.cosine.setZero(n, n);
  for (Eigen::Index a = 0; a < n; ++a) {
    for (Eigen::Index b = 0; b < n; ++b) {
      const Score &x = out.scores[static_cast<std::size_t>(a)], &y = out.scores[static_cast<std::size_t>(b)];
      const auto missing = [&](std::size_t e) {
        return std::find(entries.begin(), entries.end(), e) == entries.end();
      };
      if (std::any_of(x.amplitudes.begin(), x.amplitudes.end(), missing) ||
          std::any_of(y.amplitudes.begin(), y.amplitudes.end(), missing))
        continue;
      if (x.amplitudes.empty() || y.amplitudes.empty() || x.change.empty() || y.change.empty()) continue;
      out.cosine(a, b) = cosine_of(scans[x.scan], x, y);
    }
  }
  return out;
}

}  // namespace imrig::est
