#include "estimators/fit/global/record_terms.h"

#include <algorithm>
#include <cmath>

#include "estimators/fit/global/driven_motion.h"
#include "estimators/model/effects/registry.h"
#include "rig/base/error.h"

namespace imrig::est {

template <int N>
RecordTerms record_terms_n(const DrivenRecord&, const Whitener&, int, const SharedVector<double>&,
                           const LocalVector<double>&, const Lanes&, RecordTrace*);

extern template RecordTerms record_terms_n<8>(const DrivenRecord&, const Whitener&, int,
                                              const SharedVector<double>&, const LocalVector<double>&,
                                              const Lanes&, RecordTrace*);
extern template RecordTerms record_terms_n<16>(const DrivenRecord&, const Whitener&, int,
                                               const SharedVector<double>&, const LocalVector<double>&,
                                               const Lanes&, RecordTrace*);
extern template RecordTerms record_terms_n<24>(const DrivenRecord&, const Whitener&, int,
                                               const SharedVector<double>&, const LocalVector<double>&,
                                               const Lanes&, RecordTrace*);
extern template RecordTerms record_terms_n<40>(const DrivenRecord&, const Whitener&, int,
                                               const SharedVector<double>&, const LocalVector<double>&,
                                               const Lanes&, RecordTrace*);

RecordTerms record_terms(const DrivenRecord& record, const Whitener& whitener, int steps,
                         const SharedVector<double>& shared, const LocalVector<double>& local,
                         const Lanes& lanes, RecordTrace* trace) {
  // Every state needs a lane, wanted or not.
  const std::size_t states = has_deep_layer(shared, local, lanes) ? 6 : 4;
  const auto wanted =
      std::count_if(lanes.local.begin(), lanes.local.end(), [&](auto e) { return e < states; });
  const std::size_t n = lanes.size() + states - static_cast<std::size_t>(wanted);
  const auto run = n <= 8    ? record_terms_n<8>
                   : n <= 16 ? record_terms_n<16>
                   : n <= 24 ? record_terms_n<24>
                             : record_terms_n<40>;
  if (n > 40) throw Error("global fit", "has more unknowns than one evaluation takes");
  return run(record, whitener, steps, shared, local, lanes, trace);
}

namespace {

// 1/s: how fast an inverter's drop that follows the model's current switches a phase over.
double switching_rate(const DrivenRecord& record, const SharedVector<double>& shared) {
  static const std::size_t place = kSharedPlace[*effect_number("inverter_dead_time")];
  const double drop_V = shared[place], width_A = shared[place + 1], by_model = shared[place + 3];
  if (drop_V == 0.0 || by_model == 0.0) return 0.0;
  double square = 0.0;
  for (const std::complex<double>& i : record.frame.i)
    square += std::norm(i) / static_cast<double>(record.size());
  const double crossed_A = 0.5 * std::abs(record.frame.w_k) * record.frame.sample_time_s * std::sqrt(square);
  return by_model * std::abs(drop_V) / (std::hypot(width_A, crossed_A) * shared[2]);
}

}  // namespace

int steps_for(const DrivenRecord& record, const SharedVector<double>& shared) {
  constexpr double kMaxRateStep = 0.55;  // half of it errs by 1e-5 of what still moves in the frame
  constexpr double kMostSwitching = 11.0;  // 20 steps a sample: a current held at zero has nothing to switch
  double fastest = 0.0;
  for (const double w : record.frame.w_r)
    fastest = std::max({fastest, std::abs(w), std::abs(w - record.frame.w_k)});
  double rate =
      (shared[0] + shared[1]) / shared[2] + shared[1] / shared[3] + fastest + std::abs(record.frame.w_k);
  if (has_deep_layer(shared, {}, {})) rate += deep_layer_rate(shared);
  rate += std::min(switching_rate(record, shared), kMostSwitching / record.frame.sample_time_s);
  return static_cast<int>(
      std::clamp(std::ceil(rate * record.frame.sample_time_s / kMaxRateStep), 1.0, 200.0));
}

}  // namespace imrig::est
