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

// Per component of a sample.
void split(const std::vector<SampleRows>& rows, const CurrentNoise& through_filter,
           const VoltageNoise& through_machine, TransientNoise& noise) {
  double energy = 0.0, difference = 0.0;
  for (std::size_t k = 1; k < rows.size(); ++k) {
    energy += std::norm(rows[k].residual);
    difference += std::norm(rows[k].residual - rows[k - 1].residual);
  }
  const double n = 2.0 * static_cast<double>(rows.size() - 1);
  energy /= n;
  difference /= n;
  const double det =
      through_filter.energy * through_machine.difference - through_filter.difference * through_machine.energy;
  double i2 = (energy * through_machine.difference - difference * through_machine.energy) / det;
  double v2 = (difference * through_filter.energy - energy * through_filter.difference) / det;
  if (v2 < 0.0) {
    v2 = 0.0;
    i2 = energy / through_filter.energy;
  } else if (i2 < 0.0) {
    i2 = 0.0;
    v2 = energy / through_machine.energy;
  }
  noise.current_A = std::sqrt(i2);
  noise.voltage_V = std::sqrt(v2);
}

// Rows of A as complex weights per sample of the record; zero for samples that are not judged.
Signal weights_of(const RecordProblem& problem, const std::vector<SampleRows>& rows, const Unknowns& line) {
  Signal weights(problem.record().size());
  for (std::size_t k = 0; k < rows.size(); ++k) {
    weights[problem.record().judged_from + k] = {line.dot(rows[k].real), line.dot(rows[k].imaginary)};
  }
  return weights;
}

Signal filtered_weights(const FrameRecord& record, const Signal& weights) {
  if (record.judged_from == 0) return weights;
  const Signal response = record.filter_response();
  Signal out(weights.size());
  for (std::size_t l = 0; l < weights.size(); ++l) {
    for (std::size_t m = 0; m < response.size() && l + m < weights.size(); ++m)
      out[l] += std::conj(response[m]) * weights[l + m];
  }
  return out;
}

double product(const Signal& a, const Signal& b) {
  double sum = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += a[k].real() * b[k].real() + a[k].imag() * b[k].imag();
  return sum;
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

}  // namespace

TransientNoise transient_noise(const RecordProblem& problem, const MachineParameters<double>& theta,
                               bool fit_R_s, const Noise& declared) {
  std::vector<SampleRows> rows;
  rows.reserve(problem.judged());
  const Linearization here = problem.linearize(theta, &rows);
  std::vector<int> moving;
  for (int m = fit_R_s ? 0 : 1; m < kUnknowns; ++m) moving.push_back(m);
  const Normal inverse = inverse_over(here.normal, moving);
  TransientNoise noise;
  if (!fit_R_s) noise.per_R_s = -(inverse * here.normal.col(0)).head<kCircuit>();
  const VoltageNoise through_machine = voltage_noise(problem, theta);
  const CurrentNoise through_filter = current_noise(problem.record());
  noise.current_gain = through_filter.energy;
  noise.voltage_gain = through_machine.energy;
  split(rows, through_filter, through_machine, noise);

  const BaseMachine<double> machine(theta);
  std::array<Signal, kCircuit> from_current, from_voltage, from_speed;
  const bool noisy_speed = declared.speed_rad_s > 0.0;
  const Signal lever = noisy_speed ? speed_lever(problem, theta, here.start) : Signal{};
  for (std::size_t m = fit_R_s ? 0 : 1; m < kCircuit; ++m) {
    const Signal weights = weights_of(problem, rows, inverse.row(static_cast<Eigen::Index>(m)));
    from_current[m] = filtered_weights(problem.record(), weights);
    from_voltage[m] = adjoint(machine, problem, weights);
    if (!noisy_speed) continue;
    from_speed[m] = adjoint(RotorFed(theta), problem, weights);
    for (std::size_t k = 0; k < lever.size(); ++k)
      from_speed[m][k] = (std::conj(from_speed[m][k]) * lever[k]).real();
  }
  const double speed = noisy_speed ? declared.speed_rad_s * problem.record().pole_pairs : 0.0;
  for (std::size_t a = fit_R_s ? 0 : 1; a < kCircuit; ++a) {
    for (std::size_t b = fit_R_s ? 0 : 1; b < kCircuit; ++b) {
      noise.covariance(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b)) =
          std::pow(noise.current_A, 2) * product(from_current[a], from_current[b]) +
          std::pow(noise.voltage_V, 2) * product(from_voltage[a], from_voltage[b]) +
          speed * speed * product(from_speed[a], from_speed[b]);
    }
  }
  const double counted =
      declared.voltage_V > 0.0 ? std::min(noise.voltage_V, declared.voltage_V) : noise.voltage_V;
  Unknowns expected = Unknowns::Zero();
  expected.head<kCircuit>() = 2.0 * counted * counted * through_machine.slope;
  noise.bias = -(inverse * expected).head<kCircuit>();
  return noise;
}

}  // namespace imrig::est
