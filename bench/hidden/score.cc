#include "bench/hidden/score.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>

#include "estimators/diagnose/diagnose.h"
#include "estimators/fit/identify.h"
#include "estimators/model/effects/registry.h"

namespace imrig::bench {
namespace {

constexpr double kAtFloor = 1.05;

// What somebody knows who has the name plate alone.
est::Model rough(const Machine& m) {
  est::Model model;
  model.pole_pairs = m.pole_pairs;
  const double Z = m.v_V / m.i_A, w = 2.0 * kPi * m.f_Hz;
  model.R_s = {0.03 * Z, kMissing, kMissing, "ohm", "nominal"};
  model.R_r = {0.03 * Z, kMissing, kMissing, "ohm", "nominal"};
  model.L_l = {0.18 * Z / w, kMissing, kMissing, "H", "nominal"};
  model.L_m = {2.2 * Z / w, kMissing, kMissing, "H", "nominal"};
  return model;
}

est::Model base_model(const Sealed& sealed, int threads, std::string& from) {
  try {
    est::IdentifyOptions options;
    options.threads = threads;
    est::Model model = est::identify(sealed.data, options).model;
    (void)model.machine();
    from = "identified";
    return model;
  } catch (const std::exception&) {
    from = "rough";
    return rough(sealed.seal.machine);
  }
}

double over_floor(const est::Judgement& j) {
  const double floor = j.floor();
  return floor > 0.0 ? j.nrmse() / floor : 0.0;
}

std::string told(const est::CandidateResult& c) {
  std::string text = c.form;
  for (const auto& [name, p] : c.estimate)
    text += fmt::format(", {} {:.3g} ({:.3g} to {:.3g})", name, p.value, p.ci95_low, p.ci95_high);
  return text;
}

void count_false(const est::Diagnosis& d, Outcome& out) {
  for (const est::Finding& f : d.search.findings) {
    bool told = out.holds(est::name_of(f.candidate));
    for (const std::size_t rival : f.rivals) told = told || out.holds(est::kEffectInfos[rival].name);
    out.false_accepted += told ? 0 : 1;
  }
}

// Of the base parameters, where all that was hidden was accepted and nothing else.
void count_covered(const est::Diagnosis& d, Outcome& out) {
  if (!out.seal.exact || out.seal.outside || !out.exact()) return;
  const Machine& m = out.seal.machine;
  const double truth[] = {m.R_s, m.R_r, m.L_l, m.L_m};
  const est::WorkingModel& model = d.search.final.model;
  for (std::size_t e = 0; e < est::kBase; ++e) {
    ++out.intervals;
    out.covered += std::abs(model.at.shared[e] - truth[e]) <= 1.959964 * model.sigma(e) ? 1 : 0;
  }
}

void read(const est::Diagnosis& d, Outcome& out) {
  out.verdict = d.verdict, out.named = d.effect, out.confusable = d.confusable;
  for (const est::Candidate& c : d.search.final.model.active) out.accepted.push_back(est::name_of(c));
  for (const est::CandidateResult& c : d.candidates) {
    if (c.effect == d.effect) out.estimate = told(c);
    if (!out.holds(c.effect) || std::sqrt(c.score) < out.sqrt_lambda) continue;
    out.sqrt_lambda = std::sqrt(std::max(c.score, 0.0));
    out.d = c.distinguishability;
  }
  out.doubted = d.unexplained.has_value() || !d.search.at_floor;
  count_false(d, out);
  count_covered(d, out);
  const auto& changes = d.search.changes;
  if (changes.empty()) return;
  out.chi2_before = changes.front().fitted.chi2_per_value(),
  out.chi2_after = changes.back().fitted.chi2_per_value();
  out.excess = std::sqrt(std::max(0.0, out.chi2_before - 1.0) * changes.front().fitted.values);
  out.base_holdout_over_floor = over_floor(changes.front().holdout);
  out.holdout_over_floor = over_floor(changes.back().holdout);
}

}  // namespace

bool Outcome::holds(const std::string& effect) const {
  return std::find(seal.truth.begin(), seal.truth.end(), effect) != seal.truth.end();
}

bool Outcome::set_holds_truth() const {
  return std::any_of(confusable.begin(), confusable.end(),
                     [&](const std::string& name) { return holds(name); });
}

bool Outcome::set_holds_rival() const {
  return std::any_of(confusable.begin(), confusable.end(),
                     [&](const std::string& name) { return !holds(name); });
}

bool Outcome::at_floor() const { return holdout_over_floor <= kAtFloor; }

bool Outcome::at_chance() const {
  return holdout_over_floor <= kAtFloor * std::max(1.0, nothing_over_floor.value_or(1.0));
}

bool Outcome::exact() const {
  return accepted.size() == seal.truth.size() &&
         std::all_of(accepted.begin(), accepted.end(), [&](const std::string& name) { return holds(name); });
}

double Outcome::excess_removed() const {
  if (chi2_before <= 1.0) return 1.0;
  return 1.0 - std::max(0.0, chi2_after - 1.0) / (chi2_before - 1.0);
}

Outcome score(const Sealed& sealed, int threads, const SealOptions* follow) {
  Outcome out;
  out.seal = sealed.seal;
  const auto start = std::chrono::steady_clock::now();
  try {
    const est::Model model = base_model(sealed, threads, out.base_from);
    est::DiagnoseOptions options;
    options.threads = threads;
    if (cell(sealed.seal.cell).removed) options.without = sealed.seal.truth;
    const est::Diagnosis diagnosis = est::diagnose(model, sealed.data, options);
    read(diagnosis, out);
    if (follow != nullptr && out.set_holds_truth() && out.set_holds_rival())
      out.follow = follow_up(sealed, model, diagnosis, *follow, threads);
  } catch (const std::exception& error) {
    out.failed = error.what();
  }
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return out;
}

}  // namespace imrig::bench
