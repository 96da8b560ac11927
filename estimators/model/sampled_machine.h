#pragma once
// The base machine from one sample to the next, without integration steps. With the voltage u on a straight
// line in the frame and the speed at its mean over the sample, x = (psi_s, psi_r) goes exactly
//   x[k+1] = E x[k] + G_0 u[k] + G_1 u[k+1]
//   E = exp(A h),  G_1 = h phi_2(A h) b,  G_0 = h phi_1(A h) b - G_1
//   phi_1(Z) = sum Z^m/(m+1)!, phi_2(Z) = sum Z^m/(m+2)!   (Al-Mohy and Higham 2011, section 2)
// whatever |A| h is. A speed that changes by dw within the sample leaves |A| h^2 dw/12 of the state. E and G
// are smooth in the speed: a cubic through four nodes on each panel of it with h dw <= 0.1 errs by 3e-8.
// Derivatives by the circuit are exact, of the same cubic, from ceres::Jet at the nodes.

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <vector>

#include "estimators/model/base_machine.h"
#include "estimators/model/frame_record.h"

namespace imrig::est {

enum class Fed { kStator, kRotor };  // where the input drives: b = (1, 0) or (0, 1)

// Complex numbers side by side.
template <int C>
struct Side {
  using Lanes = Eigen::Array<double, C, 1>;
  Lanes re = Lanes::Zero(), im = Lanes::Zero();
  void set(int c, std::complex<double> z) { re[c] = z.real(), im[c] = z.imag(); }
  std::complex<double> at(int c) const { return {re[c], im[c]}; }
};

// C fluxes side by side.
template <int C>
struct FluxSide {
  Side<C> s, r;
};

// Real and imaginary parts of E_ss, E_sr, E_rs, E_rr, G_0s, G_0r, G_1s, G_1r one after the other.
inline constexpr int kTransition = 16;

// A transition (lane 0) and its derivatives by the circuit's parameters from `first` on (lanes 1 to C - 1).
template <int C>
using Transition = Eigen::Array<double, kTransition * C, 1>;

// What the record's speed can be, rad/s.
struct SpeedRange {
  double low = 0.0, high = 0.0;
};
SpeedRange speed_range(const FrameRecord& record);

// Lane c of the result at one speed; w_k: of the frame, h: s.
template <int C>
Transition<C> transition_at(const MachineParameters<double>& theta, Fed fed, int first, double w_r,
                            double w_k, double h);
extern template Transition<1> transition_at<1>(const MachineParameters<double>&, Fed, int, double, double,
                                               double);
extern template Transition<4> transition_at<4>(const MachineParameters<double>&, Fed, int, double, double,
                                               double);
extern template Transition<6> transition_at<6>(const MachineParameters<double>&, Fed, int, double, double,
                                               double);

template <int C>
class SampledMachine {
 public:
  SampledMachine(const MachineParameters<double>& theta, const FrameRecord& record, SpeedRange range,
                 Fed fed = Fed::kStator, int first = 0)
      : low_(range.low) {
    const double h = record.sample_time_s;
    const double width = range.high - range.low;
    const auto panels = static_cast<std::size_t>(std::clamp(std::ceil(h * width / kPanel), 1.0, kMostPanels));
    half_ = std::max(0.5 * width / static_cast<double>(panels), 1e-6);
    for (std::size_t p = 0; p < panels; ++p) {
      std::array<Transition<C>, 4> node;
      const double middle = low_ + half_ * (2.0 * static_cast<double>(p) + 1.0);
      for (std::size_t n = 0; n < 4; ++n)
        node[n] = transition_at<C>(theta, fed, first, middle + half_ * kNodes[n], record.w_k, h);
      panels_.push_back(cubic(node));
    }
  }

  // w_r: mean electrical speed of the sample.
  Transition<C> at(double w_r) const {
    const double place = (w_r - low_) / half_;
    const auto panel = std::min(static_cast<std::size_t>(std::max(0.0, 0.5 * place)), panels_.size() - 1);
    const double t = place - 2.0 * static_cast<double>(panel) - 1.0;
    const auto& c = panels_[panel];
    return ((c[3] * t + c[2]) * t + c[1]) * t + c[0];
  }

 private:
  static constexpr double kPanel = 0.1, kMostPanels = 256.0;
  static constexpr std::array<double, 4> kNodes{-0.92387953251128674, -0.38268343236508977,
                                                0.38268343236508977, 0.92387953251128674};  // Chebyshev's
  // Coefficients of the cubic through the nodes, in the place on the panel from -1 to 1.
  static std::array<Transition<C>, 4> cubic(const std::array<Transition<C>, 4>& f) {
    const double a = kNodes[3], b = kNodes[2], d = 1.0 / (a * a - b * b);
    const Transition<C> even_a = 0.5 * (f[3] + f[0]), even_b = 0.5 * (f[2] + f[1]);
    const Transition<C> odd_a = (0.5 / a) * (f[3] - f[0]), odd_b = (0.5 / b) * (f[2] - f[1]);
    const Transition<C> second = d * (even_a - even_b), third = d * (odd_a - odd_b);
    return {even_b - b * b * second, odd_b - b * b * third, second, third};
  }

