#include "estimators/diagnose/missing/unexplained.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <unsupported/Eigen/FFT>

#include "estimators/diagnose/missing/record_conditions.h"
#include "estimators/diagnose/missing/search.h"

namespace imrig::est {

namespace {

constexpr double kDepends = 0.5;  // rank correlation that is worth telling
constexpr double kLine = 30.0;    // power of a line over the median
constexpr std::size_t kMostLines = 5;

std::vector<double> ranks(const std::vector<double>& x) {
  std::vector<std::size_t> order(x.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return x[a] < x[b]; });
  std::vector<double> out(x.size());
  for (std::size_t k = 0; k < order.size();) {
    std::size_t end = k;
    while (end < order.size() && x[order[end]] == x[order[k]]) ++end;
    for (std::size_t m = k; m < end; ++m) out[order[m]] = 0.5 * static_cast<double>(k + end - 1);
    k = end;
  }
  return out;
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const double n = static_cast<double>(a.size());
  const double ma = std::accumulate(a.begin(), a.end(), 0.0) / n,
               mb = std::accumulate(b.begin(), b.end(), 0.0) / n;
  double aa = 0.0, bb = 0.0, ab = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    aa += (a[k] - ma) * (a[k] - ma);
    bb += (b[k] - mb) * (b[k] - mb);
    ab += (a[k] - ma) * (b[k] - mb);
  }
  return aa > 0.0 && bb > 0.0 ? ab / std::sqrt(aa * bb) : 0.0;
}

// Lines of the residual of one record, in the stationary frame.
std::vector<double> lines_of(const GlobalProblem& problem, const Trial& trial, std::size_t number) {
  const auto& entry = problem.entries()[number];
  if (!entry.series) return {};
  RecordTrace trace;
  problem.evaluate_one(number, trial.model.at.shared, trial.model.at.local[number], {}, &trace);
  Eigen::FFT<double> fft;
  std::vector<std::complex<double>> signal = trace.error, spectrum;
  const std::size_t n = signal.size();
  for (std::size_t k = 0; k < n; ++k)
    signal[k] *= 0.5 * (1.0 - std::cos(2.0 * kPi * static_cast<double>(k) / static_cast<double>(n)));
  fft.fwd(spectrum, signal);
  std::vector<double> power(n);
  for (std::size_t k = 0; k < n; ++k) power[k] = std::norm(spectrum[k]);
  std::vector<double> sorted = power;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(n / 2), sorted.end());
  const double median = sorted[n / 2];
  std::vector<std::size_t> peaks;
  for (std::size_t k = 0; k < n; ++k) {
    const double before = power[(k + n - 1) % n], after = power[(k + 1) % n];
    if (power[k] > kLine * median && power[k] >= before && power[k] > after) peaks.push_back(k);
  }
  std::stable_sort(peaks.begin(), peaks.end(),
                   [&](std::size_t a, std::size_t b) { return power[a] > power[b]; });
  std::vector<double> out;
  const double span = 1.0 / (entry.series->frame.sample_time_s * static_cast<double>(n));
  for (const std::size_t k : peaks) {
    if (out.size() == kMostLines) break;
    const double turn =
        k < (n + 1) / 2 ? static_cast<double>(k) : static_cast<double>(k) - static_cast<double>(n);
    out.push_back(turn * span + entry.series->frame.w_k / (2.0 * kPi));
  }
  return out;
}

}  // namespace

Unexplained describe_unexplained(const GlobalProblem& problem, const Trial& trial) {
  Unexplained out;
  out.channel = "current_A";
  const auto which = problem.fitted();
  const GlobalTerms terms =
      problem.evaluate(trial.model.at, trial.model.freedom(), which, trial.model.live_priors());
  std::vector<double> misfit;
  for (const RecordTerms& r : terms.records)
    misfit.push_back(r.chi2 / std::max<double>(1.0, static_cast<double>(r.values)));
  double strongest = 0.0;
  for (const NamedCondition& condition : record_conditions(problem, trial.model.at.shared[0], which)) {
    std::vector<double> a, b;
    for (std::size_t k = 0; k < which.size(); ++k) {
      if (!std::isfinite(condition.values[k])) continue;
      a.push_back(condition.values[k]);
      b.push_back(misfit[k]);
    }
    if (a.size() < 5) continue;
    const double r = correlation(ranks(a), ranks(b));
    if (std::abs(r) > std::max(kDepends, std::abs(strongest))) {
      strongest = r;
      out.depends_on = condition.name;
    }
  }
  const auto worst =
      static_cast<std::size_t>(std::max_element(misfit.begin(), misfit.end()) - misfit.begin());
  out.lines_Hz = lines_of(problem, trial, which[worst]);
  out.description =
      fmt::format("the current's misfit is {:.3g} times what noise leaves, largest in {} ({:.3g} times)",
                  trial.chi2 / static_cast<double>(trial.model.fit.values),
                  problem.entries()[which[worst]].id, misfit[worst]);
  for (const auto& [name, entries] :
       {std::pair{"", which}, std::pair{" of records held out", problem.holdout()}}) {
    const double slow = judge(problem, trial.model, entries).error_over_noise();
    if (slow > kBand)
      out.description += fmt::format("; the error itself{} is {:.3g} times its floor, by its slow part", name,
                                     std::sqrt(slow));
  }
  for (const auto& [name, entries] :
       {std::pair{"", which}, std::pair{" of records held out", problem.holdout()}}) {
    const Judgement j = judge(problem, trial.model, entries);
    if (torque_inside_band(problem, j.torque)) continue;
    if (trial.chi2 < kBand * static_cast<double>(trial.model.fit.values)) out.channel = "torque_Nm";
    out.description += fmt::format("; the shaft torque{} of steady stretches is off by {:.3g} Nm rms", name,
                                   j.torque.rmse_Nm());
  }
  if (!out.depends_on.empty())
    out.description += fmt::format("; it {} with {} (rank correlation {:+.2f})",
                                   strongest > 0.0 ? "grows" : "falls", out.depends_on, strongest);
  if (!out.lines_Hz.empty()) {
    out.description += "; its lines lie at";
    for (const double f : out.lines_Hz) out.description += fmt::format(" {:.1f}", f);
    out.description += " Hz";
  }
  out.description += ".";
  return out;
}

}  // namespace imrig::est
