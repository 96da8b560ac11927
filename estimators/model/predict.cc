#include "estimators/model/predict.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "estimators/model/simulate.h"

namespace imrig::est {

namespace {

using Complex = std::complex<double>;

std::vector<Complex> currents(const BaseMachine<double>& machine, const FrameRecord& record,
                              const FluxState<double>& start, int steps, bool driven) {
  std::vector<Complex> all(record.size());
  simulate(machine, record, start, steps, driven,
           [&](std::size_t k, const FluxState<double>& x) { all[k] = plain(machine.current(x)); });
  return all;
}

// The parts of the current of a machine that is linear in its state, in the record's frame: what the voltage
// drives from zero flux, and what 1 Wb of initial stator or rotor flux gives.
struct LinearResponse {
  std::vector<Complex> driven, by_stator, by_rotor;
};

LinearResponse linear_response(const MachineParameters<double>& p, const FrameRecord& record, int steps) {
  const BaseMachine<double> machine(p);
  return {currents(machine, record, {}, steps, true),
          currents(machine, record, {Cx<double>(1.0, 0.0), {}}, steps, false),
          currents(machine, record, {{}, Cx<double>(1.0, 0.0)}, steps, false)};
}

FluxState<double> best_initial_state(const LinearResponse& response, const FrameRecord& record) {
  Eigen::Matrix2cd normal = Eigen::Matrix2cd::Zero();
  Eigen::Vector2cd right = Eigen::Vector2cd::Zero();
  for (std::size_t k = record.judged_from; k < record.size(); ++k) {
    const Eigen::Vector2cd row(response.by_stator[k], response.by_rotor[k]);
    normal += row.conjugate() * row.transpose();
    right += row.conjugate() * (record.i[k] - response.driven[k]);
  }
  normal.diagonal().array() +=
      1e-13 * normal.diagonal().real().sum();  // a state that the record forgets at once stays finite
  const Eigen::Vector2cd best = normal.ldlt().solve(right);
  return {Cx<double>(best[0]), Cx<double>(best[1])};
}

}  // namespace

CurrentPrediction predict_current(const MachineParameters<double>& p, int pole_pairs,
                                  const TimeSeries& series) {
  const FrameRecord record = to_frame(series, pole_pairs);
  const int steps = steps_per_sample(p, record);
  CurrentPrediction out;
  const LinearResponse response = linear_response(p, record, steps);
  out.initial = best_initial_state(response, record);
  out.first_simulated = record.first;
  out.first = record.first + record.judged_from;
  out.noise_gain = record.noise_gain;
  for (std::size_t k = record.judged_from; k < record.size(); ++k) {
    out.measured.push_back(record.i[k] * record.back(k));
    const Complex predicted = response.driven[k] + response.by_stator[k] * plain(out.initial.psi_s) +
                              response.by_rotor[k] * plain(out.initial.psi_r);
    out.predicted.push_back(predicted * record.back(k));
  }
  return out;
}

}  // namespace imrig::est