  double low_, half_ = 1.0;
  std::vector<std::array<Transition<C>, 4>> panels_;
};

// C columns of flux through one machine at the speeds w_r, one a sample: input(k, Side<C>&) tells each one's
// input at sample k, visit(k, x) sees the flux.
template <int C, class Input, class Visit>
void run_columns(const SampledMachine<1>& machine, const std::vector<double>& w_r, FluxSide<C> x,
                 Input&& input, Visit&& visit) {
  const std::size_t n = w_r.size();
  Side<C> u, next;
  input(std::size_t{0}, u);
  for (std::size_t k = 0;; ++k) {
    visit(k, x);
    if (k + 1 >= n) return;
    input(k + 1, next);
    const Transition<1> t = machine.at(0.5 * (w_r[k] + w_r[k + 1]));
    const FluxSide<C> y = x;
    x.s.re = t[0] * y.s.re - t[1] * y.s.im + t[2] * y.r.re - t[3] * y.r.im + t[8] * u.re - t[9] * u.im +
             t[12] * next.re - t[13] * next.im;
    x.s.im = t[0] * y.s.im + t[1] * y.s.re + t[2] * y.r.im + t[3] * y.r.re + t[8] * u.im + t[9] * u.re +
             t[12] * next.im + t[13] * next.re;
    x.r.re = t[4] * y.s.re - t[5] * y.s.im + t[6] * y.r.re - t[7] * y.r.im + t[10] * u.re - t[11] * u.im +
             t[14] * next.re - t[15] * next.im;
    x.r.im = t[4] * y.s.im + t[5] * y.s.re + t[6] * y.r.im + t[7] * y.r.re + t[10] * u.im + t[11] * u.re +
             t[14] * next.im + t[15] * next.re;
    u = next;
  }
}

// The flux (lane 0) and its derivatives by the circuit (the other lanes), driven by v, one entry a sample.
template <int C, class Visit>
void run_derivatives(const SampledMachine<C>& machine, const std::vector<double>& w_r,
                     const std::vector<std::complex<double>>& v, const FluxState<double>& start,
                     Visit&& visit) {
  FluxSide<C> x;
  x.s.set(0, plain(start.psi_s));
  x.r.set(0, plain(start.psi_r));
  const std::size_t n = w_r.size();
  for (std::size_t k = 0;; ++k) {
    visit(k, x);
    if (k + 1 >= n) return;
    const Transition<C> t = machine.at(0.5 * (w_r[k] + w_r[k + 1]));
    const auto lanes = [&t](int m) { return t.template segment<C>(m * C); };
    const auto whole = [&t](int m) { return t[m * C]; };
    const std::complex<double> s = x.s.at(0), r = x.r.at(0);
    x.s.set(0, 0.0);  // what drives its lane is the transition itself
    x.r.set(0, 0.0);
    const FluxSide<C> y = x;
    const std::array<std::complex<double>, 4> from{s, r, v[k], v[k + 1]};
    const std::array<int, 4> of_stator{0, 2, 8, 12}, of_rotor{4, 6, 10, 14};
    x.s.re = whole(0) * y.s.re - whole(1) * y.s.im + whole(2) * y.r.re - whole(3) * y.r.im;
    x.s.im = whole(0) * y.s.im + whole(1) * y.s.re + whole(2) * y.r.im + whole(3) * y.r.re;
    x.r.re = whole(4) * y.s.re - whole(5) * y.s.im + whole(6) * y.r.re - whole(7) * y.r.im;
    x.r.im = whole(4) * y.s.im + whole(5) * y.s.re + whole(6) * y.r.im + whole(7) * y.r.re;
    for (std::size_t m = 0; m < from.size(); ++m) {
      const double a = from[m].real(), b = from[m].imag();
      x.s.re += a * lanes(of_stator[m]) - b * lanes(of_stator[m] + 1);
      x.s.im += b * lanes(of_stator[m]) + a * lanes(of_stator[m] + 1);
      x.r.re += a * lanes(of_rotor[m]) - b * lanes(of_rotor[m] + 1);
      x.r.im += b * lanes(of_rotor[m]) + a * lanes(of_rotor[m] + 1);
    }
  }
}

}  // namespace imrig::est
