#include "estimators/diagnose/next/separation.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace imrig::est {

namespace {

// Of chi2 + 2 gradient'x + x'normal x.
double least_of(double chi2, const Eigen::VectorXd& gradient, const Eigen::MatrixXd& normal) {
  if (gradient.size() == 0) return chi2;
  const Eigen::VectorXd scale = normal.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd scaled = scale.asDiagonal() * normal * scale.asDiagonal();
  scaled.diagonal().array() += 1e-11;
  const Eigen::VectorXd g = scale.asDiagonal() * gradient;
  return chi2 - g.dot(scaled.ldlt().solve(g));
}

// chi2 + 2 gradient'x + x'normal x over some records, and its minimum.
struct Quadratic {
  double chi2 = 0.0;
  Eigen::VectorXd gradient;
  Eigen::MatrixXd normal;

  // Its own unknowns, far from their best, are eliminated.
  void add(const GlobalTerms& terms, std::size_t k) {
    const RecordTerms& r = terms.records[k];
    const auto own = r.gradient.size() - gradient.size();
    chi2 += least_of(r.chi2, r.gradient.tail(own), r.normal.bottomRightCorner(own, own));
    gradient += terms.scores[k];
    normal += terms.normals[k];
  }
  double least() const { return least_of(chi2, gradient, normal); }
};

// What the priors add to all of them.
Quadratic priors_of(const GlobalTerms& terms) {
  Quadratic out{terms.chi2, terms.gradient, terms.normal};
  for (std::size_t k = 0; k < terms.records.size(); ++k) {
    out.chi2 -= terms.records[k].chi2;
    out.gradient -= terms.scores[k];
    out.normal -= terms.normals[k];
  }
  return out;
}

std::vector<std::size_t> range(std::size_t from, std::size_t to) {
  std::vector<std::size_t> out(to - from);
  std::iota(out.begin(), out.end(), from);
  return out;
}

std::vector<std::size_t> joined(std::vector<std::size_t> a, const std::vector<std::size_t>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

// Least chi2 over the data at hand, then over these and each experiment.
std::vector<double> least(const GlobalTerms& terms, std::size_t own, const std::vector<std::size_t>& first) {
  Quadratic now = priors_of(terms);
  for (std::size_t k = 0; k < own; ++k) now.add(terms, k);
  std::vector<double> out{now.least()};
  for (std::size_t e = 0; e + 1 < first.size(); ++e) {
    Quadratic more = now;
    for (std::size_t k = first[e]; k < first[e + 1]; ++k) more.add(terms, own + k - first.front());
    out.push_back(more.least());
  }
  return out;
}

}  // namespace

double Apart::d() const { return 0.5 * std::sqrt(left); }
double Apart::cosine() const { return whole > 0.0 ? std::sqrt(std::max(0.0, 1.0 - left / whole)) : 1.0; }

Separation::Separation(const GlobalProblem& problem, const WorkingModel& base,
                       const std::vector<const WorkingModel*>& members, const std::vector<Experiment>& menu)
    : models_(members), fitted_(problem.fitted()) {
  models_.push_back(&base);
  std::vector<PlannedRecord> records;
  first_.push_back(problem.entries().size());
  for (const Experiment& e : menu) {
    records.insert(records.end(), e.records.begin(), e.records.end());
    first_.push_back(first_.back() + e.records.size());
  }
  const GlobalProblem more = imagined(problem, base, records);
  for (const WorkingModel* model : models_) at_.push_back(settled_in(more, *model, records));
  for (std::size_t a = 0; a < members.size(); ++a) {
    measured_.push_back(more);
    measured_.back().pretend(at_[a]);
  }
  with_.resize(experiments());
  for (std::size_t a = 0; a < members.size(); ++a) compare(a);
}

void Separation::compare(std::size_t a) {
  const auto which = joined(fitted_, range(first_.front(), first_.back()));
  const auto left_by = [&](std::size_t model, Freedom free) {
    return least(measured_[a].evaluate(at_[model], free, which, models_[model]->priors), fitted_.size(),
                 first_);
  };
  const std::size_t last = models_.size() - 1;
  const std::vector<double> own = left_by(a, {{}, models_[a]->freedom().local});
  const std::vector<double> base = left_by(last, models_[last]->freedom());
  for (std::size_t b = 0; b < last; ++b) {
    if (b == a) continue;
    const std::vector<double> rival = left_by(b, models_[b]->freedom());
    for (std::size_t k = 0; k < own.size(); ++k) {
      (k == 0 ? now_ : with_[k - 1])
          .push_back({a, b, std::max(0.0, rival[k] - own[k]), std::max(0.0, base[k] - own[k])});
    }
  }
}

std::vector<Apart> Separation::refitted(std::size_t experiment) const {
  const auto which = joined(fitted_, range(first_[experiment], first_[experiment + 1]));
  std::vector<Apart> out = with_[experiment];
  for (Apart& pair : out) {
    const WorkingModel& rival = *models_[pair.b];
    GlobalFitOptions options;
    options.priors = rival.priors;
    options.most_rounds = 6;
    options.tolerance = 1e-2;
    options.enough = 0.3;
    options.intervals = false;
    const double left = fit_global(measured_[pair.a], at_[pair.b], rival.freedom(), which, options).chi2;
    const WorkingModel& self = *models_[pair.a];
    const double own =
        measured_[pair.a].evaluate(at_[pair.a], {{}, self.freedom().local}, which, self.priors).chi2;
    pair.left = std::max(0.0, left - own);
    pair.whole = std::max(pair.whole, pair.left);
  }
  return out;
}

}  // namespace imrig::est
