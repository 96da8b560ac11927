#include "estimators/model/predict.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "estimators/model/sampled_machine.h"

namespace imrig::est {

namespace {

using Complex = std::complex<double>;

// The parts of the current of a machine that is linear in its state, in the record's frame: what the voltage
// drives from zero flux, and what 1 Wb of initial stator or rotor flux gives.
struct LinearResponse {
  std::vector<Complex> driven, by_stator, by_rotor;
};

LinearResponse linear_response(const MachineParameters<double>& p, const FrameRecord& record) {
  LinearResponse out;
  for (auto* part : {&out.driven, &out.by_stator, &out.by_rotor}) part->reserve(record.size());
  FluxSide<4> x;
  x.s.set(1, 1.0);
  x.r.set(2, 1.0);
  const double per_leakage = 1.0 / p.L_l;
  run_columns<4>(
      SampledMachine<1>(p, record, speed_range(record)), record.w_r, x,
      [&](std::size_t k, Side<4>& u) { u.set(0, record.v[k]); },
      [&](std::size_t, const FluxSide<4>& flux) {
        const Side<4> i{per_leakage * (flux.s.re - flux.r.re), per_leakage * (flux.s.im - flux.r.im)};
        out.driven.push_back(i.at(0));
        out.by_stator.push_back(i.at(1));
        out.by_rotor.push_back(i.at(2));
      });
  return out;
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
  const FrameRecord record = to_driving_frame(series, pole_pairs);
  CurrentPrediction out;
  const LinearResponse response = linear_response(p, record);
  out.initial = best_initial_state(response, record);
  out.first_simulated = record.first;
  out.first = record.first + record.judged_from;
  out.noise_gain = record.noise_gain;
  for (std::size_t k = record.judged_from; k < record.size(); ++k) {
    const Complex back = record.back(k);
    out.measured.push_back(record.i[k] * back);
    const Complex predicted = response.driven[k] + response.by_stator[k] * plain(out.initial.psi_s) +
                              response.by_rotor[k] * plain(out.initial.psi_r);
    out.predicted.push_back(predicted * back);
  }
  return out;
}

}  // namespace imrig::est
