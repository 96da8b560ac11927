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

}  // namespace

FluxState<double> best_initial_state(const MachineParameters<double>& p, const FrameRecord& record,
                                     int steps) {
  const BaseMachine<double> machine(p);
  const FluxState<double> zero;
  const auto driven = currents(machine, record, zero, steps, true);
  const auto by_stator = currents(machine, record, {Cx<double>(1.0, 0.0), {}}, steps, false);
  const auto by_rotor = currents(machine, record, {{}, Cx<double>(1.0, 0.0)}, steps, false);
  Eigen::Matrix2cd normal = Eigen::Matrix2cd::Zero();
  Eigen::Vector2cd right = Eigen::Vector2cd::Zero();
  for (std::size_t k = record.judged_from; k < record.size(); ++k) {
    const Eigen::Vector2cd row(by_stator[k], by_rotor[k]);
    normal += row.conjugate() * row.transpose();
    right += row.conjugate() * (record.i[k] - driven[k]);
  }
  normal.diagonal().array() +=
      1e-13 * normal.diagonal().real().sum();  // a state that the record forgets at once stays finite
  const Eigen::Vector2cd best = normal.ldlt().solve(right);
  return {Cx<double>(best[0]), Cx<double>(best[1])};
}

CurrentPrediction predict_current(const MachineParameters<double>& p, int pole_pairs,
                                  const TimeSeries& series) {
  const FrameRecord record = to_frame(series, pole_pairs);
  const int steps = steps_per_sample(p, record);
  CurrentPrediction out;
  out.initial = best_initial_state(p, record, steps);
  out.first_simulated = record.first;
  out.first = record.first + record.judged_from;
  out.noise_gain = record.noise_gain;
  const auto frame = currents(BaseMachine<double>(p), record, out.initial, steps, true);
  for (std::size_t k = record.judged_from; k < record.size(); ++k) {
    out.measured.push_back(record.i[k] * record.back(k));
    out.predicted.push_back(frame[k] * record.back(k));
  }
  return out;
}

}  // namespace imrig::est
