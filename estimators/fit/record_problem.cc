#include "estimators/fit/record_problem.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "estimators/fit/row_sums.h"

namespace imrig::est {

namespace {

using Complex = std::complex<double>;

constexpr double kTurns =
    3.0;  // periods of the supply from which the voltage's faults can be told from the machine ...
constexpr double kCircular =
    0.2;  // ... if |sum v^2| / sum |v|^2 over the record, in the stationary frame, is below this

// exp(-j w_k t) of every sample.
Signal turns(const FrameRecord& record) {
  Signal out;
  out.reserve(record.size());
  for (std::size_t k = 0; k < record.size(); ++k) out.push_back(std::conj(record.back(k)));
  return out;
}

bool turns_enough(const FrameRecord& record) {
  const double duration = record.sample_time_s * static_cast<double>(record.size());
  return std::abs(record.w_k) * duration >= kTurns * 2.0 * kPi;
}

bool faults_can_be_told(const FrameRecord& record, const Signal& turn) {
  Complex square = 0.0;
  double power = 0.0;
  for (std::size_t k = 0; k < record.size(); ++k) {
    const Complex v = record.v[k] * std::conj(turn[k]);
    square += v * v;
    power += std::norm(v);
  }
  return std::abs(square) < kCircular * power;
}

// The best c of left = sum h_m c_m from the products of (left, h_1, ... h_n), real parts first.
template <std::size_t N>
void solve(const Eigen::MatrixXd& products, Eigen::Index n, std::array<Complex, N>& best) {
  const Eigen::Index lanes = products.rows() / 2;
  const auto product = [&](Eigen::Index a, Eigen::Index b) {  // sum a* b
    return Complex(products(a, b) + products(lanes + a, lanes + b),
                   products(a, lanes + b) - products(lanes + a, b));
  };
  Eigen::MatrixXcd normal(n, n);
  Eigen::VectorXcd right(n);
  for (Eigen::Index a = 0; a < n; ++a) {
    right[a] = product(a + 1, 0);
    for (Eigen::Index b = 0; b < n; ++b) normal(a, b) = product(a + 1, b + 1);
  }
  const Eigen::VectorXd scale = normal.diagonal().real().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  Eigen::MatrixXcd scaled = scale.asDiagonal() * normal * scale.asDiagonal();
  scaled.diagonal().array() += 1e-13;  // a state that the record forgets at once stays finite
  const Eigen::VectorXcd c = scale.asDiagonal() * scaled.ldlt().solve(scale.asDiagonal() * right);
  for (Eigen::Index a = 0; a < n; ++a) best[static_cast<std::size_t>(a)] = c[a];
}

}  // namespace

RecordProblem::RecordProblem(const FrameRecord& record, bool look_for_faults, bool R_s)
    : record_(record), speeds_(speed_range(record)), R_s_(R_s) {
  if (look_for_faults && turns_enough(record)) {
    const Signal turn = turns(record);
    if (faults_can_be_told(record, turn)) {
      mirrored_.resize(record.size());
      for (std::size_t k = 0; k < record.size(); ++k)
        mirrored_[k] = std::conj(record.v[k]) * turn[k] * turn[k];
      offset_ = turn;
    }
  }
  const bool faults = !offset_.empty();
  for (int m = kCircuit; m < (faults ? kUnknowns : kCircuit + 4); ++m) linear_unknowns_.push_back(m);
}

double RecordProblem::signal() const {
  double sum = 0.0;
  for (std::size_t k = record_.judged_from; k < record_.size(); ++k) sum += std::norm(record_.i[k]);
  return sum;
}

// The current is linear in what is behind the circuit: driven + sum h_m c_m; c by least squares.
RecordProblem::Responses RecordProblem::responses(const MachineParameters<double>& theta) const {
  return offset_.empty() ? responses_of<4>(theta) : responses_of<6>(theta);
}

// Lanes: driven, by psi_s(0), by psi_r(0), and where they are looked for by epsilon and by an offset.
template <int C>
RecordProblem::Responses RecordProblem::responses_of(const MachineParameters<double>& theta) const {
  constexpr int kUsed = C == 4 ? 3 : 5;
  Responses out;
  out.current.resize(record_.size());
  const SampledMachine<1> machine(theta, record_, speeds_);
  FluxSide<C> x;
  x.s.set(1, 1.0);
  x.r.set(2, 1.0);
  RowSums<2 * C> sums;
  const double per_leakage = 1.0 / theta.L_l;
  run_columns<C>(
      machine, record_.w_r, x,
      [&](std::size_t k, Side<C>& u) {
        u.set(0, record_.v[k]);
        if constexpr (kUsed == 5) u.set(3, mirrored_[k]), u.set(4, offset_[k]);
      },
      [&](std::size_t k, const FluxSide<C>& flux) {
        Side<C> i{per_leakage * (flux.s.re - flux.r.re), per_leakage * (flux.s.im - flux.r.im)};
        for (int c = 0; c < kUsed; ++c) out.current[k][static_cast<std::size_t>(c)] = i.at(c);
        if (k < record_.judged_from) return;
        i.set(0, record_.i[k] - i.at(0));
        auto row = sums.next();
        row.template head<C>() = i.re;
        row.template tail<C>() = i.im;
      });
  solve(sums.take(), kUsed - 1, out.best);
  return out;
}

double RecordProblem::error(const MachineParameters<double>& theta) const {
  const Responses response = responses(theta);
  double sum = 0.0;
  for (std::size_t k = record_.judged_from; k < record_.size(); ++k) {
    Complex predicted = response.current[k][0];
    for (std::size_t m = 0; m < kLinear; ++m) predicted += response.current[k][m + 1] * response.best[m];
    sum += std::norm(predicted - record_.i[k]);
  }
  return sum;
}

Linearization RecordProblem::linearize(const MachineParameters<double>& theta, RecordColumns* columns) const {
  const Responses response = responses(theta);
  if (R_s_ || columns != nullptr) return linearize_from<6>(0, theta, response, columns);
  return linearize_from<4>(1, theta, response, columns);
}

template <int C>
Linearization RecordProblem::linearize_from(int first, const MachineParameters<double>& theta,
                                            const Responses& response, RecordColumns* columns) const {
  Linearization out;
  out.start = {Cx<double>(response.best[0]), Cx<double>(response.best[1])};
  Signal v = record_.v;
  for (std::size_t k = 0; k < offset_.size(); ++k)
    v[k] += response.best[2] * mirrored_[k] + response.best[3] * offset_[k];
  if (columns != nullptr) {
    for (Signal& column : columns->by) column.assign(record_.size(), 0.0);
    columns->residual.clear();
    columns->residual.reserve(judged());
    columns->psi_r.resize(record_.size());
  }
  const SampledMachine<C> machine(theta, record_, speeds_, Fed::kStator, first);
  const double per_leakage = 1.0 / theta.L_l;
  const int leakage = 2 - first + 1;  // lane of L_l
  RowSums<kUnknowns + 1> sums;
  run_derivatives<C>(machine, record_.w_r, v, out.start, [&](std::size_t k, const FluxSide<C>& flux) {
    if (columns != nullptr) columns->psi_r[k] = flux.r.at(0);
    if (k < record_.judged_from) return;
    Side<C> i{per_leakage * (flux.s.re - flux.r.re), per_leakage * (flux.s.im - flux.r.im)};
    i.re[leakage] -= per_leakage * i.re[0];
    i.im[leakage] -= per_leakage * i.im[0];
    const Complex residual = i.at(0) - record_.i[k];
    for (const bool imaginary : {false, true}) {
      auto row = sums.next();
      row[0] = 0.0;
      row.template segment(first, kCircuit - first) =
          (imaginary ? i.im : i.re).template segment(1, kCircuit - first).matrix();
      for (int c = 0; c < kLinear; ++c) {
        const Complex h = response.current[k][static_cast<std::size_t>(c) + 1];
        row[kCircuit + 2 * c] = imaginary ? h.imag() : h.real();
        row[kCircuit + 2 * c + 1] = imaginary ? h.real() : -h.imag();
      }
      row[kUnknowns] = imaginary ? residual.imag() : residual.real();
    }
    if (columns == nullptr) return;
    for (int m = 0; m < kCircuit; ++m) columns->by[static_cast<std::size_t>(m)][k] = i.at(m + 1);
    for (std::size_t c = 0; c < kLinear; ++c) columns->by[kCircuit + c][k] = response.current[k][c + 1];
    columns->residual.push_back(residual);
  });
  const Eigen::MatrixXd sum = sums.take();
  out.normal = sum.topLeftCorner<kUnknowns, kUnknowns>();
  out.gradient = sum.col(kUnknowns).head<kUnknowns>();
  out.error = sum(kUnknowns, kUnknowns);
  return out;
}

}  // namespace imrig::est
