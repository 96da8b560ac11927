#include "estimators/diagnose/late_channels.h"

#include <fmt/format.h>

#include <cmath>

#include "estimators/diagnose/candidate_rows.h"
#include "estimators/model/effects/registry.h"

namespace imrig::est {

namespace {

constexpr double kHalfASample = 0.25;  // of it
constexpr double kAlike = 0.1;

// s; 0: not accepted.
double lag_of(const Diagnosis& d, const char* effect, std::size_t parameter) {
  const std::size_t number = *effect_number(effect);
  return accepted(d, number) ? d.search.final.model.at.shared[kSharedPlace[number] + parameter] : 0.0;
}

// Voltages that are means over a sample, or held during it, belong to its middle.
void explain_lag(const GlobalProblem& problem, Diagnosis& d) {
  const std::size_t number = *effect_number("voltage_lag");
  if (!accepted(d, number)) return;
  const double lag_s = d.search.final.model.at.shared[kSharedPlace[number]];
  for (const GlobalProblem::Entry& e : problem.entries()) {
    if (!e.series) continue;
    const double half_s = 0.5 * e.record->series.sample_time_s;
    if (std::abs(std::abs(lag_s) - half_s) > kHalfASample * half_s) return;
    d.explanation.push_back(
        fmt::format("That is about half a sample: are these voltages means over a sample, or held during it, with "
                    "the time of its {}? Then no sensor lags; they belong to the middle of the sample.",
                    lag_s < 0.0 ? "beginning" : "end"));
    return;
  }
}

// The second order tells what kind of sensor is late.
void explain_late_speed(Diagnosis& d) {
  const std::size_t number = *effect_number("speed_bias");
  if (!accepted(d, number)) return;
  const double* p = d.search.final.model.at.shared.data() + kSharedPlace[number];
  const double late_ms = 1e3 * p[2], share = p[3];
  if (late_ms == 0.0) return;
  if (late_ms < 0.0) {
    d.explanation.push_back(fmt::format(
        "The measured speed is {:.3g} ms ahead of the currents: are they delayed, or the speed smoothed "
        "around its samples?",
        -late_ms));
    return;
  }
  std::string like;
  if (share == 0.0)
    like = "as behind a filter, or counted over a window";
  else if (share > 0.42)
    like = "as a pure delay would";
  else if (share > 0.2)
    like = fmt::format("as counts over the last {:.2g} ms", 2.0 * late_ms);
  else
    like = fmt::format("as behind a first-order filter of {:.2g} ms", late_ms);
  d.explanation.push_back(
      fmt::format("The measured speed comes {:.3g} ms late, {}: a property of the sensor, not of the motor.",
                  late_ms, like));
}

}  // namespace

bool currents_are_late(const Diagnosis& d) {
  const double voltage_s = lag_of(d, "voltage_lag", 0), speed_s = lag_of(d, "speed_bias", 2);
  return voltage_s < 0.0 && speed_s < 0.0 && std::abs(voltage_s - speed_s) < -kAlike * voltage_s;
}

void explain_late_channels(const GlobalProblem& problem, Diagnosis& d) {
  if (currents_are_late(d)) {
    d.explanation.push_back(fmt::format(
        "Voltage and speed are both {:.3g} ms ahead of the currents: it is the currents that come late.",
        -1e3 * lag_of(d, "voltage_lag", 0)));
    return;
  }
  explain_lag(problem, d);
  explain_late_speed(d);
}

}  // namespace imrig::est
