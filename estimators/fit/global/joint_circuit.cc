#include "estimators/fit/global/joint_circuit.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "estimators/fit/global/global_fit.h"
#include "estimators/fit/global/rough_circuits.h"
#include "estimators/fit/student_t.h"
#include "rig/base/error.h"

namespace imrig::est {

namespace {

constexpr std::size_t kCandidates = 24, kStarts = 5, kFinalists = 2;
constexpr std::size_t kScouts = 12;  // records or rows that the starts are fitted to
constexpr int kScoutRounds = 20;
constexpr int kMostSteps = 12;  // of the machine's motion in a sample: beyond, the samples do not follow it
constexpr double kRoughSigma = 0.5;  // of a rough value that stays
constexpr double kMisses = 0.3;      // of the signal: no model of these records
constexpr double kFarOff = 5.0;      // times the median record's error, and kMisses: set aside
constexpr std::array<std::size_t, 4> kOpenFirst{0, 2, 1, 3};  // R_s, L_l, R_r, L_m where several are as open

using Entries = std::vector<std::size_t>;
const Entries kFluxes{0, 1, 2, 3};  // each record's initial state

class Joint {
 public:
  Joint(const DataSet& data, const std::array<Told, 4>& told, int threads)
      : told_(told), rough_(rough(data, threads)), problem_(data, machine(rough_.front()), threads) {
    which_ = problem_.fitted();
    if (which_.empty())
      throw Error("data set \"" + data.name + "\"", "holds hold-out records only", "some must be fitted");
    std::erase_if(which_, [&](std::size_t k) { return problem_.entries()[k].steps > kMostSteps; });
    if (which_.empty())
      throw Error("data set \"" + data.name + "\"",
                  "has samples too far apart for the machine between them to be followed",
                  "is the time in seconds?");
    for (std::size_t m = 0; m < kBase; ++m) {
      if (!told_[m].held && std::isfinite(told_[m].value) && told_[m].sigma > 0.0)
        priors_.push_back({m, told_[m].value, told_[m].sigma});
    }
  }

  JointCircuit run() {
    const std::vector<GlobalPoint> best = finalists();
    GlobalFit fit = decided(best);
    set_aside(fit);
    fit = finish(fit.at);
    for (std::size_t pass = 0; pass < kBase; ++pass) {
      const std::size_t worst = most_open(fit);
      if (worst == kBase) break;
      open_[worst] = true;
      fit.at.shared[worst] = rough_.front()[worst];
      fit = finish(fit.at);
    }
    return result(fit);
  }

 private:
  using Base = std::array<double, 4>;

  static MachineParameters<double> machine(const Base& b) { return {b[0], b[1], b[2], b[3]}; }

  std::vector<Base> rough(const DataSet& data, int threads) const {
    std::array<double, 4> held{};
    for (std::size_t m = 0; m < kBase; ++m) held[m] = told_[m].held || m == 0 ? told_[m].value : kMissing;
    std::vector<Base> out;
    for (const auto& c : rough_circuits(data, held, kCandidates, threads))
      out.push_back({c.R_s, c.R_r, c.L_l, c.L_m});
    if (out.empty())
      throw Error("data set \"" + data.name + "\"", "has no record with voltage and current to start from",
                  "");
    return out;
  }

  GlobalPoint at(const Base& base) const {
    GlobalPoint point = problem_.start({});
    std::copy(base.begin(), base.end(), point.shared.begin());
    return point;
  }

  Freedom freedom() const {
    Freedom free{{}, kFluxes};
    for (std::size_t m = 0; m < kBase; ++m) {
      if (!told_[m].held && !open_[m]) free.shared.push_back(m);
    }
    return free;
  }

  static Entries some_of(const Entries& all, std::size_t most) {
    if (all.size() <= most) return all;
    Entries out;
    for (std::size_t k = 0; k < most; ++k) out.push_back(all[k * all.size() / most]);
    return out;
  }

