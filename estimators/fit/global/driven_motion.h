#pragma once
// A machine driven by a record, with the derivatives of its current by the lanes.
// The motion x' = f(x, p) by classical Runge-Kutta steps of half a step each; its derivatives S = dx/d(lanes)
// by one such step over the linear equation
//   S' = A S + B,  A = df/dx,  B = df/dp   by forward mode at the step's ends
// and in its middle by a parabola through three ends, or by forward mode where voltage or A bend too much for
// one; a fifth of the cost of differentiating every stage. S errs by (rate x step)^3/16 of what of A and B
// still moves.

#include <ceres/jet.h>

#include <algorithm>
#include <array>

#include "estimators/fit/global/driven_record.h"
#include "estimators/fit/global/lanes.h"
#include "estimators/model/effects/effect_machine.h"

namespace imrig::est {

// Current as the sensors show it, A, and its change by each of N lanes: real and imaginary part.
template <int N>
struct DrivenCurrent {
  std::complex<double> value;
  Eigen::Matrix<double, 2, N, Eigen::RowMajor> change;
};

// Shaft torque as the transducer shows it, N m, of the measured current (effect_machine.h), and its change.
template <int N>
struct DrivenTorque {
  double value_Nm = 0.0;
  Eigen::Matrix<double, 1, N> change;
};

// Inputs on straight lines between two samples.
struct Segment {
  std::complex<double> v_0, dv;
  double w_0 = 0.0, dw = 0.0;
  Instant from, to;

  std::complex<double> v(double part) const { return v_0 + part * dv; }
  double w(double part) const { return w_0 + part * dw; }
  Instant at(double part) const {
    if (part <= 0.0) return from;
    if (part >= 1.0) return to;
    Instant out = from;
    // Half and other parts of a short turn: the chord, stretched back to the circle.
    const auto between = [part](std::complex<double> a, std::complex<double> b) {
      const std::complex<double> chord = a + part * (b - a);
      return chord / std::abs(chord);
    };
    out.turn = between(from.turn, to.turn);
    out.rotor_turn = between(from.rotor_turn, to.rotor_turn);
    out.voltage_rate = from.voltage_rate + part * (to.voltage_rate - from.voltage_rate);
    out.speed_rate = from.speed_rate + part * (to.speed_rate - from.speed_rate);
    out.speed_bend = from.speed_bend + part * (to.speed_bend - from.speed_bend);
    out.current = from.current + part * (to.current - from.current);
    return out;
  }
};

inline constexpr double kCurve =
    0.01;  // second difference of A over A: iron or bars that change within a step or two

using PlainMachine = EffectMachine<double>;
using PlainState = EffectState<double>;

inline PlainState moved_along(const PlainState& x, double h, const PlainState& d) {
  const auto ahead = [h](const Cx<double>& a, const Cx<double>& b) {
    return Cx<double>{a.re + h * b.re, a.im + h * b.im};
  };
  return {ahead(x.psi_s, d.psi_s), ahead(x.psi_r, d.psi_r), ahead(x.i_b, d.i_b)};
}

// One Runge-Kutta step over the parts a to b of a segment of h seconds.
inline PlainState stepped(const PlainMachine& machine, const PlainState& x, const Segment& s, double a,
                          double b, double h) {
  const double middle = 0.5 * (a + b), t = h * (b - a);
  const Instant half = s.at(middle);
  const auto slope = [&](const PlainState& y, double part, const Instant& at) {
    return machine.derivative(y, s.v(part), s.w(part), at);
  };
  const PlainState k1 = slope(x, a, s.at(a));
  const PlainState k2 = slope(moved_along(x, 0.5 * t, k1), middle, half);
  const PlainState k3 = slope(moved_along(x, 0.5 * t, k2), middle, half);
  const PlainState k4 = slope(moved_along(x, t, k3), b, s.at(b));
  PlainState y = moved_along(x, t / 6.0, k1);
  y = moved_along(y, t / 3.0, k2);
  y = moved_along(y, t / 3.0, k3);
  return moved_along(y, t / 6.0, k4);
}

// The machine's linearisation on X of its six real states and N lanes. A lane of an initial state carries
// that state's own change; states without one get lanes beyond those that are used.
template <int N, int X>
class Tangent {
 public:
  using Jet = ceres::Jet<double, N>;
  using States = Eigen::Matrix<double, X, X>;
  using Columns = Eigen::Matrix<double, X, N, Eigen::RowMajor>;
  struct Slope {
    States A;
    Columns B;
    // In the middle of the step from `here` to `next`, equally long as the one from `before`.
    static Slope between(const Slope& before, const Slope& here, const Slope& next) {
      return {-0.125 * before.A + 0.75 * here.A + 0.375 * next.A,
              -0.125 * before.B + 0.75 * here.B + 0.375 * next.B};
    }
  };
  struct Sample {
    Slope slope;
    std::complex<double> value;
    Eigen::Matrix<double, 2, X> C;
    Eigen::Matrix<double, 2, N, Eigen::RowMajor> D;
  };

