#include "estimators/diagnose/next/imagine.h"

#include <algorithm>
#include <cmath>

#include "estimators/model/effects/effect_machine.h"
#include "estimators/model/effects/registry.h"
#include "estimators/model/steady_state.h"
#include "rig/base/space_vector.h"

namespace imrig::est {

namespace {

constexpr double kUsualSample_s = 60e-6;
constexpr double kTableCurrentShare = 1e-3, kTableVoltageShare = 1e-3, kTableSpeed_rad_s = 0.05;
constexpr double kLeastHeating_K = 40.0;  // what a loaded motor reaches
constexpr double kRateStep = 0.4;
constexpr double kRunUps = 2.5;  // rotor time constants

struct Sampling {
  double step_s = kThinnedTime_s;
  int thinned = 1;
};

Sampling sampling_of(const GlobalProblem& problem) {
  const double h = problem.sample_time_s() > 0.0 ? problem.sample_time_s() : kUsualSample_s;
  const int by = std::max(1, static_cast<int>(std::floor(kThinnedTime_s / h + 1e-9)));
  return {h * by, by};
}

NoiseLevels levels_of(const GlobalProblem& problem, const std::vector<PlannedRecord>& records) {
  NoiseLevels out = problem.noise().levels;
  double voltage = 0.0;
  for (const PlannedRecord& r : records) voltage = std::max(voltage, r.v_peak_V);
  if (!(out.current_A > 0.0)) out.current_A = kTableCurrentShare * problem.largest_current_A();
  if (!(out.voltage_V > 0.0) && problem.sample_time_s() == 0.0) out.voltage_V = kTableVoltageShare * voltage;
  if (!(out.speed_rad_s > 0.0) && problem.sample_time_s() == 0.0) out.speed_rad_s = kTableSpeed_rad_s;
  return out;
}

SpaceVector voltage_V(const PlannedRecord& r, double t) {
  const double w = 2.0 * kPi * r.f_Hz;
  if (r.axis) return SpaceVector(0.0, r.v_peak_V * std::cos(w * t));
  return std::polar(r.v_peak_V * (t < r.before_s ? 1.0 : 1.0 + r.step), w * t);
}

DrivenRecord driven(const PlannedRecord& r, const Sampling& sampling, int pole_pairs, double stator_C,
                    double speed_sigma) {
  TimeSeries series;
  series.sample_time_s = sampling.step_s;
  const auto n = static_cast<std::size_t>(std::max(32.0, (r.before_s + r.simulated_s) / sampling.step_s));
  for (std::size_t k = 0; k < n; ++k)
    series.v.push_back(voltage_V(r, static_cast<double>(k) * sampling.step_s));
  series.i.assign(n, 0.0);
  const double w_r = r.kind == RecordKind::kLockedSweep ? 0.0 : 2.0 * kPi * r.f_Hz * (1.0 - r.slip);
  series.speed_rad_s.assign(n, w_r / pole_pairs);
  if (std::isfinite(stator_C)) series.stator_C.assign(n, stator_C);
  DrivenRecord record = driven_record(series, pole_pairs, 0.0);
  record.thinned = sampling.thinned;
  if (w_r != 0.0) record.speed_sigma = speed_sigma;
  record.mean_gain = 1.0 / std::sqrt(static_cast<double>(sampling.thinned));
  return record;
}

double stator_C_of(const Heat& heat, const PlannedRecord& r) {
  return heat.cold_C + r.heat * (heat.hot_C - heat.cold_C);
}

// What belongs to a record alone: entry by entry between the least and the largest of the data's records by
// the planned heat, where it is a warmth; else as some record of the data has it.
LocalVector<double> own_of(const GlobalProblem& problem, const WorkingModel& model, const PlannedRecord& r,
                           std::size_t number) {
  LocalVector<double> out = neutral_local();
  std::vector<const LocalVector<double>*> seen;
  for (std::size_t k = 0; k < model.at.local.size(); ++k) {
    if (problem.entries()[k].series && !problem.entries()[k].holdout) seen.push_back(&model.at.local[k]);
  }
  if (seen.empty()) return out;
  const std::size_t rounding = kLocalPlace[*effect_number("speed_bias")];
  for (std::size_t e = kStates; e < kLocal; ++e) {
    if (e == rounding) continue;  // what is planned is known
    const auto by_entry = [e](const auto* a, const auto* b) { return (*a)[e] < (*b)[e]; };
    if (std::string_view(local_parameter(e).name) == "warmth") {
      const auto [low, high] = std::minmax_element(seen.begin(), seen.end(), by_entry);
      out[e] = (**low)[e] + r.heat * ((**high)[e] - (**low)[e]);
    } else {
      out[e] = (*seen[number % seen.size()])[e];
    }
  }
  return out;
}

using Machine = EffectMachine<double>;

Machine::State ahead(const Machine::State& x, double h, const Machine::State& d) {
  return {x.psi_s + scaled(h, d.psi_s), x.psi_r + scaled(h, d.psi_r), x.i_b + scaled(h, d.i_b)};
}

// Planned voltage and what goes with it at t < 0, in the frame that turns with the supply.
struct RunUp {
  const PlannedRecord& r;
  double w = 0.0, w_k = 0.0, w_r = 0.0, stator_C = kMissing;
  Machine::State slope(const Machine& machine, const Machine::State& x, double t) const {
    Instant at;
    at.w_k = w_k;
    at.turn = std::polar(1.0, w_k * t);
    at.rotor_turn = std::polar(1.0, (w_r - w_k) * t);
    const SpaceVector v = voltage_V(r, t) * std::conj(at.turn);
    at.voltage_rate = r.axis ? SpaceVector(0.0, -w * r.v_peak_V * std::sin(w * t)) : SpaceVector(0.0, w) * v;
    if (std::isfinite(stator_C)) at.stator_C = stator_C;
    return machine.derivative(x, v, w_r, at);
  }
};

// Fluxes at the record's first sample: from near the linear machine's steady state over some rotor time
// constants by classical Runge-Kutta steps; an alternating field begins where its flux is near zero.
void run_up(const PlannedRecord& r, const SharedVector<double>& shared, double stator_C,
            LocalVector<double>& local) {
  RunUp run{r, 2.0 * kPi * r.f_Hz, 0.0, 0.0, stator_C};
  run.w_k = r.axis ? 0.0 : run.w;
  run.w_r = r.kind == RecordKind::kLockedSweep ? 0.0 : run.w * (1.0 - r.slip);
  const MachineParameters<double> motor{shared[0], shared[1], shared[2], shared[3]};
  double length = std::clamp(kRunUps * motor.L_m / motor.R_r, 0.1, 1.5);
  if (r.axis) length = std::ceil(2.0 * r.f_Hz * length) / (2.0 * r.f_Hz);
  for (std::size_t e = 0; e < kStates; ++e) local[e] = 0.0;
  if (!r.axis) {
    const auto start = steady_state(motor, 1, r.v_peak_V, run.w, run.w_r);
    local[0] = start.psi_s.re, local[1] = start.psi_s.im, local[2] = start.psi_r.re,
    local[3] = start.psi_r.im;
  }
  const Machine machine(shared, local);
  const double rate = (motor.R_s + motor.R_r) / motor.L_l + 2.0 * run.w + run.w_r;
  const auto steps = static_cast<int>(std::ceil(length * rate / kRateStep));
  const double h = length / steps;
  Machine::State x = machine.initial();
  for (int k = 0; k < steps; ++k) {
    const double t = (k - steps) * h;
    const auto a = run.slope(machine, x, t), b = run.slope(machine, ahead(x, 0.5 * h, a), t + 0.5 * h),
               c = run.slope(machine, ahead(x, 0.5 * h, b), t + 0.5 * h),
               d = run.slope(machine, ahead(x, h, c), t + h);
    x = ahead(ahead(ahead(ahead(x, h / 6.0, a), h / 3.0, b), h / 3.0, c), h / 6.0, d);
  }
  local[0] = x.psi_s.re, local[1] = x.psi_s.im, local[2] = x.psi_r.re, local[3] = x.psi_r.im;
  local[4] = x.i_b.re, local[5] = x.i_b.im;
}

}  // namespace

Heat heat_of(const GlobalProblem& problem) {
  Heat out;
  for (const GlobalProblem::Entry& e : problem.entries()) {
    if (!e.series) continue;
    for (const double t : e.series->stator_C) {
      if (t == kUnknown_C) continue;
      out.cold_C = std::isfinite(out.cold_C) ? std::min(out.cold_C, t) : t;
      out.hot_C = std::isfinite(out.hot_C) ? std::max(out.hot_C, t) : t;
    }
  }
  out.hot_C = std::max(out.hot_C, out.cold_C + kLeastHeating_K);
  return out;
}

GlobalProblem imagined(const GlobalProblem& problem, const WorkingModel& circuit,
                       const std::vector<PlannedRecord>& records) {
  const Heat heat = heat_of(problem);
  const NoiseLevels levels = levels_of(problem, records);
  std::vector<DrivenRecord> more;
  std::vector<NoiseLevels> noise;
  for (const PlannedRecord& r : records) {
    more.push_back(driven(r, sampling_of(problem), problem.data().pole_pairs, stator_C_of(heat, r),
                          problem.speed_sigma()));
    const double less = std::sqrt((r.before_s + r.simulated_s) / (r.before_s + r.record_s));
    noise.push_back({less * levels.current_A, less * levels.voltage_V, less * levels.speed_rad_s});
  }
  return problem.with(std::move(more), circuit.at.shared, noise);
}

GlobalPoint settled_in(const GlobalProblem& imagined, const WorkingModel& model,
                       const std::vector<PlannedRecord>& records) {
  const Heat heat = heat_of(imagined);
  GlobalPoint out = model.at;
  for (std::size_t k = 0; k < records.size(); ++k) {
    LocalVector<double> local = own_of(imagined, model, records[k], k);
    run_up(records[k], model.at.shared, stator_C_of(heat, records[k]), local);
    out.local.push_back(local);
  }
  return out;
}

}  // namespace imrig::est
