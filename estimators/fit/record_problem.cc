#include "estimators/fit/record_problem.h"

#include <ceres/jet.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "estimators/model/simulate.h"

namespace imrig::est {

namespace {

using Complex = std::complex<double>;
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

constexpr double kTurns =
    3.0;  // periods of the supply from which the voltage's faults can be told from the machine ...
constexpr double kCircular =
    0.2;  // ... if |sum v^2| / sum |v|^2 over the record, in the stationary frame, is below this

bool faults_can_be_told(const FrameRecord& record) {
  const double duration = record.sample_time_s * static_cast<double>(record.size());
  if (std::abs(record.w_k) * duration < kTurns * 2.0 * kPi) return false;
  Complex square = 0.0;
  double power = 0.0;
  for (std::size_t k = 0; k < record.size(); ++k) {
    const Complex v = record.v[k] * record.back(k);
    square += v * v;
    power += std::norm(v);
  }
  return std::abs(square) < kCircular * power;
}

std::vector<Complex> currents(const MachineParameters<double>& theta, const FrameRecord& record,
                              const FluxState<double>& start, int steps, bool driven) {
  const BaseMachine<double> machine(theta);
  std::vector<Complex> all(record.size());
  simulate(machine, record, start, steps, driven,
           [&](std::size_t k, const FluxState<double>& x) { all[k] = plain(machine.current(x)); });
  return all;
}

}  // namespace

RecordProblem::RecordProblem(const FrameRecord& record, int steps, bool look_for_faults)
    : record_(record), steps_(steps) {
  const bool faults = look_for_faults && faults_can_be_told(record);
  for (int m = kCircuit; m < (faults ? kUnknowns : kCircuit + 4); ++m) linear_unknowns_.push_back(m);
  if (!faults) return;
  mirrored_ = record;
  offset_ = record;
  for (std::size_t k = 0; k < record.size(); ++k) {
    const Complex turn = std::conj(record.back(k));
    mirrored_.v[k] = std::conj(record.v[k]) * turn * turn;
    offset_.v[k] = turn;
  }
}

double RecordProblem::signal() const {
  double sum = 0.0;
  for (std::size_t k = record_.judged_from; k < record_.size(); ++k) sum += std::norm(record_.i[k]);
  return sum;
}

// The current is linear in what is behind the circuit: driven + linear' c; c by least squares.
RecordProblem::Responses RecordProblem::responses(const MachineParameters<double>& theta) const {
  Responses out;
  out.driven = currents(theta, record_, {}, steps_, true);
  std::vector<std::vector<Complex>> columns{
      currents(theta, record_, {Cx<double>(1.0, 0.0), {}}, steps_, false),
      currents(theta, record_, {{}, Cx<double>(1.0, 0.0)}, steps_, false)};
  if (!mirrored_.v.empty()) {
    columns.push_back(currents(theta, mirrored_, {}, steps_, true));
    columns.push_back(currents(theta, offset_, {}, steps_, true));
  }
  const auto n = static_cast<Eigen::Index>(columns.size());
  out.linear.assign(record_.size(), Coefficients::Zero());
  for (Eigen::Index c = 0; c < n; ++c) {
    for (std::size_t k = 0; k < record_.size(); ++k)
      out.linear[k][c] = columns[static_cast<std::size_t>(c)][k];
  }
  Eigen::MatrixXcd normal = Eigen::MatrixXcd::Zero(n, n);
  Eigen::VectorXcd right = Eigen::VectorXcd::Zero(n);
  for (std::size_t k = record_.judged_from; k < record_.size(); ++k) {
    const auto& h = out.linear[k];
    const Complex left = record_.i[k] - out.driven[k];
    for (Eigen::Index a = 0; a < n; ++a) {
      right[a] += std::conj(h[a]) * left;
      for (Eigen::Index b = 0; b <= a; ++b) normal(a, b) += std::conj(h[a]) * h[b];
    }
  }
  const Eigen::VectorXd scale = normal.diagonal().real().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  Eigen::MatrixXcd scaled =
      scale.asDiagonal() * normal.selfadjointView<Eigen::Lower>().toDenseMatrix() * scale.asDiagonal();
  scaled.diagonal().array() += 1e-13;  // a state that the record forgets at once stays finite
  out.best = Coefficients::Zero();
  out.best.head(n) = scale.asDiagonal() * scaled.ldlt().solve(scale.asDiagonal() * right);
  return out;
}

double RecordProblem::error(const MachineParameters<double>& theta) const {
  const Responses response = responses(theta);
  double sum = 0.0;
  for (std::size_t k = record_.judged_from; k < record_.size(); ++k) {
    const Complex predicted = response.driven[k] + (response.linear[k].array() * response.best.array()).sum();
    sum += std::norm(predicted - record_.i[k]);
  }
  return sum;
}

Linearization RecordProblem::linearize(const MachineParameters<double>& theta,
                                       std::vector<SampleRows>* rows) const {
  const Responses response = responses(theta);
  Linearization out;
  out.start = {Cx<double>(response.best[0]), Cx<double>(response.best[1])};
  FrameRecord corrected;
  if (!mirrored_.v.empty()) {
    corrected = record_;
    for (std::size_t k = 0; k < corrected.size(); ++k) {
      corrected.v[k] += response.best[2] * mirrored_.v[k] + response.best[3] * offset_.v[k];
    }
  }
  Products sum = Products::Zero();
  const BaseMachine<Jet> machine(seeded(theta));
  const FrameRecord& input = mirrored_.v.empty() ? record_ : corrected;
  simulate(machine, input, constant(out.start), steps_, true, [&](std::size_t k, const FluxState<Jet>& x) {
    if (k < record_.judged_from) return;
    const Cx<Jet> i = machine.current(x);
    Row real, imaginary;
    real.head<kCircuit>() = i.re.v;
    imaginary.head<kCircuit>() = i.im.v;
    for (int c = 0; c < kLinear; ++c) {
      const Complex h = response.linear[k][c];
      real[kCircuit + 2 * c] = h.real();
      real[kCircuit + 2 * c + 1] = -h.imag();
      imaginary[kCircuit + 2 * c] = h.imag();
      imaginary[kCircuit + 2 * c + 1] = h.real();
    }
    real[kUnknowns] = i.re.a - record_.i[k].real();
    imaginary[kUnknowns] = i.im.a - record_.i[k].imag();
    sum.noalias() += real * real.transpose();
    sum.noalias() += imaginary * imaginary.transpose();
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
