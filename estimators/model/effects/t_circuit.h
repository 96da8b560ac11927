#pragma once
// The T circuit whose leakage saturates on both sides, 0 < rotor_share < 1, which splits L_l:
//   M = L_m + rotor_share L_l,  L_ls = (1 - rotor_share) L_l,  L_lr = M rotor_share L_l / L_m,  k = L_m / M
//   W = min over psi_m of E_s(psi_s - psi_m) + E_r(psi_r/k - psi_m) + |psi_m|^2/(2 M) + E_x(psi_x),
//   psi_x = psi_m + d (psi_s - psi_r)
//
//   i_s = dW/dpsi_s,  i_r = -dW/dpsi_r (into the rotor's resistance)
//
// Both leakages bend at the same current. E_x is what the main flux adds beyond its linear current; d is the
// difference between the place where it saturates and the node's. The node's flux is solved by Newton's
// method for values; one more step from there carries the derivatives (implicit function theorem). Source:
// Lipo and Consoli 1984, IEEE Trans. Industry Applications 20(1).

#include <cmath>

#include "estimators/model/base_machine.h"
#include "estimators/model/effects/effect.h"
#include "estimators/model/effects/scalar.h"

namespace imrig::est {

// A real symmetric matrix over the two axes.
struct SymmetricTangent {
  double xx = 0.0, xy = 0.0, yy = 0.0;

  SymmetricTangent operator+(const SymmetricTangent& o) const { return {xx + o.xx, xy + o.xy, yy + o.yy}; }
  template <class T>
  Cx<T> operator*(const Cx<T>& a) const {
    return {xx * a.re + xy * a.im, xy * a.re + yy * a.im};
  }
  SymmetricTangent inverse() const {
    const double d = 1.0 / (xx * yy - xy * xy);
    return {yy * d, -xy * d, xx * d};
  }
};

// The branches, over values or over what carries derivatives.
template <class T>
struct TBranches {
  SaturationCurve<T> stator, rotor, main;
  bool main_live = false;
  T inverse_stator{}, inverse_rotor{}, inverse_main{}, inverse_magnetizing{};  // 1/H
  T inverse_k{}, apart{};

  TBranches() = default;
  TBranches(const MachineParameters<T>& base, const IronBends<T>& bends) {
    const T& share = bends.rotor_share;
    const T M = base.L_m + share * base.L_l, L_ls = (1.0 - share) * base.L_l;
    const T L_lr = M * share * base.L_l / base.L_m;
    const auto side = [&](const T& L) {
      auto law = bends.leakage;
      law.psi_ref_Wb = law.psi_ref_Wb * L / base.L_l;
      return law.curve();
    };
    stator = side(L_ls), rotor = side(L_lr);
    main_live = bends.main_live;
    if (main_live) main = bends.main.curve();
    inverse_stator = 1.0 / L_ls, inverse_rotor = 1.0 / L_lr, inverse_main = 1.0 / M;
    inverse_magnetizing = 1.0 / base.L_m;
    inverse_k = M / base.L_m;
    const T of_rotor = L_ls * inverse_k;  // psi_s and psi_r share in the node's flux as L_lr and L_ls / k
    apart = of_rotor / (L_lr + of_rotor) - bends.place;
  }
};

template <class T>
class TCircuit {
 public:
  TCircuit() = default;
  TCircuit(const MachineParameters<T>& base, const IronBends<T>& bends)
      : branches_(base, bends), values_(values_of(base), bends.values()) {}

