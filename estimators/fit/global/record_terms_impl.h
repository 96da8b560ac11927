#pragma once
// record_terms for a fixed number of derivative lanes; instantiated in record_terms_N.cc, a file each so that
// they compile side by side.

#include <ceres/jet.h>

#include <array>

#include "estimators/fit/global/record_terms.h"
#include "estimators/model/effects/effect_machine.h"

namespace imrig::est {

template <class Machine>
typename Machine::State stepped(const typename Machine::State& x, double h,
                                const typename Machine::State& d) {
  const auto ahead = [h](const auto& a, const auto& b) {
    using C = std::decay_t<decltype(a)>;
    return C{a.re + h * b.re, a.im + h * b.im};
  };
  return {ahead(x.psi_s, d.psi_s), ahead(x.psi_r, d.psi_r), ahead(x.i_b, d.i_b)};
}

// Inputs on straight lines between two samples.
struct Segment {
  std::complex<double> v_0, dv;
  double w_0 = 0.0, dw = 0.0;
  Instant from, to;
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
    return out;
  }
};

// Classical fourth-order Runge-Kutta over one sample.
template <class Machine>
void advance(const Machine& machine, typename Machine::State& x, const Segment& s, double h, int steps) {
  const double part = 1.0 / steps;
  Instant begin = s.from;
  for (int m = 0; m < steps; ++m) {
    const double a = m * part, b = (m + 0.5) * part, c = (m + 1) * part;
    const Instant middle = s.at(b), end = s.at(c);
    const auto k1 = machine.derivative(x, s.v_0 + a * s.dv, s.w_0 + a * s.dw, begin);
    const auto k2 = machine.derivative(stepped<Machine>(x, 0.5 * h * part, k1), s.v_0 + b * s.dv,
                                       s.w_0 + b * s.dw, middle);
    const auto k3 = machine.derivative(stepped<Machine>(x, 0.5 * h * part, k2), s.v_0 + b * s.dv,
                                       s.w_0 + b * s.dw, middle);
    const auto k4 =
        machine.derivative(stepped<Machine>(x, h * part, k3), s.v_0 + c * s.dv, s.w_0 + c * s.dw, end);
    const double sixth = h * part / 6.0;
    const auto add = [sixth](auto& y, const auto& p, const auto& q, const auto& r, const auto& t) {
      y.re = y.re + sixth * (p.re + 2.0 * (q.re + r.re) + t.re);
      y.im = y.im + sixth * (p.im + 2.0 * (q.im + r.im) + t.im);
    };
    add(x.psi_s, k1.psi_s, k2.psi_s, k3.psi_s, k4.psi_s);
    add(x.psi_r, k1.psi_r, k2.psi_r, k3.psi_r, k4.psi_r);
    add(x.i_b, k1.i_b, k2.i_b, k3.i_b, k4.i_b);
    begin = end;
  }
}

template <class Machine, class Visit>
void drive(const Machine& machine, const DrivenRecord& record, int steps, Visit&& visit) {
  typename Machine::State x = machine.initial();
  Instant here = record.at(0);
  for (std::size_t k = 0;; ++k) {
    visit(k, x, here);
    if (k + 1 == record.size()) return;
    const Instant next = record.at(k + 1);
    const Segment s{record.frame.v[k],
                    record.frame.v[k + 1] - record.frame.v[k],
                    record.frame.w_r[k],
                    record.frame.w_r[k + 1] - record.frame.w_r[k],
                    here,
                    next};
    advance(machine, x, s, record.frame.sample_time_s, steps);
    here = next;
  }
}

// Adds rows to normal equations some dozens at a time.
template <int Columns>
class RowSums {
 public:
  using Row = Eigen::Matrix<double, Columns, 1>;
  void add(const Row& row) {
    rows_.col(filled_++) = row;
    if (filled_ == kBatch) flush();
  }
  void flush() {
    if (filled_ == 0) return;
    sum_.template selfadjointView<Eigen::Lower>().rankUpdate(rows_.leftCols(filled_));
    filled_ = 0;
  }
  Eigen::MatrixXd take() {
    flush();
    Eigen::MatrixXd out = sum_.template selfadjointView<Eigen::Lower>();
    sum_.setZero();
    return out;
  }

