#pragma once
// What a model says about a record: the current for the measured voltage and speed. The initial flux is
// estimated from the record itself (linear least squares), in hold-out records too: it is a state, not a
// parameter.

#include <complex>
#include <cstddef>
#include <vector>

#include "estimators/model/frame_record.h"
#include "estimators/model/model.h"

namespace imrig::est {

struct CurrentPrediction {
  std::size_t first = 0;  // sample of the series that entry 0 belongs to
  std::vector<std::complex<double>>
      measured;  // A, stationary frame; filtered like the voltage where that was
  std::vector<std::complex<double>> predicted;  // A, likewise
  FluxState<double> initial;                    // Wb, estimated, at series sample `first_simulated`
  std::size_t first_simulated = 0;
  double noise_gain = 1.0;  // sigma of white current noise in `measured` over that in the series
};

// Throws Error when the record cannot be used (too short, missing values).
CurrentPrediction predict_current(const MachineParameters<double>& machine, int pole_pairs,
                                  const TimeSeries& series);

}  // namespace imrig::est
