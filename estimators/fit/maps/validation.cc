#include "estimators/fit/maps/validation.h"

#include <algorithm>
#include <cmath>

#include "estimators/fit/maps/mapped_machine.h"
#include "estimators/model/frame_record.h"
#include "estimators/model/simulate.h"
#include "estimators/model/steady_state.h"
#include "rig/base/error.h"

namespace imrig::est {

namespace {

using Complex = std::complex<double>;
constexpr std::size_t kShown = 600;
constexpr double kSlowest_rad_s = 2.0;
constexpr double kBeforeStart_s = 0.02;
constexpr double kMostFluxLeft = 0.3;

double mean_C(const TimeSeries& s) {
  double sum = 0.0, n = 0.0;
  for (const double T : s.stator_C) {
    if (!std::isfinite(T)) continue;
    sum += T;
    n += 1.0;
  }
  return n > 0.0 ? sum / n : kMissing;
}

template <class Machine>
std::vector<Complex> simulated(const Machine& machine, const FrameRecord& record, const typename Machine::State& start,
                               int steps) {
  std::vector<Complex> i(record.size());
  simulate(machine, record, start, steps, true,
           [&](std::size_t k, const typename Machine::State& x) { i[k] = plain(machine.current(x)); });
  return i;
}

double nrmse(const FrameRecord& record, const std::vector<Complex>& i) {
  double error = 0.0, signal = 0.0;
  for (std::size_t k = record.judged_from; k < record.size(); ++k) {
    error += std::norm(i[k] - record.i[k]);
    signal += std::norm(record.i[k]);
  }
  return std::sqrt(error / signal);
}

// Stator flux and current at the record's first sample, in the frame, of a steady phasor.
struct First {
  Complex psi_s, i_s;
};
First first_phasor(const FrameRecord& record, double R_s) {
  const std::size_t n = std::min<std::size_t>(record.size(), static_cast<std::size_t>(0.1 / record.sample_time_s));
  Complex v = 0.0, i = 0.0;
  for (std::size_t k = record.judged_from; k < n; ++k) {
    v += record.v[k];
    i += record.i[k];
  }
  const double count = static_cast<double>(n - record.judged_from);
  return {(v - R_s * i) / count / Complex(0.0, record.w_k), i / count};
}

// A start is from zero flux when the standing rotor's EMF before it, R_r/L_m of its flux, is gone. Relative to the flux that
// the supply will drive.
bool flux_left(const TimeSeries& s, const FrameRecord& frame, const MachineParameters<double>& p) {
  const auto n = std::min<std::size_t>(frame.first, static_cast<std::size_t>(kBeforeStart_s / s.sample_time_s));
  if (n == 0) return false;
  Complex emf = 0.0;
  for (std::size_t k = frame.first - n; k < frame.first; ++k) emf += s.v[k] / static_cast<double>(n);
  const double driven = std::abs(frame.v.back()) / std::abs(frame.w_k);
  return std::abs(emf) * p.L_m / p.R_r > kMostFluxLeft * driven;
}

void show(TransientCheck& check, const FrameRecord& record, const std::vector<Complex>& full,
          const std::vector<Complex>& rated) {
  const std::size_t every = std::max<std::size_t>(1, record.size() / kShown);
  for (std::size_t k = record.judged_from; k < record.size(); k += every) {
    check.t_s.push_back(static_cast<double>(k) * record.sample_time_s);
    check.measured.push_back(record.i[k]);
    check.full.push_back(full[k]);
    check.rated.push_back(rated[k]);
  }
}

class Validating {
 public:
  Validating(const DataSet& data, const ParameterMaps& maps, const MachineParameters<double>& base)
      : data_(data), maps_(maps), base_(base) {}

  Validation run() {
    for (std::size_t k = 0; k < data_.records.size(); ++k) {
      const Record& record = data_.records[k];
      const RecordKind kind = record.kind;
      if (kind == RecordKind::kStep || kind == RecordKind::kSteady || kind == RecordKind::kNoLoad) powers(k);
      try {
        if (kind == RecordKind::kStep) out_.steps.push_back(transient(record, false));
        if (kind == RecordKind::kStartup) out_.starts.push_back(transient(record, true));
      } catch (const Error&) {
        // The fit has said why this record cannot be used.
      }
    }
    std::erase_if(out_.steps, [](const auto& check) { return !std::isfinite(check.full_nrmse); });
    std::erase_if(out_.starts, [](const auto& check) { return !std::isfinite(check.full_nrmse); });
    pool();
    return std::move(out_);
  }

