#include "estimators/fit/transient_noise.h"

#include <ceres/jet.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "estimators/fit/inverse.h"
#include "estimators/model/simulate.h"

namespace imrig::est {

namespace {

using Complex = std::complex<double>;
using Signal = std::vector<Complex>;
using Jet = ceres::Jet<double, kCircuit>;

// The machine with its voltage on the rotor: the response to what adds to dpsi_r/dt.
class RotorFed : public BaseMachine<double> {
 public:
  using BaseMachine<double>::BaseMachine;
  State derivative(const State& x, Complex v, double w_r, double w_k) const {
    State d = BaseMachine<double>::derivative(x, 0.0, w_r, w_k);
    d.psi_r = d.psi_r + Cx<double>(v);
    return d;
  }
};

FrameRecord driven_by(const FrameRecord& like, Signal v, std::vector<double> w_r) {
  FrameRecord record;
  record.sample_time_s = like.sample_time_s;
  record.w_k = like.w_k;
  record.i.resize(v.size());
  record.v = std::move(v);
  record.w_r = std::move(w_r);
  return record;
}

// Adjoint of a machine's response applied to weights over all samples, conjugated and reversed (which no sum
// of products notices).
template <class Machine>
Signal adjoint(const Machine& machine, const RecordProblem& problem, const Signal& weights) {
  const FrameRecord& record = problem.record();
  Signal input(weights.rbegin(), weights.rend());
  for (auto& x : input) x = std::conj(x);
  const FrameRecord reversed = driven_by(record, std::move(input), {record.w_r.rbegin(), record.w_r.rend()});
  Signal out(record.size());
  simulate(machine, reversed, {}, problem.steps(), true,
           [&](std::size_t k, const FluxState<double>& x) { out[k] = plain(machine.current(x)); });
  return out;
}

double mean_speed(const FrameRecord& record) {
  double sum = 0.0;
  for (const double w : record.w_r) sum += w;
  return sum / static_cast<double>(record.size());
}

// Response of the current to noise on one voltage sample, at the mean speed, and the derivatives of its
// energy.
struct VoltageNoise {
  double energy = 0.0;      // sum over the record of |h|^2 per judged sample: gain on white noise
  double difference = 0.0;  // the same of h[k] - h[k-1]
  Eigen::Vector4d slope = Eigen::Vector4d::Zero();  // half the derivative of the record's whole energy
};

VoltageNoise voltage_noise(const RecordProblem& problem, const MachineParameters<double>& p) {
  const FrameRecord& record = problem.record();
  Signal pulse(record.size());
  pulse[1] = 1.0;
  const FrameRecord input =
      driven_by(record, std::move(pulse), std::vector<double>(record.size(), mean_speed(record)));
  const BaseMachine<Jet> machine({Jet(p.R_s, 0), Jet(p.R_r, 1), Jet(p.L_l, 2), Jet(p.L_m, 3)});
  VoltageNoise out;
  Complex before = 0.0;
  const double n = static_cast<double>(record.size());
  simulate(machine, input, {}, problem.steps(), true, [&](std::size_t k, const FluxState<Jet>& x) {
    const Cx<Jet> i = machine.current(x);
    const Complex here(i.re.a, i.im.a);
    const double times = n - static_cast<double>(k);  // pulses in the record that reach so far
    out.energy += std::norm(here) * times / n;
    out.difference += std::norm(here - before) * times / n;
    out.slope += times * (i.re.a * i.re.v + i.im.a * i.im.v);
    before = here;
  });
  return out;
}

// The same of the matched filter on white current noise.
struct CurrentNoise {
  double energy = 1.0;
  double difference = 2.0;
};

CurrentNoise current_noise(const FrameRecord& record) {
  CurrentNoise out;
  if (record.judged_from == 0) return out;
  const Signal response = record.filter_response();
  out = {0.0, 0.0};
  Complex before = 0.0;
  for (const Complex& f : response) {
    out.energy += std::norm(f);
    out.difference += std::norm(f - before);
    before = f;
  }
  return out;
}

// The columns of J as complex signals over the record (zero where it is not judged), and each through an
// adjoint: what products of J with coloured noise need. Unknowns that are not free stay empty.
using Columns = std::array<Signal, kUnknowns>;

Columns columns_of(const RecordProblem& problem, const std::vector<SampleRows>& rows,
                   const std::vector<int>& free) {
  Columns columns;
  for (const int m : free) {
    Signal& column = columns[static_cast<std::size_t>(m)];
    column.resize(problem.record().size());
    for (std::size_t k = 0; k < rows.size(); ++k)
      column[problem.record().judged_from + k] = {rows[k].real[m], rows[k].imaginary[m]};
  }
  return columns;
}

// An imaginary part's column is j times its real part's, and stays so (conjugated) through an adjoint.
Signal turned(const Signal& conjugated) {
  Signal out(conjugated.size());
  for (std::size_t k = 0; k < out.size(); ++k) out[k] = {conjugated[k].imag(), -conjugated[k].real()};
  return out;
}

template <class Apply>
Columns through(const Columns& columns, const std::vector<int>& free, const Apply& apply) {
  Columns out;
  for (const int m : free) {
    const auto k = static_cast<std::size_t>(m);
    const bool imaginary = m >= kCircuit && (m - kCircuit) % 2 == 1;
    out[k] = imaginary ? turned(out[k - 1]) : apply(columns[k]);
  }
  return out;
}

double product(const Signal& a, const Signal& b) {
  double sum = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += a[k].real() * b[k].real() + a[k].imag() * b[k].imag();
  return sum;
}

// J' S J for noise of unit variance whose shape the adjoint has put into the columns.
Normal products_of(const Columns& columns, const std::vector<int>& free) {
  Normal out = Normal::Zero();
  for (const int a : free) {
    for (const int b : free) {
      if (b > a) continue;
      out(a, b) = product(columns[static_cast<std::size_t>(a)], columns[static_cast<std::size_t>(b)]);
      out(b, a) = out(a, b);
    }
  }
  return out;
}

// Conjugated and reversed, as adjoint does it.
Signal filter_adjoint(const FrameRecord& record, const Signal& column) {
  Signal out(column.rbegin(), column.rend());
  for (auto& x : out) x = std::conj(x);
  record.filter(out);
  return out;
}

// What one sample of a channel's white noise (one sigma of each component 1) leaves in the residual, summed
// over the record: mean square and that of the first difference. The fit takes away what looks like its
// unknowns: trace of N^-1 J' S J.
struct Moments {
  double energy = 0.0;
  double difference = 0.0;
};

Moments moments_of(const std::vector<SampleRows>& rows) {
  Moments m;
  for (std::size_t k = 1; k < rows.size(); ++k) {
    m.energy += std::norm(rows[k].residual);
    m.difference += std::norm(rows[k].residual - rows[k - 1].residual);
  }
  return m;
}

// Two equations, two variances; neither below zero.
void split(const Moments& seen, const Moments& of_current, const Moments& of_voltage, TransientNoise& noise) {
  const double det = of_current.energy * of_voltage.difference - of_current.difference * of_voltage.energy;
  double i2 = (seen.energy * of_voltage.difference - seen.difference * of_voltage.energy) / det;
  double v2 = (seen.difference * of_current.energy - seen.energy * of_current.difference) / det;
  if (v2 < 0.0) {
    v2 = 0.0;
    i2 = seen.energy / of_current.energy;
  } else if (i2 < 0.0) {
    i2 = 0.0;
    v2 = seen.energy / of_voltage.energy;
  }
  noise.current_A = std::sqrt(i2);
  noise.voltage_V = std::sqrt(v2);
}

// Rows of A as complex weights per sample.
Signal weighted(const Columns& columns, const std::vector<int>& free, const Unknowns& line) {
  Signal out(columns[static_cast<std::size_t>(free.front())].size());
  for (const int m : free) {
    const Signal& column = columns[static_cast<std::size_t>(m)];
    for (std::size_t k = 0; k < out.size(); ++k) out[k] += line[m] * column[k];
  }
  return out;
}

// j psi_r along the record, reversed and conjugated like what adjoint returns: a speed error of 1 rad/s adds
// j psi_r to dpsi_r/dt.
Signal speed_lever(const RecordProblem& problem, const MachineParameters<double>& p,
                   const FluxState<double>& start) {
  Signal lever(problem.record().size());
  simulate(BaseMachine<double>(p), problem.record(), start, problem.steps(), true,
           [&](std::size_t k, const FluxState<double>& x) {
             lever[lever.size() - 1 - k] = std::conj(Complex(0.0, 1.0) * plain(x.psi_r));
           });
  return lever;
}

// Of the circuit, from noise of the speed.
Eigen::Matrix4d speed_covariance(const RecordProblem& problem, const MachineParameters<double>& theta,
                                 const FluxState<double>& start, const Columns& columns,
                                 const std::vector<int>& free, const Normal& inverse) {
  const Signal lever = speed_lever(problem, theta, start);
  std::array<Signal, kCircuit> responses;
  Eigen::Matrix4d out = Eigen::Matrix4d::Zero();
  for (int a = free.front(); a < kCircuit; ++a) {
    Signal& response = responses[static_cast<std::size_t>(a)];
    response = adjoint(RotorFed(theta), problem, weighted(columns, free, inverse.row(a)));
    for (std::size_t k = 0; k < lever.size(); ++k) response[k] = (std::conj(response[k]) * lever[k]).real();
    for (int b = free.front(); b <= a; ++b) {
      out(a, b) = product(response, responses[static_cast<std::size_t>(b)]);
      out(b, a) = out(a, b);
    }
  }
  return out;
}

}  // namespace

TransientNoise transient_noise(const RecordProblem& problem, const MachineParameters<double>& theta,
                               bool fit_R_s, const Noise& declared) {
  std::vector<SampleRows> rows;
  rows.reserve(problem.judged());
  const Linearization here = problem.linearize(theta, &rows);
  std::vector<int> free;
  for (int m = fit_R_s ? 0 : 1; m < kCircuit; ++m) free.push_back(m);
  free.insert(free.end(), problem.linear_unknowns().begin(), problem.linear_unknowns().end());
  const Normal inverse = inverse_over(here.normal, free);
  TransientNoise noise;
  if (!fit_R_s) noise.per_R_s = -(inverse * here.normal.col(0)).head<kCircuit>();

  const BaseMachine<double> machine(theta);
  const Columns columns = columns_of(problem, rows, free);
  const auto by_filter = [&](const Signal& column) { return filter_adjoint(problem.record(), column); };
  const auto by_machine = [&](const Signal& column) { return adjoint(machine, problem, column); };
  const Normal from_current = products_of(through(columns, free, by_filter), free);
  const Normal from_voltage = products_of(through(columns, free, by_machine), free);

  const VoltageNoise through_machine = voltage_noise(problem, theta);
  const CurrentNoise through_filter = current_noise(problem.record());
  noise.current_gain = through_filter.energy;
  noise.voltage_gain = through_machine.energy;
  const double n = 2.0 * static_cast<double>(rows.size() - 1);
  split(moments_of(rows),
        {n * through_filter.energy - (inverse * from_current).trace(), n * through_filter.difference},
        {n * through_machine.energy - (inverse * from_voltage).trace(), n * through_machine.difference},
        noise);

  const Normal both =
      noise.current_A * noise.current_A * from_current + noise.voltage_V * noise.voltage_V * from_voltage;
  noise.covariance = (inverse * both * inverse).topLeftCorner<kCircuit, kCircuit>();
  if (declared.speed_rad_s > 0.0) {
    const double electrical = declared.speed_rad_s * problem.record().pole_pairs;
    noise.covariance +=
        electrical * electrical * speed_covariance(problem, theta, here.start, columns, free, inverse);
  }
  const double counted =
      declared.voltage_V > 0.0 ? std::min(noise.voltage_V, declared.voltage_V) : noise.voltage_V;
  Unknowns expected = Unknowns::Zero();
  expected.head<kCircuit>() = 2.0 * counted * counted * through_machine.slope;
  noise.bias = -(inverse * expected).head<kCircuit>();
  return noise;
}

}  // namespace imrig::est
