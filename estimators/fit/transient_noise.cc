#include "estimators/fit/transient_noise.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "estimators/fit/inverse.h"
#include "estimators/fit/row_sums.h"

namespace imrig::est {

namespace {

using Complex = std::complex<double>;
constexpr int kColumns = kCircuit + kLinear;
using Abreast = Side<kColumns>;  // all columns at one sample

// J' S J from what an adjoint (below) makes of the columns of J, for noise of unit variance.
class Products {
 public:
  void add(const Abreast& y) {
    auto row = sums_.next();
    row.head<kColumns>() = y.re;
    row.tail<kColumns>() = y.im;
  }
  // The columns come conjugated; that of an imaginary part is j times its real part's.
  Normal take() {
    const Eigen::MatrixXd p = sums_.take();
    Normal out = Normal::Zero();
    for (int a = 0; a < kColumns; ++a) {
      for (int b = 0; b < kColumns; ++b) {
        const double re = p(a, b) + p(kColumns + a, kColumns + b);
        const double im = p(kColumns + a, b) - p(a, kColumns + b);
        const int at_a = place(a), at_b = place(b);
        out(at_a, at_b) = re;
        if (b >= kCircuit) out(at_a, at_b + 1) = -im;
        if (a >= kCircuit) out(at_a + 1, at_b) = im;
        if (a >= kCircuit && b >= kCircuit) out(at_a + 1, at_b + 1) = re;
      }
    }
    return out;
  }