  Tangent(const SharedVector<double>& shared, const LocalVector<double>& local, const Lanes& lanes)
      : machine_(seeded(shared, lanes.shared, 0), seeded(local, lanes.local, lanes.shared.size())) {
    std::size_t spare = lanes.size();
    S_.setZero();
    for (std::size_t e = 0; e < lane_.size(); ++e) {
      const auto found = std::find(lanes.local.begin(), lanes.local.end(), e);
      const bool wanted = found != lanes.local.end();
      lane_[e] =
          wanted ? lanes.shared.size() + static_cast<std::size_t>(found - lanes.local.begin()) : spare++;
      if (wanted) S_(static_cast<Eigen::Index>(e), static_cast<Eigen::Index>(lane_[e])) = 1.0;
    }
  }

  Slope slope(const PlainState& x, std::complex<double> v, double w, const Instant& at) const {
    const auto state = seeded(x);
    return slope(state, machine_.inside(state, v, w, at), at);
  }

  Sample sample(const PlainState& x, std::complex<double> v, double w, const Instant& at) const {
    const auto state = seeded(x);
    const auto inside = machine_.inside(state, v, w, at);
    Sample out;
    out.slope = slope(state, inside, at);
    const Cx<Jet> i = machine_.measured_current(inside, at);
    out.value = {i.re.a, i.im.a};
    take(i.re, out.C, out.D, 0);
    take(i.im, out.C, out.D, 1);
    return out;
  }

  DrivenCurrent<N> current(const Sample& s) const { return {s.value, s.D + s.C.lazyProduct(S_)}; }

  // At sample k of the record.
  DrivenTorque<N> torque(const PlainState& x, const DrivenRecord& record, std::size_t k,
                         const Instant& at) const {
    const FrameRecord& frame = record.frame;
    const auto state = seeded(x);
    const auto in = machine_.inside(state, frame.v[k], frame.w_r[k], at);
    const Cx<Jet> off = Cx<Jet>(frame.i[k]) - machine_.measured_current(in, at);
    const Jet airgap = machine_.airgap_torque_Nm(in, state, frame.pole_pairs) +
                       machine_.torque_beside_Nm(in, state, off, frame.w_k, frame.pole_pairs);
    // Losses go with the currents as they are, not as the filter leaves them.
    const double gain = record.torque_gain(), currents = 1.0 / std::sqrt(gain);
    auto unfiltered = in;
    unfiltered.i = scaled(currents, in.i), unfiltered.i_rotor = scaled(currents, in.i_rotor);
    const Jet shown = machine_.measured_torque_Nm(airgap * (1.0 / gain) -
                                                  machine_.lost_torque_Nm(unfiltered, frame.pole_pairs));
    Eigen::Matrix<double, 1, X> C;
    Eigen::Matrix<double, 1, N> D;
    take(shown, C, D, 0);
    return {shown.a, D + C.lazyProduct(S_)};
  }

  void advance(const Slope& from, const Slope& middle, const Slope& to, double h) {
    const Columns k1 = from.A.lazyProduct(S_) + from.B;
    Columns y = S_ + 0.5 * h * k1;
    const Columns k2 = middle.A.lazyProduct(y) + middle.B;
    y = S_ + 0.5 * h * k2;
    const Columns k3 = middle.A.lazyProduct(y) + middle.B;
    y = S_ + h * k3;
    const Columns k4 = to.A.lazyProduct(y) + to.B;
    S_ += (h / 6.0) * (k1 + 2.0 * (k2 + k3) + k4);
  }

 private:
  using Machine = EffectMachine<Jet>;

  template <std::size_t M>
  static std::array<Jet, M> seeded(const std::array<double, M>& values,
                                   const std::vector<std::size_t>& entries, std::size_t first) {
    std::array<Jet, M> out;
    for (std::size_t k = 0; k < M; ++k) out[k] = Jet(values[k]);
    for (std::size_t k = 0; k < entries.size(); ++k)
      out[entries[k]].v[static_cast<Eigen::Index>(first + k)] = 1.0;
    return out;
  }

  typename Machine::State seeded(const PlainState& x) const {
    const auto at = [this](double value, std::size_t e) {
      Jet jet(value);
      if (e < lane_.size()) jet.v[static_cast<Eigen::Index>(lane_[e])] = 1.0;
      return jet;
    };
    return {{at(x.psi_s.re, 0), at(x.psi_s.im, 1)},
            {at(x.psi_r.re, 2), at(x.psi_r.im, 3)},
            {at(x.i_b.re, 4), at(x.i_b.im, 5)}};
  }

