#include "estimators/model/sampled_machine.h"

#include <ceres/jet.h>

namespace imrig::est {

namespace {

constexpr double kSmall =
    0.5;                    // norm up to which the series is taken; larger ones are halved and doubled back
constexpr int kTerms = 12;  // 0.5^12/14! = 3e-15
constexpr int kMostHalvings = 60;

template <class T>
struct Matrix {
  Cx<T> ss, sr, rs, rr;
};

template <class T>
Matrix<T> product(const Matrix<T>& a, const Matrix<T>& b) {
  return {a.ss * b.ss + a.sr * b.rs, a.ss * b.sr + a.sr * b.rr, a.rs * b.ss + a.rr * b.rs,
          a.rs * b.sr + a.rr * b.rr};
}

// factor m + diagonal I
template <class T>
Matrix<T> sum(double factor, const Matrix<T>& m, double diagonal) {
  Matrix<T> out{scaled(factor, m.ss), scaled(factor, m.sr), scaled(factor, m.rs), scaled(factor, m.rr)};
  out.ss.re += T(diagonal);
  out.rr.re += T(diagonal);
  return out;
}

template <class T>
Matrix<T> sum(const Matrix<T>& a, double factor, const Matrix<T>& b) {
  const Matrix<T> m = sum(factor, b, 0.0);
  return {a.ss + m.ss, a.sr + m.sr, a.rs + m.rs, a.rr + m.rr};
}

template <class T>
struct Exponential {
  Matrix<T> whole, phi_1, phi_2;
};

template <class T>
double size_of(const Matrix<T>& m) {
  const auto one = [](const Cx<T>& z) {
    if constexpr (std::is_same_v<T, double>)
      return std::abs(z.re) + std::abs(z.im);
    else
      return std::abs(z.re.a) + std::abs(z.im.a);
  };
  return std::max(one(m.ss) + one(m.sr), one(m.rs) + one(m.rr));
}

template <class T>
Exponential<T> exponential(const Matrix<T>& Z) {
  int halvings = 0;
  for (double size = size_of(Z); size > kSmall && halvings < kMostHalvings; size *= 0.5) ++halvings;
  const Matrix<T> small = sum(std::ldexp(1.0, -halvings), Z, 0.0);
  // phi_2 = 1/2 (I + Z/3 (I + Z/4 (I + ...)))
  Matrix<T> series = sum(0.0, small, 1.0);
  for (int m = kTerms + 2; m > 2; --m) series = sum(1.0 / m, product(small, series), 1.0);
  Exponential<T> e;
  e.phi_2 = sum(0.5, series, 0.0);
  e.phi_1 = sum(1.0, product(small, e.phi_2), 1.0);
  e.whole = sum(1.0, product(small, e.phi_1), 1.0);
  for (; halvings > 0; --halvings) {
    e.phi_2 = sum(0.25, sum(product(e.phi_1, e.phi_1), 2.0, e.phi_2), 0.0);
    e.phi_1 = sum(0.5, product(sum(1.0, e.whole, 1.0), e.phi_1), 0.0);
    e.whole = product(e.whole, e.whole);
  }
  return e;
}

template <class T>
std::array<T, kTransition> transition(const MachineParameters<T>& p, Fed fed, double w_r, double w_k,
                                      double h) {
  const T stator = p.R_s / p.L_l * h, rotor = p.R_r / p.L_l * h, inner = p.R_r / p.L_m * h;
  const T none(0.0);
  const Matrix<T> Z{
      {-stator, T(-w_k * h)}, {stator, none}, {rotor, none}, {-(rotor + inner), T((w_r - w_k) * h)}};
  const Exponential<T> e = exponential(Z);
  const bool on_stator = fed == Fed::kStator;
  const auto input = [&](const Matrix<T>& m, bool to_stator) {
    const Cx<T>& z = to_stator ? (on_stator ? m.ss : m.sr) : (on_stator ? m.rs : m.rr);
    return scaled(h, z);
  };
  std::array<T, kTransition> out;
  std::size_t at = 0;
  const auto put = [&](const Cx<T>& z) { out[at++] = z.re, out[at++] = z.im; };
  put(e.whole.ss), put(e.whole.sr), put(e.whole.rs), put(e.whole.rr);
  for (const bool to_stator : {true, false}) put(input(e.phi_1, to_stator) - input(e.phi_2, to_stator));
  for (const bool to_stator : {true, false}) put(input(e.phi_2, to_stator));
  return out;
}

}  // namespace

SpeedRange speed_range(const FrameRecord& record) {
  if (record.w_r.empty()) return {};
  const auto [low, high] = std::minmax_element(record.w_r.begin(), record.w_r.end());
  return {*low, *high};
}

template <int C>
Transition<C> transition_at(const MachineParameters<double>& theta, Fed fed, int first, double w_r,
                            double w_k, double h) {
  Transition<C> out = Transition<C>::Zero();
  if constexpr (C == 1) {
    const auto values = transition<double>(theta, fed, w_r, w_k, h);
    for (std::size_t m = 0; m < values.size(); ++m) out[static_cast<Eigen::Index>(m)] = values[m];
  } else {
    using Jet = ceres::Jet<double, 4>;
    const MachineParameters<Jet> p{Jet(theta.R_s, 0), Jet(theta.R_r, 1), Jet(theta.L_l, 2),
                                   Jet(theta.L_m, 3)};
    const auto values = transition<Jet>(p, fed, w_r, w_k, h);
    for (std::size_t m = 0; m < values.size(); ++m) {
      const auto at = static_cast<Eigen::Index>(m) * C;
      out[at] = values[m].a;
      for (int lane = 1; lane < C && first + lane - 1 < 4; ++lane)
        out[at + lane] = values[m].v[first + lane - 1];
    }
  }
  return out;
}

template Transition<1> transition_at<1>(const MachineParameters<double>&, Fed, int, double, double, double);
template Transition<4> transition_at<4>(const MachineParameters<double>&, Fed, int, double, double, double);
template Transition<6> transition_at<6>(const MachineParameters<double>&, Fed, int, double, double, double);

}  // namespace imrig::est
