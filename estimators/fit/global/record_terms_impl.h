#pragma once
// record_terms for a fixed number of derivative lanes; instantiated in record_terms_N.cc, a file each so that
// they compile side by side.

#include <array>

#include "estimators/fit/global/driven_motion.h"
#include "estimators/fit/global/record_terms.h"
#include "estimators/fit/global/torque_means.h"
#include "estimators/fit/row_sums.h"

namespace imrig::est {

template <int N>
RecordTerms record_terms_n(const DrivenRecord& record, const Whitener& whitener, int steps,
                           const SharedVector<double>& shared, const LocalVector<double>& local,
                           const Lanes& lanes, RecordTrace* trace) {
  using Vector = Eigen::Matrix<std::complex<double>, N + 1, 1>;
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
  TorqueMeans<N> torque(record);
  Vector stator = Vector::Zero(), rotor = Vector::Zero(), noise = Vector::Zero();
  const auto current = [&](std::size_t k, const DrivenCurrent<N>& i) {
    if (k < from) return;
    const std::size_t in = (k - from) * kStretches / judged;
    if (in != stretch) {
      close_stretch();
      stretch = in;
    }
    const std::complex<double> error = i.value - record.frame.i[k];
    out.error2 += std::norm(error);
    out.signal2 += std::norm(record.frame.i[k]);
    Vector row;
    row.template head<N>().real() = i.change.row(0);
    row.template head<N>().imag() = i.change.row(1);
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
  };
  drive<N>(record, steps, shared, local, lanes, current, torque);
  close_stretch();
  out.values = 2 * judged;
  out.chi2 = whole(N, N);
  out.gradient = whole.col(N).head(used);
  out.normal = whole.topLeftCorner(used, used);
  torque.add_to(out, used);
  if (trace != nullptr) trace->torque_Nm = torque.predicted_Nm();
  return out;
}

}  // namespace imrig::est
