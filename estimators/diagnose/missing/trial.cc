#include "estimators/diagnose/missing/trial.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "estimators/model/effects/registry.h"

namespace imrig::est {

namespace {

// Trials are compared by far more than these.
constexpr double kTrialTolerance = 1e-5;
constexpr double kTrialEnough = 0.5;
constexpr int kMostReferred = 4;
constexpr double kAstray = 0.1;  // share of the forecast gain below which a fit has left its valley
constexpr double kOfAccuracy =
    0.75;  // a class of accuracy is a bound: three of its sigmas count as four of noise

// Each record judged by parameters that it had no part in: with s_r and H_r its reduced gradient and normal
// matrix, theta moves by (H - H_r)^-1 s_r when it is left out.
std::vector<double> left_out(const GlobalTerms& terms) {
  std::vector<double> out;
  const auto n = terms.normal.rows();
  for (std::size_t k = 0; k < terms.records.size(); ++k) {
    Eigen::MatrixXd rest = terms.normal - terms.normals[k];
    const Eigen::VectorXd scale = terms.normal.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    Eigen::MatrixXd scaled = scale.asDiagonal() * rest * scale.asDiagonal();
    scaled += 1e-9 * Eigen::MatrixXd::Identity(n, n);
    const Eigen::VectorXd step =
        scale.asDiagonal() * scaled.ldlt().solve(scale.asDiagonal() * terms.scores[k]);
    const double more = 2.0 * terms.scores[k].dot(step) + step.dot(terms.normals[k] * step);
    out.push_back(terms.records[k].chi2 + std::max(0.0, more));
  }
  return out;
}

void check(const GlobalFit& fit, Trial& trial) {
  if (!std::isfinite(fit.chi2)) {
    trial.unsound = "the fit failed";
    return;
  }
  if (!fit.converged) {
    trial.unsound = "the fit did not settle";
    return;
  }
  trial.sound = true;
  for (const std::size_t e : shared_entries(trial.candidate)) {
    const bool flat = std::find(fit.flat.begin(), fit.flat.end(), e) != fit.flat.end();
    if (shared_parameter(e).role == Role::kAmplitude && flat) trial.determined = false;
  }
}

// Wald statistic of the amplitudes with the covariance from record to record.
void add_strength(const GlobalProblem& problem, Trial& trial) {
  const GlobalFit& fit = trial.model.fit;
  std::vector<Eigen::Index> rows;
  std::vector<double> values;
  for (std::size_t m = 0; m < fit.free.shared.size(); ++m) {
    const std::size_t e = fit.free.shared[m];
    if (e < kBase || effect_of_shared(e) != trial.candidate.effect ||
        shared_parameter(e).role != Role::kAmplitude)
      continue;
    rows.push_back(static_cast<Eigen::Index>(m));
    values.push_back(fit.at.shared[e] - shared_parameter(e).neutral);
    trial.size = std::max(trial.size, std::abs(values.back()) / material_size(problem, fit.at.shared, e));
  }
  if (rows.empty() || fit.covariance.size() == 0) return;  // a fit that failed has no intervals
  const auto n = static_cast<Eigen::Index>(rows.size());
  double wald = 0.0;
  // The most certain of its amplitudes speaks for the effect.
  for (Eigen::Index a = 0; a < n; ++a) {
    const Eigen::Index r = rows[static_cast<std::size_t>(a)];
    const double unseen =
        kOfAccuracy * trial.model.unseen_sigma(fit.free.shared[static_cast<std::size_t>(r)]);
    const double variance = fit.covariance(r, r) + unseen * unseen;
    if (variance > 0.0)
      wald = std::max(wald, std::abs(values[static_cast<std::size_t>(a)]) / std::sqrt(variance));
  }
  trial.wald = wald;
}

// What errors of the torque transducer do to the fit, to first order: (considered, Schmidt 1966) they stay in
// the data and move every parameter, friction first.
void consider(const GlobalProblem& problem, const std::vector<std::size_t>& which, WorkingModel& model) {
  model.unseen.clear();
  if (!any_needs_torque(model.active) || model.considered.empty() || model.fit.noise_covariance.size() == 0)
    return;
  std::vector<std::size_t> with_torque;
  for (const std::size_t k : which) {
    const auto& entry = problem.entries()[k];
    if (entry.series && !entry.series->torque.empty()) with_torque.push_back(k);
  }
  Freedom free = model.fit.free;
  for (const Prior& p : model.considered) free.shared.push_back(p.entry);
  const auto n = static_cast<Eigen::Index>(model.fit.free.shared.size());
  const Eigen::MatrixXd H = problem.evaluate(model.at, free, with_torque).normal;
  Eigen::VectorXd square = Eigen::VectorXd::Zero(n);
  for (std::size_t m = 0; m < model.considered.size(); ++m) {
    const Eigen::VectorXd shift = model.considered[m].sigma * model.fit.noise_covariance *
                                  H.col(n + static_cast<Eigen::Index>(m)).head(n);
    square += shift.cwiseAbs2();
  }
  for (Eigen::Index m = 0; m < n; ++m) model.unseen.push_back(std::sqrt(square[m]));
}

// A value of its own for each record, of those that know it to what matters.
struct OwnValues {
  std::vector<double> value, weight;  // 1 / variance, the motor's parameters known
  double mean() const {
    double sum = 0.0, weights = 0.0;
    for (std::size_t k = 0; k < value.size(); ++k) sum += weight[k] * value[k], weights += weight[k];
    return weights > 0.0 ? sum / weights : 0.0;
  }
};

OwnValues own_values(const GlobalProblem& problem, const WorkingModel& model, std::size_t entry,
                     const std::vector<std::size_t>& which) {
  OwnValues out;
  const double matters = local_parameter(entry).scale;
  const auto s = static_cast<Eigen::Index>(model.fit.free.shared.size());
  for (std::size_t k = 0; k < which.size() && k < model.fit.terms.records.size(); ++k) {
    const auto locals = problem.locals_of(which[k], model.fit.free.local);
    const auto at = std::find(locals.begin(), locals.end(), entry) - locals.begin();
    const auto l = static_cast<Eigen::Index>(locals.size());
    if (at == l) continue;
    const Eigen::VectorXd column =
        model.fit.terms.records[k].normal.block(s, s, l, l).ldlt().solve(Eigen::VectorXd::Unit(l, at));
    if (!(column[at] > 0.0) || column[at] > matters * matters) continue;
    out.value.push_back(model.at.local[which[k]][entry]);
    out.weight.push_back(1.0 / column[at]);
  }
  return out;
}

// Of effects whose amplitudes belong to the records: how large they are, beside what matters. A warmth that
// all records share is another resistance: only what they differ by counts.
double size_of_own(const GlobalProblem& problem, const WorkingModel& model, const Candidate& candidate,
                   const std::vector<std::size_t>& which) {
  std::vector<std::size_t> own = local_entries(candidate);
  std::erase_if(own, [](std::size_t e) { return e < kStates; });
  double square = 0.0, n = 0.0;
  for (const std::size_t e : own) {
    const OwnValues values = own_values(problem, model, e, which);
    const double mean = own.size() == 1 ? values.mean() : 0.0;
    for (const double x : values.value)
      square += std::pow((x - mean) / local_parameter(e).scale, 2), n += 1.0;
  }
  return n > 0.0 ? std::sqrt(square / n) : 0.0;
}

// Nothing but a wide prior tells a warmth that all records share from another R_r, and noise of the voltage
// drives them apart: the rotor's resistance is that of the mean record. (R_s has a DC test of its own.)
bool refer_to_the_mean(const GlobalProblem& problem, const std::vector<std::size_t>& which,
                       WorkingModel& model) {
  static const std::size_t heat = *effect_number("rotor_heating");
  const bool by_record = std::any_of(model.active.begin(), model.active.end(),
                                     [](const Candidate& c) { return c.effect == heat && form_of(c).local; });
  if (!by_record) return false;
  const std::size_t warmth = kLocalPlace[heat];
  const double mean = own_values(problem, model, warmth, which).mean();
  model.at.shared[1] *= 1.0 + mean;
  for (LocalVector<double>& local : model.at.local)
    local[warmth] = (1.0 + local[warmth]) / (1.0 + mean) - 1.0;
  model.fit.at = model.at;
  return true;
}

// What a record no longer has of its own must not act on: a value of an effect that left, a current deep in
// bars.
void forget_what_is_not_free(WorkingModel& model) {
  const std::vector<std::size_t> free = model.freedom().local;
  const LocalVector<double> neutral = neutral_local();
  for (std::size_t e = 0; e < neutral.size(); ++e) {
    if (std::find(free.begin(), free.end(), e) != free.end()) continue;
    for (LocalVector<double>& local : model.at.local) local[e] = neutral[e];
  }
}

// Of values for each record that only a phase tells apart (a broken bar: the rotor's angle at the start): how
// far their sizes scatter beyond what is not known of them, as a share of their mean; over the records that
// know theirs to a third. 0 where fewer than four do.
double scatter_of_sizes(const GlobalProblem& problem, const WorkingModel& model, const Candidate& candidate,
                        const std::vector<std::size_t>& which) {
  const std::vector<std::size_t> entries = local_entries(candidate);
  if (entries.size() != 2 || entries.front() < kStates) return 0.0;
  const auto s = static_cast<Eigen::Index>(model.fit.free.shared.size());
  std::vector<double> sizes, variances;
  for (std::size_t k = 0; k < which.size() && k < model.fit.terms.records.size(); ++k) {
    const auto locals = problem.locals_of(which[k], model.fit.free.local);
    const auto at = std::find(locals.begin(), locals.end(), entries.front()) - locals.begin();
    const auto l = static_cast<Eigen::Index>(locals.size());
    if (at + 1 >= l) continue;
    const Eigen::MatrixXd inverse =
        model.fit.terms.records[k].normal.block(s, s, l, l).ldlt().solve(Eigen::MatrixXd::Identity(l, l));
    const LocalVector<double>& local = model.at.local[which[k]];
    sizes.push_back(std::hypot(local[entries[0]], local[entries[1]]));
    variances.push_back(0.5 * (inverse(at, at) + inverse(at + 1, at + 1)));
  }
  double n = 0.0, mean = 0.0, square = 0.0, unknown = 0.0;
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    if (!(9.0 * variances[k] < sizes[k] * sizes[k])) continue;
    n += 1.0, mean += sizes[k], square += sizes[k] * sizes[k], unknown += variances[k];
  }
  if (n < 4.0) return 0.0;
  mean /= n;
  return std::sqrt(std::max(0.0, square / n - mean * mean - unknown / n)) / mean;
}

WorkingModel without(const WorkingModel& model, std::size_t effect) {
  WorkingModel next = model;
  std::erase_if(next.active, [&](const Candidate& c) { return c.effect == effect; });
  for (std::size_t e = kSharedPlace[effect]; e < kSharedPlace[effect + 1]; ++e) {
    if (shared_parameter(e).role != Role::kConstant) next.at.shared[e] = shared_parameter(e).neutral;
  }
  forget_what_is_not_free(next);
  return next;
}

Trial run(const GlobalProblem& problem, WorkingModel model, const Candidate& candidate,
          const std::vector<std::size_t>& which, bool last = false) {
  Trial trial;
  trial.candidate = candidate;
  GlobalFitOptions options;
  options.priors = model.live_priors();
  if (!last) {
    options.tolerance = kTrialTolerance;
    options.enough = kTrialEnough;
  }
  options.unbiased = last;
  const Freedom free = model.freedom();
  // Along a valley without a floor a fit goes on and on: from the mean it has less far to go.
  for (int n = 0; n < kMostReferred; ++n) {
    model.fit = fit_global(problem, model.at, free, which, options);
    model.at = model.fit.at;
    if (!refer_to_the_mean(problem, which, model) || model.fit.converged) break;
  }
  consider(problem, which, model);
  trial.chi2 = model.fit.chi2;
  trial.left_out = left_out(model.fit.terms);
  trial.size_scatter = scatter_of_sizes(problem, model, candidate, which);
  const double own_size = form_of(candidate).local ? size_of_own(problem, model, candidate, which) : 0.0;
  for (const RecordTerms& r : model.fit.terms.records) trial.torque.add(r.torque);
  model.fit.terms = {};  // as large as the data's normal equations, and not needed again
  for (const double x : trial.left_out) trial.left_out_chi2 += x;
  if (!std::isfinite(trial.left_out_chi2)) trial.left_out_chi2 = std::numeric_limits<double>::infinity();
  check(model.fit, trial);
  trial.model = std::move(model);
  add_strength(problem, trial);
  if (form_of(candidate).local) trial.size = own_size;
  return trial;
}

bool on_bound(const Trial& trial) {
  for (const std::size_t e : shared_entries(trial.candidate)) {
    const EffectParameter& p = shared_parameter(e);
    const double value = trial.model.at.shared[e], close = 1e-6 * (p.high - p.low);
    if (p.only_in_reach && (value < p.low + close || value > p.high - close)) return true;
  }
  return false;
}

void refuse_on_bound(Trial& trial) {
  if (!trial.sound || !on_bound(trial)) return;
  trial.sound = false;
  trial.unsound = "a shape sits on its bound";
}

// With a candidate in it, its shapes at their n-th scanned values.
WorkingModel with(const WorkingModel& model, const Candidate& candidate, std::size_t n) {
  WorkingModel next = model;
  const SharedVector<double> shapes = scanned(model, n);
  next.active.push_back(candidate);
  for (std::size_t e = kSharedPlace[candidate.effect]; e < kSharedPlace[candidate.effect + 1]; ++e) {
    if (shared_parameter(e).role == Role::kShape) next.at.shared[e] = shapes[e];
  }
  return next;
}

}  // namespace

