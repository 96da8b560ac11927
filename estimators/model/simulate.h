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

// A state that a machine can be stepped by: the operations below, found by the state's type.
template <class T>
Cx<T> ahead(const Cx<T>& x, double h, const Cx<T>& d) {
  return {x.re + h * d.re, x.im + h * d.im};
}
template <class T>
Cx<T> stepped(const Cx<T>& x, double h, const Cx<T>& a, const Cx<T>& b, const Cx<T>& c, const Cx<T>& d) {
  return {x.re + (h / 6.0) * (a.re + 2.0 * (b.re + c.re) + d.re), x.im + (h / 6.0) * (a.im + 2.0 * (b.im + c.im) + d.im)};
}
template <class T>
FluxState<T> ahead(const FluxState<T>& x, double h, const FluxState<T>& d) {
  return {ahead(x.psi_s, h, d.psi_s), ahead(x.psi_r, h, d.psi_r)};
}
template <class T>
FluxState<T> stepped(const FluxState<T>& x, double h, const FluxState<T>& a, const FluxState<T>& b, const FluxState<T>& c,
                     const FluxState<T>& d) {
  return {stepped(x.psi_s, h, a.psi_s, b.psi_s, c.psi_s, d.psi_s), stepped(x.psi_r, h, a.psi_r, b.psi_r, c.psi_r, d.psi_r)};
}

template <class Machine>
typename Machine::State runge_kutta_step(const Machine& machine, const typename Machine::State& x, double h,
                                         std::complex<double> v_0, std::complex<double> v_1, double w_0,
                                         double w_1, double w_k) {
  using State = typename Machine::State;
  const auto v_half = 0.5 * (v_0 + v_1);
  const double w_half = 0.5 * (w_0 + w_1);
  const State a = machine.derivative(x, v_0, w_0, w_k);
  const State b = machine.derivative(ahead(x, 0.5 * h, a), v_half, w_half, w_k);
  const State c = machine.derivative(ahead(x, 0.5 * h, b), v_half, w_half, w_k);
  const State d = machine.derivative(ahead(x, h, c), v_1, w_1, w_k);
  return stepped(x, h, a, b, c, d);
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
