#include "estimators/fit/record_problem.h"

#include <ceres/jet.h>

#include "estimators/model/predict.h"
#include "estimators/model/simulate.h"

namespace imrig::est {

namespace {

using Complex = std::complex<double>;
using Jet = ceres::Jet<double, kCircuit>;

// Columns of the complex least-squares problem: the four real circuit parameters, the two complex fluxes, the
// residual.
constexpr int kColumns = kCircuit + 3;
using Row = Eigen::Matrix<Complex, kColumns, 1>;
using Gram = Eigen::Matrix<Complex, kColumns, kColumns>;

MachineParameters<Jet> seeded(const MachineParameters<double>& theta) {
  return {Jet(theta.R_s, 0), Jet(theta.R_r, 1), Jet(theta.L_l, 2), Jet(theta.L_m, 3)};
}

FluxState<Jet> constant(const FluxState<double>& x) {
  return {{Jet(x.psi_s.re), Jet(x.psi_s.im)}, {Jet(x.psi_r.re), Jet(x.psi_r.im)}};
}

// d/d Im(c) = j d/d Re(c): the real unknowns behind the columns are a_0..a_3, h_s, j h_s, h_r, j h_r.
struct RealColumn {
  int column;
  bool turned;
};
constexpr RealColumn kReal[kUnknowns] = {{0, false}, {1, false}, {2, false}, {3, false},
                                         {4, false}, {4, true},  {5, false}, {5, true}};

double real_product(const Gram& gram, RealColumn a, RealColumn b) {
  const Complex g = gram(a.column, b.column);  // sum conj(a) b
  if (a.turned == b.turned) return g.real();
  return a.turned ? g.imag() : -g.imag();
}

Eigen::Matrix<double, kUnknowns, 1> real_score(const Eigen::Matrix<Complex, kColumns - 1, 1>& products) {
  Eigen::Matrix<double, kUnknowns, 1> score;
  for (int m = 0; m < kUnknowns; ++m)
    score[m] = kReal[m].turned ? products[kReal[m].column].imag() : products[kReal[m].column].real();
  return score;
}

}  // namespace

double RecordProblem::signal() const {
  double sum = 0.0;
  for (std::size_t k = record_.judged_from; k < record_.size(); ++k) sum += std::norm(record_.i[k]);
  return sum;
}

FluxState<double> RecordProblem::best_start(const MachineParameters<double>& theta, double& error) const {
  const FluxState<double> start = best_initial_state(theta, record_, steps_);
  const BaseMachine<double> machine(theta);
  error = 0.0;
  simulate(machine, record_, start, steps_, true, [&](std::size_t k, const FluxState<double>& x) {
    if (k >= record_.judged_from) error += std::norm(plain(machine.current(x)) - record_.i[k]);
  });
  return start;
}

Linearization RecordProblem::linearize(const MachineParameters<double>& theta, const FluxState<double>& start,
                                       std::size_t bin) const {
  std::vector<Complex> by_stator(record_.size());
  std::vector<Complex> by_rotor(record_.size());
  const BaseMachine<double> plain_machine(theta);
  simulate(
      plain_machine, record_, FluxState<double>{Cx<double>(1.0, 0.0), {}}, steps_, false,
      [&](std::size_t k, const FluxState<double>& x) { by_stator[k] = plain(plain_machine.current(x)); });
  simulate(plain_machine, record_, FluxState<double>{{}, Cx<double>(1.0, 0.0)}, steps_, false,
           [&](std::size_t k, const FluxState<double>& x) { by_rotor[k] = plain(plain_machine.current(x)); });

  Gram gram = Gram::Zero();
  Eigen::Matrix<Complex, kColumns - 1, 1> in_bin = Eigen::Matrix<Complex, kColumns - 1, 1>::Zero();
  Linearization out;
  const BaseMachine<Jet> machine(seeded(theta));
  simulate(machine, record_, constant(start), steps_, true, [&](std::size_t k, const FluxState<Jet>& x) {
    if (k < record_.judged_from) return;
    const Cx<Jet> i = machine.current(x);
    Row row;
    for (int m = 0; m < kCircuit; ++m) row[m] = {i.re.v[m], i.im.v[m]};
    row[kCircuit] = by_stator[k];
    row[kCircuit + 1] = by_rotor[k];
    row[kCircuit + 2] = Complex(i.re.a, i.im.a) - record_.i[k];
    for (int n = 0; n < kColumns; ++n) {
      for (int m = 0; m <= n; ++m) gram(m, n) += std::conj(row[m]) * row[n];
    }
    for (int m = 0; m < kColumns - 1; ++m) in_bin[m] += std::conj(row[m]) * row[kColumns - 1];
    if ((k - record_.judged_from + 1) % bin == 0) {
      out.scores.push_back(real_score(in_bin));
      in_bin.setZero();
    }
  });
  if (judged() % bin != 0) out.scores.push_back(real_score(in_bin));

  for (int m = 0; m < kColumns; ++m) {
    for (int n = 0; n < m; ++n) gram(m, n) = std::conj(gram(n, m));
  }
  for (int m = 0; m < kUnknowns; ++m) {
    for (int n = 0; n < kUnknowns; ++n) out.normal(m, n) = real_product(gram, kReal[m], kReal[n]);
    out.gradient[m] = real_product(gram, kReal[m], {kColumns - 1, false});
  }
  out.error = gram(kColumns - 1, kColumns - 1).real();
  return out;
}

}  // namespace imrig::est
