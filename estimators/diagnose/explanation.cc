#include "estimators/diagnose/explanation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "estimators/diagnose/candidate_rows.h"
#include "estimators/diagnose/late_channels.h"
#include "estimators/model/effects/registry.h"
#include "rig/base/listed.h"

namespace imrig::est {

namespace {

constexpr std::size_t kMostWarnings = 3;
constexpr double kPerKelvin = 0.0039;  // of copper near room temperature, and nearly of aluminium

void explain_findings(const SearchStep& step, Diagnosis& d) {
  const EffectInfo& info = kEffectInfos[d.search.findings.front().candidate.effect];
  d.explanation.push_back(fmt::format("{}.", info.sentence));
  if (info.alike[0] != '\0')
    d.explanation.push_back(fmt::format(
        "The same equation holds for {}: measurements at the terminals cannot tell.", info.alike));
  std::string values;
  for (const auto& [name, p] : d.candidates.front().estimate) {
    const std::string interval = std::isfinite(p.ci95_low)
                                     ? fmt::format("95 %: {:.4g} to {:.4g}", p.ci95_low, p.ci95_high)
                                     : "on a bound, or not determined";
    values += fmt::format("{}{} = {:.4g}{} ({})", values.empty() ? "" : "; ", name, p.value,
                          p.unit == "1" ? std::string() : fmt::format(" {}", p.unit), interval);
  }
  if (!values.empty()) d.explanation.push_back(fmt::format("{}: {}.", info.equation, values));
  std::vector<std::string> also;
  for (std::size_t k = 1; k < d.search.findings.size(); ++k)
    also.push_back(name_of(d.search.findings[k].candidate));
  if (!also.empty()) d.explanation.push_back(fmt::format("Beside it: {}.", listed(also)));
  d.explanation.push_back(fmt::format(
      "{} takes the misfit on records left out from {:.3g} to {:.3g} times what noise leaves.",
      also.empty() ? "Adding it" : "Adding them", chi2_per_value(step.base), chi2_per_value(d.search.final)));
  if (d.confusable.size() > 1)
    d.explanation.push_back(fmt::format("These data cannot tell {} apart.", listed(d.confusable)));
}

// Values for each record: what they come to in degrees.
void explain_heat(Diagnosis& d) {
  for (const CandidateResult& c : d.candidates) {
    const auto low = c.estimate.find("warmth_lowest"), high = c.estimate.find("warmth_highest");
    if (low == c.estimate.end() || high == c.estimate.end()) continue;
    const double rise = (1.0 + high->second.value) / (1.0 + low->second.value) - 1.0;
    d.explanation.push_back(
        fmt::format("{} of the warmest record is {:.2g} % above that of the coldest: about {:.2g} K.",
                    c.effect == "stator_heating" ? "R_s" : "R_r", 100.0 * rise, rise / kPerKelvin));
  }
}

// What a torque transducer may do in the place of a loss: an offset is friction as long as the shaft turns
// one way, a gain is stray load loss.
void doubt_transducer(const DataSet& data, Diagnosis& d) {
  if (d.effect.empty()) return;
  bool forward = false, backward = false;
  const auto turns = [&](double w) { forward |= w > 1.0, backward |= w < -1.0; };
  for (const Record& r : data.records) {
    for (const SteadyPoint& p : r.points) turns(p.speed_rad_s);
    if (!r.series.torque_Nm.empty())
      std::for_each(r.series.speed_rad_s.begin(), r.series.speed_rad_s.end(), turns);
  }
  if (accepted(d, *effect_number("friction_windage")) && forward != backward)
    d.explanation.push_back(
        "The shaft turns one way only: an offset of the torque sensor would look the same; check its zero at "
        "standstill.");
  if (accepted(d, *effect_number("stray_load_loss")))
    d.explanation.push_back(
        "A torque sensor that reads low under load would look much the same; check its gain.");
}

// What became of the shaft torque of time series.
void explain_torque(const GlobalProblem& problem, Diagnosis& d) {
  if (!problem.torque_refused().empty())
    d.explanation.push_back(
        fmt::format("The torque of the time series {}: it is not judged. Check its sign, unit and scale "
                    "(columns.torque_Nm), and R_s.",
                    problem.torque_refused()));
  std::size_t measured = 0, judged = 0;
  for (const GlobalProblem::Entry& e : problem.entries()) {
    if (!e.series || e.record->series.torque_Nm.empty()) continue;
    ++measured;
    judged += e.series->torque.empty() ? 0u : 1u;
  }
  if (problem.torque_refused().empty() && judged < measured)
    d.explanation.push_back(
        fmt::format("The torque of {} of {} records is not judged: the shaft stands, its speed never does, "
                    "or samples are missing.",
                    measured - judged, measured));
  const SearchChange &first = d.search.changes.front(), &last = d.search.changes.back();
  const double before = first.fitted.torque.rmse_Nm(), after = last.fitted.torque.rmse_Nm();
  if (std::isnan(before)) return;
  std::string sentence = fmt::format("The shaft torque of {} steady stretches is off by {:.3g} Nm rms",
                                     first.fitted.torque.values(), before);
  if (!d.search.findings.empty()) sentence += fmt::format(", {:.3g} Nm with what was added", after);
  d.explanation.push_back(sentence + ".");
  if (!torque_inside_band(problem, last.fitted.torque))
    d.explanation.push_back(
        "That is more than a torque bridge and a power meter leave: it is not explained.");
}

void explain_rounding(const GlobalProblem& problem, Diagnosis& d) {
  if (!(problem.speed_sigma() > 0.0)) return;
  d.explanation.push_back(
      fmt::format("The speed was rounded to steps of {:.3g} rpm: in each record it is free by half a step, "
                  "and what is no larger than that these data cannot tell{}.",
                  rpm_of_rad_s(problem.speed_rounding().step_rad_s),
                  d.rounding_in_doubt ? ", the small error that is left among it" : ""));
}

}  // namespace

void repeat_warnings(const DataSet& data, Diagnosis& d) {
  std::size_t told = 0, all = 0;
  for (const Record& r : data.records) {
    for (const std::string& warning : r.warnings) {
      if (warning.starts_with("columns not used")) continue;
      if (++all > kMostWarnings) continue;
      d.explanation.push_back(fmt::format("Look at the data first: {}: {}.", r.id, warning));
      ++told;
    }
  }
  if (all > told)
    d.explanation.push_back(fmt::format("And {} more warnings: imrig info tells them.", all - told));
}

void explain(const GlobalProblem& problem, const std::vector<std::string>& without, Diagnosis& d) {
  const SearchStep& first = d.search.steps.front();
  if (!problem.noise().declared)
    d.explanation.push_back(
        "No noise is declared: it was taken from the data, and figures relative to it are estimates.");
  if (problem.noise().declared_factor > kBelieved || problem.noise().declared_factor < 1.0 / kBelieved)
    d.explanation.push_back(
        fmt::format("The current's noise is {:.2g} times what was declared; the data are believed.",
                    problem.noise().declared_factor));
  explain_rounding(problem, d);
  if (!d.search.findings.empty()) explain_findings(first, d);
  explain_heat(d);
  if (d.verdict == "adequate") {
    const std::size_t held = problem.holdout().size();
    d.explanation.push_back(fmt::format(
        "Nothing is missing that {} records{} could show: the misfit is {:.3g} times what noise leaves.",
        problem.fitted().size(), held > 0 ? fmt::format(" (and {} held out)", held) : "",
        chi2_per_value(first.base)));
  }
  explain_torque(problem, d);
  doubt_transducer(problem.data(), d);
  explain_late_channels(problem, d);
  if (!d.effect.empty() && d.unexplained)
    d.explanation.push_back("Something remains that no effect of the library explains: " +
                            d.unexplained->description);
  if (!d.effect.empty() && !d.unexplained && !d.search.at_floor)
    d.explanation.push_back(
        "Records held out lie above what noise leaves: they may reach beyond what was fitted (larger "
        "current, "
        "flux or slip), where the form of an effect is not known.");
  if (d.verdict == "unknown")
    d.explanation.push_back((d.search.findings.empty()
                                 ? "No effect of the library explains the misfit: "
                                 : "That is no explanation: much remains, or it does not hold still: ") +
                            d.unexplained->description);
  if (!d.effect.empty() && d.search.at_floor && chi2_per_value(d.search.final) > kBand)
    d.explanation.push_back("One record alone shows part of this: the others would not predict it.");
  for (const ValuePattern& p : d.patterns) {
    if (follows(p))
      d.explanation.push_back(fmt::format(
          "A value of {} for each record would explain it, but these values follow {} ({:.0f} % of their "
          "variance): heat does not. Look for a law of {}.",
          p.effect, p.condition, 100.0 * p.share, p.condition));
  }
  if (!d.losses_in_doubt.empty())
    d.explanation.push_back(fmt::format(
        "A loss between air gap and shaft ({}) may be why the torque is off, but too few stretches of "
        "steady speed, or too much alike, show it to be sure: take more loads and speeds.",
        listed(d.losses_in_doubt)));
  if (d.verdict == "cannot_tell" && d.losses_in_doubt.empty() && !d.rounding_in_doubt)
    d.explanation.push_back("The data excite the motor too little to show most effects.");
  d.explanation.push_back(fmt::format("Ranked among {} effects{}.", d.ranked_among,
                                      without.empty() ? "" : "; ruled out: " + listed(without)));
}

}  // namespace imrig::est
