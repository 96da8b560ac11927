#include "estimators/diagnose/effect_prediction.h"

#include <algorithm>

#include "estimators/diagnose/missing/working_model.h"
#include "estimators/fit/global/points_terms.h"
#include "estimators/fit/global/settle.h"
#include "estimators/model/effects/registry.h"
#include "estimators/model/output.h"

namespace imrig::est {

ModelPrediction::ModelPrediction(const Model& model)
    : pole_pairs_(model.pole_pairs),
      machine_(model.machine()),
      linear_(model.effects.empty() && model.corrections.empty()),
      shared_(shared_vector(model)) {
  WorkingModel working;
  working.active = active_effects(model);
  local_ = working.freedom().local;
}

CurrentPrediction ModelPrediction::current(const TimeSeries& series) const {
  if (linear_) return predict_current(machine_, pole_pairs_, series);
  const DrivenRecord record = driven_record(series, pole_pairs_, 0.0);
  const LocalVector<double> local = settled(record);
  const RecordTrace trace = this->trace(record, local);
  CurrentPrediction out;
  out.initial = {Cx<double>(local[0], local[1]), Cx<double>(local[2], local[3])};
  out.first_simulated = record.frame.first;
  out.first = record.frame.first + record.frame.judged_from;
  out.noise_gain = record.frame.noise_gain;
  for (std::size_t k = record.frame.judged_from; k < record.size(); ++k) {
    const std::complex<double> measured = record.frame.i[k];
    const std::complex<double> turn = record.frame.back(k);
    out.measured.push_back(measured * turn);
    out.predicted.push_back((measured - trace.error[k - record.frame.judged_from]) * turn);
  }
  return out;
}

Whitener ModelPrediction::plain(const DrivenRecord& record) const {
  return Whitener(record, machine_, 0.0, {1.0, 0.0, 0.0});
}

LocalVector<double> ModelPrediction::settled(const DrivenRecord& record) const {
  LocalVector<double> local = neutral_local();
  settle_record(record, plain(record), steps_for(record, shared_), shared_, local_, local);
  return local;
}

RecordTrace ModelPrediction::trace(const DrivenRecord& record, const LocalVector<double>& local) const {
  RecordTrace out;
  record_terms(record, plain(record), steps_for(record, shared_), shared_, local, {}, &out);
  return out;
}

std::vector<TorquePrediction> ModelPrediction::torque(const TimeSeries& series) const {
  std::vector<TorquePrediction> out;
  if (series.torque_Nm.empty()) return out;
  DrivenRecord record = driven_record(series, pole_pairs_);
  std::vector<TorqueWindow> windows = torque_windows(series.torque_Nm, record.frame, record.thinned);
  if (windows.empty()) return out;
  weigh(windows, torque_range_Nm(windows), kMissing);
  const LocalVector<double> local = settled(record);  // the initial flux is the current's to tell
  record.torque = std::move(windows);
  const RecordTrace trace = this->trace(record, local);
  for (std::size_t w = 0; w < record.torque.size(); ++w) {
    const TorqueWindow& window = record.torque[w];
    const std::size_t middle = (window.from + window.to) / 2 * static_cast<std::size_t>(record.thinned);
    out.push_back({record.frame.first + middle, window.mean_Nm, trace.torque_Nm[w], window.sigma_Nm});
  }
  return out;
}

SteadyPoint ModelPrediction::point(const SteadyPoint& measured) const {
  if (linear_) return predict_point(machine_, pole_pairs_, measured);
  const PointPrediction p = predict_steady(shared_, pole_pairs_, measured);
  SteadyPoint out = measured;
  out.i_peak_A = p.i_peak_A;
  out.p_in_W = p.p_in_W;
  out.q_var = p.q_var;
  out.power_factor = p.p_in_W / (1.5 * measured.v_peak_V * p.i_peak_A);
  out.torque_Nm = p.torque_Nm;
  out.p_out_W = p.p_out_W;
  return out;
}

}  // namespace imrig::est