double Judgement::nrmse() const { return signal2 > 0.0 ? std::sqrt(error2 / signal2) : kMissing; }
double Judgement::floor() const {
  return signal2 > 0.0 && noise2 > 0.0 ? std::sqrt(noise2 / signal2) : kMissing;
}
double Judgement::chi2_per_value() const { return values > 0.0 ? chi2 / values : kMissing; }
double Judgement::error_over_noise() const { return noise2 > 0.0 ? series_error2 / (noise2 + edges2) : 1.0; }
double Judgement::error_over_noise_sigma() const {
  return noise2 > 0.0 ? std::sqrt(noise2_variance) / (noise2 + edges2) : 0.0;
}

Trial finished(const GlobalProblem& problem, const WorkingModel& model,
               const std::vector<std::size_t>& which) {
  return run(problem, model, model.active.empty() ? Candidate{} : model.active.back(), which, true);
}

Trial refit(const GlobalProblem& problem, const WorkingModel& model, const std::vector<std::size_t>& which) {
  return run(problem, model, model.active.empty() ? Candidate{} : model.active.back(), which);
}

Trial try_adding(const GlobalProblem& problem, const WorkingModel& model, const Score& score,
                 const std::vector<std::size_t>& which) {
  WorkingModel next = with(model, score.candidate, score.scan);
  for (std::size_t k = 0; k < score.amplitudes.size(); ++k) {
    const EffectParameter& p = shared_parameter(score.amplitudes[k]);
    double start = k < score.change.size() ? p.neutral + score.change[k] : p.scale;
    if (start == p.neutral) start = p.neutral + p.scale;
    next.at.shared[score.amplitudes[k]] =
        std::clamp(start, std::max(p.low, -100.0 * p.scale), std::min(p.high, 200.0 * p.scale));
  }
  Trial trial = run(problem, std::move(next), score.candidate, which);
  refuse_on_bound(trial);
  const bool astray = model.fit.chi2 - trial.chi2 < kAstray * score.lambda;
  if (!trial.sound || astray) try_other_shapes(problem, model, score.scan, which, trial);
  return trial;
}

