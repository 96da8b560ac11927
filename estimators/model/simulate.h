#pragma once
// From a record's voltage and speed to the current a machine would draw.
// Between samples the voltage goes on a straight line in the frame that turns with the supply, and the speed
// on a straight line: exact for a steady sinusoid at any sample time, and plain linear interpolation where
// the sample time is short. The state is stepped by the classical fourth-order Runge-Kutta method, with so
// many steps per sample that |A| h stays below kMaxRateStep.

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "estimators/model/base_machine.h"
#include "estimators/model/frame_record.h"

namespace imrig::est {

// Bound of |A| h. RK4 then errs by less than (0.2)^4/120 = 1.3e-5 of the part of the state that still moves
// in the frame.
inline constexpr double kMaxRateStep = 0.2;

int steps_per_sample(const MachineParameters<double>& p, const FrameRecord& record);

template <class Machine>
typename Machine::State runge_kutta_step(const Machine& machine, const typename Machine::State& x, double h,
                                         std::complex<double> v_0, std::complex<double> v_1, double w_0,
                                         double w_1, double w_k) {
  using State = typename Machine::State;
  const auto ahead = [&x](double step, const State& d) {
    return State{{x.psi_s.re + step * d.psi_s.re, x.psi_s.im + step * d.psi_s.im},
                 {x.psi_r.re + step * d.psi_r.re, x.psi_r.im + step * d.psi_r.im}};
  };
  const auto v_half = 0.5 * (v_0 + v_1);
  const double w_half = 0.5 * (w_0 + w_1);
  const State a = machine.derivative(x, v_0, w_0, w_k);
  const State b = machine.derivative(ahead(0.5 * h, a), v_half, w_half, w_k);
  const State c = machine.derivative(ahead(0.5 * h, b), v_half, w_half, w_k);
  const State d = machine.derivative(ahead(h, c), v_1, w_1, w_k);
  const auto mean = [h](const auto& y, const auto& p, const auto& q, const auto& r, const auto& s) {
    return y + (h / 6.0) * (p + 2.0 * (q + r) + s);
  };
  return {{mean(x.psi_s.re, a.psi_s.re, b.psi_s.re, c.psi_s.re, d.psi_s.re),
           mean(x.psi_s.im, a.psi_s.im, b.psi_s.im, c.psi_s.im, d.psi_s.im)},
          {mean(x.psi_r.re, a.psi_r.re, b.psi_r.re, c.psi_r.re, d.psi_r.re),
           mean(x.psi_r.im, a.psi_r.im, b.psi_r.im, c.psi_r.im, d.psi_r.im)}};
}

// Calls visit(k, state) for each sample k of the record, the first included. driven = false leaves the
// voltage out: the response to the initial state alone.
template <class Machine, class Visit>
void simulate(const Machine& machine, const FrameRecord& record, typename Machine::State x, int steps,
              bool driven, Visit&& visit) {
  const double h = record.sample_time_s / steps;
  const double part = 1.0 / steps;
  const std::size_t n = record.size();
  if (n == 0) return;
  visit(std::size_t{0}, x);
  for (std::size_t k = 0; k + 1 < n; ++k) {
    const std::complex<double> v = driven ? record.v[k] : 0.0;
    const std::complex<double> dv = driven ? record.v[k + 1] - v : 0.0;
    const double w = record.w_r[k];
    const double dw = record.w_r[k + 1] - w;
    for (int m = 0; m < steps; ++m) {
      const double from = m * part;
      const double to = (m + 1) * part;
      x = runge_kutta_step(machine, x, h, v + from * dv, v + to * dv, w + from * dw, w + to * dw, record.w_k);
    }
    visit(k + 1, x);
  }
}

}  // namespace imrig::est