 private:
  static constexpr int kBatch = 64;
  Eigen::Matrix<double, Columns, kBatch> rows_ = Eigen::Matrix<double, Columns, kBatch>::Zero();
  Eigen::MatrixXd sum_ = Eigen::MatrixXd::Zero(Columns, Columns);
  int filled_ = 0;
};

template <int N>
RecordTerms record_terms_n(const DrivenRecord& record, const Whitener& whitener, int steps,
                           const SharedVector<double>& shared, const LocalVector<double>& local,
                           const Lanes& lanes, RecordTrace* trace) {
  using Jet = ceres::Jet<double, N>;
  using Vector = Eigen::Matrix<std::complex<double>, N + 1, 1>;
  SharedVector<Jet> seeded_shared;
  LocalVector<Jet> seeded_local;
  for (std::size_t k = 0; k < kShared; ++k) seeded_shared[k] = Jet(shared[k]);
  for (std::size_t k = 0; k < kLocal; ++k) seeded_local[k] = Jet(local[k]);
  int lane = 0;
  for (const std::size_t entry : lanes.shared) seeded_shared[entry].v[lane++] = 1.0;
  for (const std::size_t entry : lanes.local) seeded_local[entry].v[lane++] = 1.0;

  const EffectMachine<Jet> machine(seeded_shared, seeded_local);
  RecordTerms out;
  const auto used = static_cast<Eigen::Index>(lanes.size());
  const std::size_t from = record.frame.judged_from, judged = record.size() - from;
  Eigen::Matrix<double, N + 1, N + 1> whole = Eigen::Matrix<double, N + 1, N + 1>::Zero();
  out.stretch_gradient.setZero(used, kStretches);
  if (trace != nullptr && trace->want_rows) trace->rows.setZero(static_cast<Eigen::Index>(2 * judged), used);
  RowSums<N + 1> sums;
  std::size_t stretch = 0;
  const auto close_stretch = [&] {
    const Eigen::MatrixXd sum = sums.take();
    whole += sum;
    out.stretch_gradient.col(static_cast<Eigen::Index>(stretch)) = sum.col(N).head(used);
    out.stretch_chi2[stretch] = sum(N, N);
  };
  Vector stator = Vector::Zero(), rotor = Vector::Zero(), noise = Vector::Zero();
  drive(machine, record, steps, [&](std::size_t k, const auto& x, const Instant& at) {
    if (k < from) return;
    const std::size_t in = (k - from) * kStretches / judged;
    if (in != stretch) {
      close_stretch();
      stretch = in;
    }
    const Cx<Jet> i = machine.measured_current(x, record.frame.v[k], record.frame.w_r[k], at);
    const std::complex<double> error = std::complex<double>(i.re.a, i.im.a) - record.frame.i[k];
    out.error2 += std::norm(error);
    out.signal2 += std::norm(record.frame.i[k]);
    Vector row;
    for (int n = 0; n < N; ++n) row[n] = {i.re.v[n], i.im.v[n]};
    row[N] = error;
    const auto& filter = whitener.step(k);
    const std::complex<double> c = whitener.output(1.0, 0.0);
    row -= c * (stator - rotor);
    const Vector next =
        filter.F(0, 0) * stator + filter.F(0, 1) * rotor + filter.input(0) * noise + filter.K(0) * row;
    rotor = filter.F(1, 0) * stator + filter.F(1, 1) * rotor + filter.input(1) * noise + filter.K(1) * row;
    noise = filter.K(2) * row;
    stator = next;
    row *= filter.weight;
    sums.add(row.real());
    sums.add(row.imag());
    if (trace == nullptr) return;
    trace->error.push_back(-error);
    trace->whitened.push_back(-row[N]);
    if (!trace->want_rows) return;
    const auto at_row = static_cast<Eigen::Index>(2 * (k - from));
    trace->rows.row(at_row) = row.head(used).real().transpose();
    trace->rows.row(at_row + 1) = row.head(used).imag().transpose();
  });
  close_stretch();
  out.values = 2 * judged;
  out.chi2 = whole(N, N);
  out.gradient = whole.col(N).head(used);
  out.normal = whole.topLeftCorner(used, used);
  return out;
}

}  // namespace imrig::est