void try_other_shapes(const GlobalProblem& problem, const WorkingModel& from, std::size_t tried,
                      const std::vector<std::size_t>& which, Trial& best) {
  const auto entries = shared_entries(best.candidate);
  if (std::none_of(entries.begin(), entries.end(), [](std::size_t e) { return !shared_parameter(e).scan.empty(); }))
    return;
  const WorkingModel bare = from.has(best.candidate.effect) ? without(from, best.candidate.effect) : from;
  for (std::size_t n = 0; n < kScans; ++n) {
    if (n == tried) continue;
    WorkingModel next = with(bare, best.candidate, n);
    for (const std::size_t e : entries) {
      const EffectParameter& p = shared_parameter(e);
      if (p.role == Role::kAmplitude) next.at.shared[e] = p.neutral + p.scale;
    }
    Trial again = run(problem, std::move(next), best.candidate, which);
    refuse_on_bound(again);
    if (again.sound && (!best.sound || again.chi2 < best.chi2)) best = std::move(again);
  }
}

Trial try_form(const GlobalProblem& problem, const WorkingModel& model, const Candidate& form,
               const std::vector<std::size_t>& which) {
  WorkingModel next = model;
  for (Candidate& c : next.active) {
    if (c.effect == form.effect) c = form;
  }
  for (const std::size_t e : shared_entries(form)) {
    const EffectParameter& p = shared_parameter(e);
    if (p.role == Role::kAmplitude && next.at.shared[e] == p.neutral) next.at.shared[e] = p.neutral + p.scale;
  }
  forget_what_is_not_free(next);
  return run(problem, std::move(next), form, which);
}

