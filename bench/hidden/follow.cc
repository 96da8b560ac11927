#include "bench/hidden/follow.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace imrig::bench {
namespace {

bool in(const std::vector<std::string>& list, const std::string& name) {
  return std::find(list.begin(), list.end(), name) != list.end();
}

// chi2 of the best fit with this effect; infinite without one.
double left_by(const est::SearchStep& step, const std::string& effect) {
  double least = std::numeric_limits<double>::infinity();
  for (const est::Trial& t : step.trials) {
    if (t.sound && est::name_of(t.candidate) == effect) least = std::min(least, t.chi2);
  }
  return least;
}

struct Pair {
  std::string truth, rival;
};

// What was hidden and in the set, with each rival that is said to be separable.
std::vector<Pair> pairs_of(const est::Diagnosis& first, const std::vector<std::string>& truth) {
  std::vector<Pair> out;
  for (const std::string& name : first.confusable) {
    for (const std::string& rival : first.confusable) {
      if (!in(truth, name) || in(truth, rival)) continue;
      const auto& told = first.next_experiment->gauges;
      const bool gauge = std::any_of(told.begin(), told.end(), [&](const auto& g) {
        return (g.first == name && g.second == rival) || (g.first == rival && g.second == name);
      });
      if (!gauge) out.push_back({name, rival});
    }
  }
  return out;
}

double nearest(const est::SearchStep& step, const std::vector<Pair>& pairs) {
  double out = std::numeric_limits<double>::infinity();
  for (const Pair& p : pairs)
    out = std::min(out, 0.5 * std::sqrt(std::max(0.0, left_by(step, p.rival) - left_by(step, p.truth))));
  return out;
}

bool settles(const est::Diagnosis& second, const std::vector<Pair>& pairs) {
  return std::all_of(pairs.begin(), pairs.end(), [&](const Pair& p) {
    return in(second.confusable, p.truth) && !in(second.confusable, p.rival);
  });
}

std::vector<Wanted> wanted(const est::NextExperiment& next) {
  std::vector<Wanted> out;
  for (int n = 0; n < next.repeats; ++n) {
    for (const est::PlannedRecord& r : next.records)
      out.push_back({r.f_Hz, r.v_peak_V, r.step, r.slip, r.axis, r.heat, r.before_s + r.record_s});
  }
  return out;
}

}  // namespace

FollowUp follow_up(const Sealed& sealed, const est::Model& model, const est::Diagnosis& first,
                   const SealOptions& seal, int threads) {
  FollowUp out;
  if (!first.next_experiment) return out;
  const est::NextExperiment& next = *first.next_experiment;
  const std::vector<Pair> pairs = pairs_of(first, sealed.seal.truth);
  out.what = next.what;
  out.reference = pairs.empty();
  if (out.reference) return out;
  out.before = nearest(first.search.steps.front(), pairs);
  out.forecast = next.distinguishability_after;
  Sealed more = sealed;
  take_more(cell(sealed.seal.cell), wanted(next), more, seal);
  est::DiagnoseOptions options;
  options.threads = threads;
  const est::Diagnosis second = est::diagnose(model, more.data, options);
  out.after = nearest(second.search.steps.front(), pairs);
  out.settled = settles(second, pairs);
  return out;
}

}  // namespace imrig::bench
