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

double nearest(const est::SearchStep& step, const std::vector<std::string>& set,
               const std::vector<std::string>& truth) {
  double out = std::numeric_limits<double>::infinity();
  for (const std::string& name : set) {
    if (!in(truth, name)) continue;
    for (const std::string& rival : set) {
      if (in(truth, rival)) continue;
      out = std::min(out, 0.5 * std::sqrt(std::max(0.0, left_by(step, rival) - left_by(step, name))));
    }
  }
  return out;
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
  const std::vector<std::string>& truth = sealed.seal.truth;
  out.before = nearest(first.search.steps.front(), first.confusable, truth);
  if (!first.next_experiment) return out;
  const est::NextExperiment& next = *first.next_experiment;
  out.what = next.what;
  out.reference = next.records.empty();
  if (out.reference) return out;
  out.forecast = next.distinguishability_after;
  Sealed more = sealed;
  take_more(cell(sealed.seal.cell), wanted(next), more, seal);
  est::DiagnoseOptions options;
  options.threads = threads;
  const est::Diagnosis second = est::diagnose(model, more.data, options);
  out.after = nearest(second.search.steps.front(), first.confusable, truth);
  out.settled = second.confusable.size() == 1 && in(truth, second.confusable.front());
  return out;
}

}  // namespace imrig::bench