Trial try_removing(const GlobalProblem& problem, const WorkingModel& model, std::size_t effect,
                   const std::vector<std::size_t>& which) {
  WorkingModel next = without(model, effect);
  return run(problem, std::move(next), next.active.empty() ? Candidate{} : next.active.back(), which);
}

Trial try_swapping(const GlobalProblem& problem, const WorkingModel& model, std::size_t effect,
                   const Trial& source, const std::vector<std::size_t>& which) {
  WorkingModel next = without(model, effect);
  next.active.push_back(source.candidate);
  const std::size_t in = source.candidate.effect;
  for (std::size_t e = kSharedPlace[in]; e < kSharedPlace[in + 1]; ++e)
    next.at.shared[e] = source.model.at.shared[e];
  return run(problem, std::move(next), source.candidate, which);
}

Judgement judge(const GlobalProblem& problem, const WorkingModel& model,
                const std::vector<std::size_t>& which) {
  Judgement out;
  GlobalPoint at = model.at;
  const Freedom free = model.freedom();
  problem.settle(at, free.local, which);
  const GlobalTerms terms = problem.evaluate(at, {{}, free.local}, which);
  for (std::size_t k = 0; k < which.size(); ++k) {
    const RecordTerms& r = terms.records[k];
    out.error2 += r.error2;
    out.signal2 += r.signal2;
    out.chi2 += r.chi2;
    out.torque.add(r.torque);
    out.values +=
        static_cast<double>(r.values) - static_cast<double>(problem.locals_of(which[k], free.local).size());
    const auto& entry = problem.entries()[which[k]];
    if (!entry.whitener) continue;
    const double samples = 0.5 * (static_cast<double>(r.values) - r.torque.values());
    out.series_error2 += r.error2;
    out.noise2 += entry.whitener->noise_power_A2() * samples;
    out.edges2 += entry.whitener->edge_power_A2() * samples;
    out.noise2_variance += entry.whitener->noise_power_variance() * samples * samples;
  }
  return out;
}

std::vector<double> left_out_gains(const Trial& a, const Trial& b) {
  std::vector<double> gains(std::min(a.left_out.size(), b.left_out.size()));
  for (std::size_t k = 0; k < gains.size(); ++k) gains[k] = b.left_out[k] - a.left_out[k];
  return gains;
}

double surely_better(const Trial& a, const Trial& b) { return surely_better(left_out_gains(a, b)); }

double surely_better(const std::vector<double>& gains) {
  const std::size_t n = gains.size();
  if (n < 2) return 0.0;
  double mean = 0.0, square = 0.0;
  for (const double d : gains) {
    mean += d;
    square += d * d;
  }
  mean /= static_cast<double>(n);
  const double variance =
      std::max(square / static_cast<double>(n) - mean * mean, 1e-12) / static_cast<double>(n - 1);
  return mean / std::sqrt(variance);
}

}  // namespace imrig::est