 private:
  static int place(int column) { return column < kCircuit ? column : kCircuit + 2 * (column - kCircuit); }
  RowSums<2 * kColumns> sums_;
};

// Sample k of the columns, conjugated and reversed (which no sum of products notices).
void reversed(const RecordColumns& columns, std::size_t k, Abreast& out) {
  for (int c = 0; c < kColumns; ++c) {
    const Signal& column = columns.by[static_cast<std::size_t>(c)];
    out.set(c, std::conj(column[column.size() - 1 - k]));
  }
}

// The adjoint of the machine's response to its voltage is the machine over the reversed conjugate.
Normal through_machine(const RecordProblem& problem, const MachineParameters<double>& theta,
                       const RecordColumns& columns) {
  const std::vector<double> w_r(problem.record().w_r.rbegin(), problem.record().w_r.rend());
  const SampledMachine<1> machine(theta, problem.record(), problem.speeds());
  const double per_leakage = 1.0 / theta.L_l;
  Products products;
  run_columns<kColumns>(
      machine, w_r, {}, [&](std::size_t k, Abreast& u) { reversed(columns, k, u); },
      [&](std::size_t, const FluxSide<kColumns>& x) {
        products.add({per_leakage * (x.s.re - x.r.re), per_leakage * (x.s.im - x.r.im)});
      });
  return products.take();
}

Normal through_filter(const FrameRecord& record, const RecordColumns& columns) {
  Products products;
  Abreast x, before, y;
  const bool none = record.filter_s <= 0.0;
  const FilterStep f = none ? FilterStep{1.0, 0.0, 0.0, 1.0} : record.filter_step();
  for (std::size_t k = 0; k < record.size(); ++k) {
    reversed(columns, k, x);
    const Abreast z = y;
    const auto add = [&](Complex c, const Abreast& u) {
      y.re += c.real() * u.re - c.imag() * u.im;
      y.im += c.real() * u.im + c.imag() * u.re;
    };
    y = {};
    add(f.decay, z), add(f.old, before), add(f.fresh, x);
    products.add(y);
    before = x;
  }
  return products.take();
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
  const double speed = mean_speed(record);
  const SampledMachine<6> machine(p, record, {speed, speed});
  const double per_leakage = 1.0 / p.L_l;
  VoltageNoise out;
  Complex before = 0.0;
  const double n = static_cast<double>(record.size());
  run_derivatives<6>(machine, std::vector<double>(record.size(), speed), pulse, {},
                     [&](std::size_t k, const FluxSide<6>& x) {
                       Side<6> i{per_leakage * (x.s.re - x.r.re), per_leakage * (x.s.im - x.r.im)};
                       i.re[3] -= per_leakage * i.re[0];
                       i.im[3] -= per_leakage * i.im[0];
                       const double times =
                           n - static_cast<double>(k);  // pulses in the record that reach so far
                       out.energy += std::norm(i.at(0)) * times / n;
                       out.difference += std::norm(i.at(0) - before) * times / n;
                       out.slope += (times * (i.re[0] * i.re + i.im[0] * i.im)).segment<4>(1).matrix();
                       before = i.at(0);
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

// What one sample of a channel's white noise (one sigma of each component 1) leaves in the residual, summed
// over the record: mean square and that of the first difference. The fit takes away what looks like its
// unknowns: trace of N^-1 J' S J.
struct Moments {
  double energy = 0.0;
  double difference = 0.0;
};

Moments moments_of(const Signal& residual) {
  Moments m;
  for (std::size_t k = 1; k < residual.size(); ++k) {
    m.energy += std::norm(residual[k]);
    m.difference += std::norm(residual[k] - residual[k - 1]);
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

// Of the circuit, from noise of the speed: an error of 1 rad/s adds j psi_r to dpsi_r/dt. Rows of A = N^-1 J'
// as complex weights go through the adjoint of the machine that is fed on its rotor.
Eigen::Matrix4d speed_covariance(const RecordProblem& problem, const MachineParameters<double>& theta,
                                 const RecordColumns& columns, const Normal& inverse) {
  const FrameRecord& record = problem.record();
  const std::vector<double> w_r(record.w_r.rbegin(), record.w_r.rend());
  const SampledMachine<1> machine(theta, record, problem.speeds(), Fed::kRotor);
  const double per_leakage = 1.0 / theta.L_l;
  std::array<Side<kCircuit>, kColumns> weight;
  for (int c = 0; c < kColumns; ++c) {
    for (int row = 0; row < kCircuit; ++row) {
      const int at = c < kCircuit ? c : kCircuit + 2 * (c - kCircuit);
      weight[static_cast<std::size_t>(c)].set(row,
                                              {inverse(row, at), c < kCircuit ? 0.0 : inverse(row, at + 1)});
    }
  }
  Eigen::Matrix4d out = Eigen::Matrix4d::Zero();
  run_columns<kCircuit>(
      machine, w_r, {},
      [&](std::size_t k, Side<kCircuit>& u) {
        u = {};
        for (std::size_t c = 0; c < weight.size(); ++c) {
          const Complex x = columns.by[c][record.size() - 1 - k];
          u.re += x.real() * weight[c].re - x.imag() * weight[c].im;
          u.im -= x.real() * weight[c].im + x.imag() * weight[c].re;
        }
      },
      [&](std::size_t k, const FluxSide<kCircuit>& x) {
        const Complex lever = std::conj(Complex(0.0, per_leakage) * columns.psi_r[record.size() - 1 - k]);
        // Re of conj(response) times lever
        const Eigen::Vector4d y =
            (lever.real() * (x.s.re - x.r.re) + lever.imag() * (x.s.im - x.r.im)).matrix();
        out.noalias() += y * y.transpose();
      });
  return out;
}

}  // namespace

TransientNoise transient_noise(const RecordProblem& problem, const MachineParameters<double>& theta,
                               bool fit_R_s, const Linearization& here, const RecordColumns& columns,
                               const Noise& declared) {
  std::vector<int> free;
  for (int m = fit_R_s ? 0 : 1; m < kCircuit; ++m) free.push_back(m);
  free.insert(free.end(), problem.linear_unknowns().begin(), problem.linear_unknowns().end());
  const Normal inverse = inverse_over(here.normal, free);
  TransientNoise noise;
  if (!fit_R_s) noise.per_R_s = -(inverse * here.normal.col(0)).head<kCircuit>();

  const Normal from_current = through_filter(problem.record(), columns);
  const Normal from_voltage = through_machine(problem, theta, columns);
  const VoltageNoise of_voltage = voltage_noise(problem, theta);
  const CurrentNoise of_current = current_noise(problem.record());
  noise.current_gain = of_current.energy;
  noise.voltage_gain = of_voltage.energy;
  const double n = 2.0 * static_cast<double>(columns.residual.size() - 1);
  split(moments_of(columns.residual),
        {n * of_current.energy - (inverse * from_current).trace(), n * of_current.difference},
        {n * of_voltage.energy - (inverse * from_voltage).trace(), n * of_voltage.difference}, noise);

  const Normal both =
      noise.current_A * noise.current_A * from_current + noise.voltage_V * noise.voltage_V * from_voltage;
  noise.covariance = (inverse * both * inverse).topLeftCorner<kCircuit, kCircuit>();
  if (declared.speed_rad_s > 0.0) {
    const double electrical = declared.speed_rad_s * problem.record().pole_pairs;
    noise.covariance += electrical * electrical * speed_covariance(problem, theta, columns, inverse);
  }
  const double counted =
      declared.voltage_V > 0.0 ? std::min(noise.voltage_V, declared.voltage_V) : noise.voltage_V;
  Unknowns expected = Unknowns::Zero();
  expected.head<kCircuit>() = 2.0 * counted * counted * of_voltage.slope;
  noise.bias = -(inverse * expected).head<kCircuit>();
  return noise;
}

}  // namespace imrig::est