  // Candidates in the order of what they leave of some records, the best of them fitted to those.
  std::vector<GlobalPoint> finalists() {
    const Entries some = some_of(which_, kScouts);
    std::vector<std::pair<double, GlobalPoint>> ranked;
    for (const Base& base : rough_) ranked.emplace_back(left_by(base, some), at(base));
    order(ranked);
    ranked.resize(std::min(kStarts, ranked.size()));
    GlobalFitOptions quick;
    quick.priors = priors_;
    quick.most_rounds = kScoutRounds;
    quick.tolerance = 1e-4, quick.enough = 0.5;
    quick.intervals = false;
    for (auto& [chi2, point] : ranked) {
      problem_.settle(point, kFluxes, some);
      const GlobalFit fit = fit_global(problem_, point, freedom(), some, quick);
      chi2 = finite_or_worst(fit.chi2);
      if (std::isfinite(fit.chi2)) point = fit.at;
    }
    order(ranked);
    std::vector<GlobalPoint> out;
    for (std::size_t k = 0; k < std::min(kFinalists, ranked.size()); ++k) out.push_back(ranked[k].second);
    return out;
  }

  static double finite_or_worst(double chi2) {
    return std::isfinite(chi2) ? chi2 : std::numeric_limits<double>::infinity();
  }

  static void order(std::vector<std::pair<double, GlobalPoint>>& all) {
    std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  }

  double left_by(const Base& base, const Entries& some) const {
    GlobalPoint point = at(base);
    problem_.settle(point, kFluxes, some);
    return finite_or_worst(problem_.evaluate(point, {{}, kFluxes}, some, priors_).chi2);
  }

  // The better of the finalists on all records.
  GlobalFit decided(const std::vector<GlobalPoint>& finalists) const {
    GlobalFit best;
    best.chi2 = std::numeric_limits<double>::infinity();
    GlobalFitOptions options;
    options.priors = priors_;
    options.tolerance = 1e-5, options.enough = 0.5;
    options.intervals = false;
    for (GlobalPoint start : finalists) {
      problem_.settle(start, kFluxes, which_);
      GlobalFit fit = fit_global(problem_, start, freedom(), which_, options);
      if (best.terms.records.empty() || finite_or_worst(fit.chi2) < best.chi2) best = std::move(fit);
    }
    return best;
  }

  // A record that the others' motor misses by far (phases swapped, a wrong gain) does not vote.
  void set_aside(const GlobalFit& fit) {
    std::vector<double> errors;
    for (const RecordTerms& r : fit.terms.records)
      errors.push_back(r.signal2 > 0.0 ? std::sqrt(r.error2 / r.signal2) : 0.0);
    std::vector<double> sorted = errors;
    std::sort(sorted.begin(), sorted.end());
    const double limit = std::max(kMisses, kFarOff * sorted[sorted.size() / 2]);
    Entries kept;
    for (std::size_t k = 0; k < which_.size(); ++k) {
      if (errors[k] <= limit) kept.push_back(which_[k]);
    }
    if (!kept.empty()) which_ = std::move(kept);
  }

  GlobalFit finish(GlobalPoint from) {
    problem_.refresh(from.shared);
    problem_.settle(from, kFluxes, which_);
    GlobalFitOptions options;
    options.priors = priors_;
    options.unbiased = true;
    return fit_global(problem_, from, freedom(), which_, options);
  }

  // Width of the 95 % interval over the value.
  static double width(double sigma, double value) {
    return std::isfinite(sigma) && value > 0.0 ? 2.0 * kNormal975 * sigma / value
                                               : std::numeric_limits<double>::infinity();
  }

  std::size_t most_open(const GlobalFit& fit) const {
    std::size_t worst = kBase;
    double widest = 1.0;
    for (const std::size_t m : kOpenFirst) {
      if (told_[m].held || open_[m]) continue;
      const double w = width(fit.sigma(m), fit.at.shared[m]);
      if (w > widest) worst = m, widest = w;
    }
    return worst;
  }

