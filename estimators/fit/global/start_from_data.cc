#include "estimators/fit/global/start_from_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "estimators/fit/assemble.h"
#include "estimators/fit/global/joint_circuit.h"
#include "estimators/fit/student_t.h"
#include "rig/base/listed.h"

namespace imrig::est {

namespace {

constexpr double kSure = 0.01, kSureResistance = 0.05;  // relative sigma
constexpr double kMisfit = 1.5;                         // times noise: beyond it the circuit lacks something

double sigma_of(const Parameter& p) { return 0.5 * (p.ci95_high - p.ci95_low) / kNormal975; }

bool measured_apart(const Parameter& R_s) {
  return R_s.found.starts_with("dc test") || R_s.found.starts_with("standstill");
}

Told told_of(const Parameter& p, bool resistance) {
  if (!is_result(p) || is_start(p)) return {};
  const double sigma = sigma_of(p);
  if (!std::isfinite(sigma)) return {p.value, 0.0, true};
  const bool apart = resistance && measured_apart(p);
  if (resistance && !apart) return {};
  if (sigma <= (apart ? kSureResistance : kSure) * p.value) return {p.value, sigma, true};
  return apart ? Told{p.value, sigma, false} : Told{};
}

std::string fitted_to(const JointCircuit& joint) {
  const std::size_t n = joint.records.size();
  return n == 1 ? "the one record there is" : fmt::format("{} records together", n);
}

std::string sentence_of(const DataStart& start, const JointCircuit& joint) {
  std::string out;
  if (!start.together.empty())
    out = fmt::format("{} {} fitted to {} without a start from outside", listed(start.together),
                      start.together.size() == 1 ? "was" : "were", fitted_to(joint));
  if (!start.starts.empty())
    out += fmt::format("{}{} {} not determined by these data: a rough start and no result{}",
                       out.empty() ? "" : "; ", listed(start.starts), start.starts.size() == 1 ? "is" : "are",
                       joint.failure.empty() ? "" : " (" + joint.failure + ")");
  if (joint.times_noise > kMisfit)
    out += fmt::format(
        "; the misfit is {:.3g} times what noise leaves: the circuit may lack an effect, and the parameters "
        "are "
        "what fits best without it",
        joint.times_noise);
  return out;
}

}  // namespace

bool is_result(const Parameter& p) {
  const double width = p.ci95_high - p.ci95_low;
  return p.known() && p.value > 0.0 && !(width > p.value);
}

DataStart start_from_data(const Model& model, const DataSet& data, int threads) {
  DataStart out;
  out.model = model;
  const auto& bases = base_parameters();
  if (std::all_of(bases.begin(), bases.end(), [&](const auto& b) { return is_result(model.*b.place); }))
    return out;
  std::array<Told, 4> told;
  for (std::size_t m = 0; m < told.size(); ++m) told[m] = told_of(model.*bases[m].place, m == 0);
  const JointCircuit joint = joint_circuit(data, told, threads);
  for (std::size_t m = 0; m < told.size(); ++m) {
    if (told[m].held) continue;
    const bool open = joint.open[m] || !joint.failure.empty();
    (open ? out.starts : out.together).emplace_back(bases[m].name);
    Parameter p;
    p.value = joint.value[m];
    p.unit = bases[m].unit;
    p.found = open ? std::string(kRoughStart) + ": these data leave it open"
                   : fmt::format("all records together, {} record{}", joint.records.size(),
                                 joint.records.size() == 1 ? "" : "s");
    if (!open) {
      const double half = kNormal975 * std::hypot(joint.sigma[m], gain_sigma(data.accuracy) * p.value);
      p.ci95_low = p.value - half;
      p.ci95_high = p.value + half;
    }
    out.model.*bases[m].place = p;
    if (m == 0) out.model.R_s_stator_C = kMissing;
  }
  out.records = joint.records;
  out.sentence = sentence_of(out, joint);
  return out;
}

}  // namespace imrig::est