  // A, from Wb.
  Currents<T> currents(const Cx<T>& psi_s, const Cx<T>& psi_r) const {
    const TBranches<T>& b = branches_;
    const Node node = solved(values_of(psi_s), values_of(psi_r));
    const Cx<T> psi_m(T(node.psi_m.re), T(node.psi_m.im));
    Cx<T> stator = through(b.inverse_stator, b.stator, psi_s - psi_m);
    Cx<T> rotor = through(b.inverse_rotor, b.rotor, scaled(b.inverse_k, psi_r) - psi_m);
    Cx<T> residual = scaled(b.inverse_main, psi_m) - stator - rotor, extra;
    if (b.main_live) {
      const Cx<T> x = psi_m + scaled(b.apart, psi_s - psi_r);
      extra = scaled(b.main.share(x) * b.inverse_magnetizing, x);
      residual = residual + extra;
    }
    const Cx<T> step = node.inverse * residual;
    stator = stator + node.stator * step;
    rotor = rotor + node.rotor * step;
    extra = scaled(b.apart, extra - node.extra * step);
    return {stator + extra, extra - scaled(b.inverse_k, rotor)};
  }

 private:
  struct Node {
    Cx<double> psi_m;
    SymmetricTangent stator, rotor, extra;  // 1/H
    SymmetricTangent inverse;               // of the sum at the node, H
  };
  static constexpr double kConverged2 = 1e-19;  // of the fluxes, squared: the tangents are those of the end
  static constexpr int kMostRounds = 60;

  static MachineParameters<double> values_of(const MachineParameters<T>& p) {
    return {value_of(p.R_s), value_of(p.R_r), value_of(p.L_l), value_of(p.L_m)};
  }
  static Cx<double> values_of(const Cx<T>& a) { return {value_of(a.re), value_of(a.im)}; }

  static Cx<T> through(const T& inverse, const SaturationCurve<T>& curve, const Cx<T>& psi) {
    return scaled(inverse * (1.0 + curve.share(psi)), psi);
  }

  // Adds the current of (linear + share factor) psi; its derivative by psi.
  static SymmetricTangent add(double linear, double factor, const SaturationCurve<double>& curve,
                              const Cx<double>& psi, double sign, Cx<double>& sum) {
    const auto [share, slope] = curve.tangent(psi);
    const double secant = linear + factor * share, rank = 2.0 * factor * slope;
    sum = sum + scaled(sign * secant, psi);
    return {secant + rank * psi.re * psi.re, rank * psi.re * psi.im, secant + rank * psi.im * psi.im};
  }

  // The residual is the gradient of a convex function of psi_m, so a short enough step along Newton's
  // direction always lessens it.
  Node solved(const Cx<double>& psi_s, const Cx<double>& psi_r) const {
    const TBranches<double>& b = values_;
    const Cx<double> rotor = scaled(b.inverse_k, psi_r), apart = scaled(b.apart, psi_s - psi_r);
    const SymmetricTangent linear{b.inverse_main, 0.0, b.inverse_main};
    const double enough = kConverged2 * (norm(psi_s) + norm(psi_r));
    Node node;
    node.psi_m = scaled(1.0 / (b.inverse_stator + b.inverse_rotor + b.inverse_main),
                        scaled(b.inverse_stator, psi_s) + scaled(b.inverse_rotor, rotor));
    Cx<double> step;
    double last = INFINITY;
    for (int round = 0; round < kMostRounds; ++round) {
      Cx<double> residual = scaled(b.inverse_main, node.psi_m);
      Node there{node.psi_m, {}, {}, {}, {}};
      there.stator = add(b.inverse_stator, b.inverse_stator, b.stator, psi_s - node.psi_m, -1.0, residual);
      there.rotor = add(b.inverse_rotor, b.inverse_rotor, b.rotor, rotor - node.psi_m, -1.0, residual);
      if (b.main_live)
        there.extra = add(0.0, b.inverse_magnetizing, b.main, node.psi_m + apart, 1.0, residual);
      const double size = norm(residual);
      if (!std::isfinite(size)) break;
      if (size > last) {
        step = scaled(0.5, step);
        node.psi_m = node.psi_m + step;
        continue;
      }
      last = size;
      there.inverse = (there.stator + there.rotor + there.extra + linear).inverse();
      step = there.inverse * residual;
      node = there;
      node.psi_m = node.psi_m - step;
      if (norm(step) <= enough) break;
    }
    return node;
  }

  TBranches<T> branches_;
  TBranches<double> values_;
};

}  // namespace imrig::est