  // A Jet's lanes: those of states to a row of A, the others to a row of B.
  template <class RowsA, class RowsB>
  void take(const Jet& jet, RowsA& A, RowsB& B, Eigen::Index row) const {
    B.row(row) = jet.v.transpose();
    for (std::size_t e = 0; e < lane_.size(); ++e) {
      const auto lane = static_cast<Eigen::Index>(lane_[e]);
      A(row, static_cast<Eigen::Index>(e)) = jet.v[lane];
      B(row, lane) = 0.0;
    }
  }

  Slope slope(const typename Machine::State& x, const typename Machine::Inside& inside,
              const Instant& at) const {
    const auto d = machine_.derivative(x, inside, at);
    Slope out;
    take(d.psi_s.re, out.A, out.B, 0);
    take(d.psi_s.im, out.A, out.B, 1);
    take(d.psi_r.re, out.A, out.B, 2);
    take(d.psi_r.im, out.A, out.B, 3);
    if constexpr (X > 4) {
      take(d.i_b.re, out.A, out.B, 4);
      take(d.i_b.im, out.A, out.B, 5);
    }
    return out;
  }

  Machine machine_;
  std::array<std::size_t, static_cast<std::size_t>(X)> lane_{};
  Columns S_;
};

template <int N, int X, class Visit, class Torque>
void drive_states(const DrivenRecord& record, int steps, const SharedVector<double>& shared,
                  const LocalVector<double>& local, const Lanes& lanes, Visit&& visit, Torque&& torque) {
  const PlainMachine machine(shared, local);
  Tangent<N, X> tangent(shared, local, lanes);
  using Sample = typename Tangent<N, X>::Sample;
  PlainState x = machine.initial();
  const double h = record.frame.sample_time_s, part = 1.0 / steps;
  const auto sample = [&](std::size_t k, const Instant& at) {
    return tangent.sample(x, record.frame.v[k], record.frame.w_r[k], at);
  };
  const auto between = [](const typename Tangent<N, X>::Slope& slope) {
    Sample out;
    out.slope = slope;
    return out;
  };
  // Whether the slopes around step m of the segment from sample k lie on a parabola.
  using Slope = typename Tangent<N, X>::Slope;
  const auto smooth = [&](std::size_t k, int m, const Slope& a, const Slope& b, const Slope& c) {
    const auto& v = record.frame.v;
    const bool straight =  // within a segment the input is
        m > 0 || (k > 0 && std::norm(v[k + 1] - 2.0 * v[k] + v[k - 1]) < kBend * kBend * std::norm(v[k]));
    return straight && (a.A - 2.0 * b.A + c.A).squaredNorm() < kCurve * kCurve * b.A.squaredNorm();
  };
  Instant here = record.at(0);
  auto from = sample(0, here);
  Slope before = from.slope;
  for (std::size_t k = 0;; ++k) {
    visit(k, tangent.current(from));
    if (torque.wants(k)) torque(k, tangent.torque(x, record, k, here));
    if (k + 1 == record.size()) return;
    const Segment s{record.frame.v[k],
                    record.frame.v[k + 1] - record.frame.v[k],
                    record.frame.w_r[k],
                    record.frame.w_r[k + 1] - record.frame.w_r[k],
                    here,
                    record.at(k + 1)};
    for (int m = 0; m < steps; ++m) {
      const double a = m * part, b = (m + 0.5) * part, c = (m + 1) * part;
      x = stepped(machine, x, s, a, b, h);
      const PlainState half = x;
      x = stepped(machine, x, s, b, c, h);
      auto to = m + 1 == steps ? sample(k + 1, s.to) : between(tangent.slope(x, s.v(c), s.w(c), s.at(c)));
      const auto middle = smooth(k, m, before, from.slope, to.slope)
                              ? Slope::between(before, from.slope, to.slope)
                              : tangent.slope(half, s.v(b), s.w(b), s.at(b));
      tangent.advance(from.slope, middle, to.slope, h * part);
      before = from.slope;
      from = std::move(to);
    }
    here = s.to;
  }
}

// Whether these parameters, or a change along these lanes, give the bar a deep layer.
bool has_deep_layer(const SharedVector<double>& shared, const LocalVector<double>& local, const Lanes& lanes);
// How fast that layer settles, rad/s.
double deep_layer_rate(const SharedVector<double>& shared);

// Visits every sample of the record: visit(k, DrivenCurrent<N>), and torque(k, DrivenTorque<N>) where
// torque.wants(k). lanes and the states without one must fit into N. steps: a sample.
template <int N, class Visit, class Torque>
void drive(const DrivenRecord& record, int steps, const SharedVector<double>& shared,
           const LocalVector<double>& local, const Lanes& lanes, Visit&& visit, Torque&& torque) {
  if (has_deep_layer(shared, local, lanes)) {
    drive_states<N, 6>(record, steps, shared, local, lanes, visit, torque);
  } else {
    drive_states<N, 4>(record, steps, shared, local, lanes, visit, torque);
  }
}

}  // namespace imrig::est
