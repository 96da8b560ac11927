#include "estimators/fit/record_problem.h"

#include <ceres/jet.h>

#include <algorithm>

#include "estimators/model/simulate.h"

namespace imrig::est {

namespace {

using Jet = ceres::Jet<double, kCircuit>;
// One real row of [J | r], and the sum of its outer products.
using Row = Eigen::Matrix<double, kUnknowns + 1, 1>;
using Products = Eigen::Matrix<double, kUnknowns + 1, kUnknowns + 1>;

MachineParameters<Jet> seeded(const MachineParameters<double>& theta) {
  return {Jet(theta.R_s, 0), Jet(theta.R_r, 1), Jet(theta.L_l, 2), Jet(theta.L_m, 3)};
}

FluxState<Jet> constant(const FluxState<double>& x) {
  return {{Jet(x.psi_s.re), Jet(x.psi_s.im)}, {Jet(x.psi_r.re), Jet(x.psi_r.im)}};
}

void add_row(const Row& row, Products& sum) { sum.noalias() += row * row.transpose(); }

}  // namespace

double RecordProblem::signal() const {
  double sum = 0.0;
  for (std::size_t k = record_.judged_from; k < record_.size(); ++k) sum += std::norm(record_.i[k]);
  return sum;
}

double RecordProblem::error(const MachineParameters<double>& theta) const {
  const LinearResponse response = linear_response(theta, record_, steps_);
  const FluxState<double> start = best_initial_state(response, record_);
  const std::complex<double> c_s = plain(start.psi_s);
  const std::complex<double> c_r = plain(start.psi_r);
  double sum = 0.0;
  for (std::size_t k = record_.judged_from; k < record_.size(); ++k) {
    sum += std::norm(response.driven[k] + response.by_stator[k] * c_s + response.by_rotor[k] * c_r -
                     record_.i[k]);
  }
  return sum;
}

Linearization RecordProblem::linearize(const MachineParameters<double>& theta,
                                       std::vector<SampleRows>* rows) const {
  const LinearResponse response = linear_response(theta, record_, steps_);
  Linearization out;
  out.start = best_initial_state(response, record_);
  Products sum = Products::Zero();
  const BaseMachine<Jet> machine(seeded(theta));
  simulate(machine, record_, constant(out.start), steps_, true, [&](std::size_t k, const FluxState<Jet>& x) {
    if (k < record_.judged_from) return;
    const Cx<Jet> i = machine.current(x);
    const std::complex<double> h_s = response.by_stator[k];
    const std::complex<double> h_r = response.by_rotor[k];
    Row real, imaginary;
    real << i.re.v, h_s.real(), -h_s.imag(), h_r.real(), -h_r.imag(), i.re.a - record_.i[k].real();
    imaginary << i.im.v, h_s.imag(), h_s.real(), h_r.imag(), h_r.real(), i.im.a - record_.i[k].imag();
    add_row(real, sum);
    add_row(imaginary, sum);
    if (rows != nullptr)
      rows->push_back(
          {real.head<kUnknowns>(), imaginary.head<kUnknowns>(), {real[kUnknowns], imaginary[kUnknowns]}});
  });
  out.normal = sum.topLeftCorner<kUnknowns, kUnknowns>();
  out.gradient = sum.col(kUnknowns).head<kUnknowns>();
  out.error = sum(kUnknowns, kUnknowns);
  return out;
}

}  // namespace imrig::est