 private:
  void powers(std::size_t k) {
    for (const SteadyPhasor& p : running_phasors(data_, k)) {
      const MappedMachine machine(maps_, base_, p.stator_C, p.w_e);
      const MappedSteady full = mapped_steady(machine, std::abs(p.v), p.w_e, p.w_r);
      const auto rated = steady_state(base_, data_.pole_pairs, std::abs(p.v), p.w_e, p.w_r);
      if (!full.settled) continue;
      out_.powers.push_back({data_.records[k].id, data_.records[k].holdout, p.w_e / (2.0 * kPi), std::abs(p.v),
                             p.slip_rad_s() / p.w_e, p.input_W(), full.p_in_W, rated.p_in_W});
    }
  }

  TransientCheck transient(const Record& record, bool from_zero) {
    TransientCheck check;
    check.id = record.id;
    check.holdout = record.holdout;
    const FrameRecord frame = to_driving_frame(record.series, data_.pole_pairs);
    if (std::abs(frame.w_k) < kSlowest_rad_s) return check;
    check.f_Hz = std::abs(frame.w_k) / (2.0 * kPi);
    if (from_zero && flux_left(record.series, frame, base_)) {
      out_.notes.push_back(record.id + ": the rotor still had flux when it started, from what was before; not judged as a start from zero");
      return check;
    }
    const MappedMachine machine(maps_, base_, mean_C(record.series), frame.w_k);
    const int steps = steps_per_sample(base_, frame);
    MappedState start;
    FluxState<double> rated_start;
    if (!from_zero) {
      const First a = first_phasor(frame, machine.R_s()), b = first_phasor(frame, base_.R_s);
      start = machine.steady_state(a.psi_s, a.i_s);
      rated_start = {Cx<double>(b.psi_s), Cx<double>(b.psi_s - base_.L_l * b.i_s)};
    }
    const auto full = simulated(machine, frame, start, steps);
    const auto rated = simulated(BaseMachine<double>(base_), frame, rated_start, steps);
    check.full_nrmse = nrmse(frame, full);
    check.rated_nrmse = nrmse(frame, rated);
    show(check, frame, full, rated);
    return check;
  }

  void pool() {
    if (out_.powers.empty()) return;
    out_.rated_W = 0.0;
    for (const auto& p : out_.powers) out_.rated_W = std::max(out_.rated_W, p.measured_W);
    double full2 = 0.0, rated2 = 0.0;
    out_.worst_full = out_.worst_rated = 0.0;
    for (const auto& p : out_.powers) {
      const double full = (p.full_W - p.measured_W) / out_.rated_W, rated = (p.rated_W - p.measured_W) / out_.rated_W;
      full2 += full * full;
      rated2 += rated * rated;
      out_.worst_full = std::max(out_.worst_full, std::abs(full));
      out_.worst_rated = std::max(out_.worst_rated, std::abs(rated));
    }
    const double n = static_cast<double>(out_.powers.size());
    out_.rms_full = std::sqrt(full2 / n);
    held_out();
    out_.rms_rated = std::sqrt(rated2 / n);
  }

  void held_out() {
    double square = 0.0, worst = 0.0;
    for (const PowerCheck& check : out_.powers) {
      if (!check.holdout) continue;
      const double off = (check.full_W - check.measured_W) / out_.rated_W;
      ++out_.held_out;
      square += off * off;
      worst = std::max(worst, std::abs(off));
    }
    if (out_.held_out == 0) return;
    out_.rms_held_out = std::sqrt(square / static_cast<double>(out_.held_out));
    out_.worst_held_out = worst;
  }

  const DataSet& data_;
  const ParameterMaps& maps_;
  const MachineParameters<double>& base_;
  Validation out_;
};

}  // namespace

std::optional<MachineParameters<double>> circuit_at_largest_power(const ParameterMaps& maps, double R_s) {
  const MapPoint* best = nullptr;
  for (const auto& point : maps.points) {
    if (point.for_R_r && point.state.L_m_H > 0.0 && (best == nullptr || point.phasor.input_W() > best->phasor.input_W()))
      best = &point;
  }
  if (best == nullptr || !maps.L_l.known()) return std::nullopt;
  if (maps.R_s.failure.empty()) R_s = maps.R_s.at(best->phasor.stator_C);
  return MachineParameters<double>{R_s, best->state.R_r_ohm, maps.L_l.at(std::abs(best->phasor.i)), best->state.L_m_H};
}

Validation validate(const DataSet& data, const ParameterMaps& maps, const MachineParameters<double>& constants,
                    const std::string& from) {
  Validation out = Validating(data, maps, constants).run();
  out.constants = constants;
  out.constants_from = from;
  return out;
}

}  // namespace imrig::est