  // What the uncertainty of those that were not fitted does to those that were: d theta = -H^-1 H_held d
  // held.
  Eigen::Vector4d passed_on(const GlobalFit& fit) const {
    Eigen::Vector4d out = Eigen::Vector4d::Zero();
    const Freedom free = freedom();
    if (free.shared.empty()) return out;
    const GlobalTerms terms = problem_.evaluate(fit.at, {{0, 1, 2, 3}, kFluxes}, which_, priors_);
    const auto n = static_cast<Eigen::Index>(free.shared.size());
    Eigen::Map<const Eigen::Vector4d> value(fit.at.shared.data());
    const Eigen::Matrix4d H = value.asDiagonal() * terms.normal * value.asDiagonal();
    Eigen::MatrixXd own(n, n);
    for (Eigen::Index a = 0; a < n; ++a) {
      for (Eigen::Index b = 0; b < n; ++b) own(a, b) = H(index(free, a), index(free, b));
    }
    const Eigen::LDLT<Eigen::MatrixXd> solve(own);
    for (std::size_t m = 0; m < kBase; ++m) {
      const double sigma = open_[m] ? kRoughSigma : told_[m].held ? told_[m].sigma / told_[m].value : 0.0;
      if (!(sigma > 0.0)) continue;
      Eigen::VectorXd column(n);
      for (Eigen::Index a = 0; a < n; ++a) column[a] = H(index(free, a), static_cast<Eigen::Index>(m));
      const Eigen::VectorXd moved = solve.solve(column) * sigma;
      for (Eigen::Index a = 0; a < n; ++a) out[index(free, a)] += moved[a] * moved[a];
    }
    return out.cwiseSqrt().cwiseProduct(value);
  }

  static Eigen::Index index(const Freedom& free, Eigen::Index a) {
    return static_cast<Eigen::Index>(free.shared[static_cast<std::size_t>(a)]);
  }

  JointCircuit result(const GlobalFit& fit) const {
    JointCircuit out;
    const Eigen::Vector4d more = passed_on(fit);
    for (std::size_t m = 0; m < kBase; ++m) {
      out.value[m] = fit.at.shared[m];
      out.sigma[m] =
          told_[m].held ? told_[m].sigma : std::hypot(fit.sigma(m), more[static_cast<Eigen::Index>(m)]);
      out.open[m] = !told_[m].held && (open_[m] || width(out.sigma[m], out.value[m]) > 1.0);
      if (out.open[m]) out.sigma[m] = kMissing;
    }
    double error2 = 0.0, signal2 = 0.0;
    for (const RecordTerms& r : fit.terms.records) error2 += r.error2, signal2 += r.signal2;
    out.nrmse = signal2 > 0.0 ? std::sqrt(error2 / signal2) : kMissing;
    out.times_noise = fit.dof > 0.0 ? std::sqrt(fit.chi2 / fit.dof) : kMissing;
    for (const std::size_t k : which_) {
      const std::size_t record = problem_.entries()[k].index;
      if (out.records.empty() || out.records.back() != record) out.records.push_back(record);
    }
    out.failure = failure(fit, out.nrmse);
    return out;
  }

  static std::string failure(const GlobalFit& fit, double nrmse) {
    if (!std::isfinite(fit.chi2)) return "the fit of all records together failed";
    if (!fit.converged) return "the fit of all records together did not settle";
    if (nrmse > kMisses)
      return fmt::format("the fit of all records together misses the current by {:.0f} %", 100.0 * nrmse);
    return "";
  }

  std::array<Told, 4> told_;
  const std::vector<Base> rough_;
  GlobalProblem problem_;
  Entries which_;
  std::vector<Prior> priors_;
  std::array<bool, 4> open_{};
};

}  // namespace

JointCircuit joint_circuit(const DataSet& data, const std::array<Told, 4>& told, int threads) {
  return Joint(data, told, threads).run();
}

}  // namespace imrig::est
