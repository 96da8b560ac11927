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
std::vector<Complex> simulated(const Machine& machine, const FrameRecord& record, const FluxState<double>& start,
                               int steps) {
  std::vector<Complex> i(record.size());
  simulate(machine, record, start, steps, true,
           [&](std::size_t k, const FluxState<double>& x) { i[k] = plain(machine.current(x)); });
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

// The state of the record's first sample, in the frame: of a start zero, else from the steady phasor there.
FluxState<double> first_state(const FrameRecord& record, bool from_zero, double R_s, double L_l) {
  if (from_zero) return {};
  const std::size_t n = std::min<std::size_t>(record.size(), static_cast<std::size_t>(0.1 / record.sample_time_s));
  Complex v = 0.0, i = 0.0;
  for (std::size_t k = record.judged_from; k < n; ++k) {
    v += record.v[k];
    i += record.i[k];
  }
  const double count = static_cast<double>(n - record.judged_from);
  const Complex psi_s = (v - R_s * i) / count / Complex(0.0, record.w_k);
  return {Cx<double>(psi_s), Cx<double>(psi_s - L_l * i / count)};
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
    const FrameRecord frame = to_frame(record.series, data_.pole_pairs);
    if (std::abs(frame.w_k) < kSlowest_rad_s) return check;
    check.f_Hz = std::abs(frame.w_k) / (2.0 * kPi);
    const MappedMachine machine(maps_, base_, mean_C(record.series), frame.w_k);
    const int steps = steps_per_sample(base_, frame);
    auto full = simulated(machine, frame, first_state(frame, from_zero, machine.R_s(), machine.L_l(0.0)), steps);
    auto rated = simulated(BaseMachine<double>(base_), frame, first_state(frame, from_zero, base_.R_s, base_.L_l), steps);
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
    out_.rms_rated = std::sqrt(rated2 / n);
  }

  const DataSet& data_;
  const ParameterMaps& maps_;
  const MachineParameters<double>& base_;
  Validation out_;
};

}  // namespace

Validation validate(const DataSet& data, const ParameterMaps& maps, const MachineParameters<double>& base) {
  return Validating(data, maps, base).run();
}

}  // namespace imrig::est
