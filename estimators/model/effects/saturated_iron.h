#pragma once
// Currents of the magnetic circuit from its fluxes, saturation included: gradients of one energy, so that
// nothing is made or lost on a round trip.
//
// Side by side: each saturating branch sees a fixed combination of psi_s and psi_r beside the linear circuit.
//   main      psi_x = place psi_r + (1 - place) psi_s            i_x = g(|psi_x|) psi_x / L_m
//   leakage   psi_y = psi_s - (1 + rotor_share L_l/L_m) psi_r     i_y = g(|psi_y|) psi_y / L_l
// This is exact where one branch saturates by itself. rotor_share = 0: the stator's leakage, which carries
// the stator current as the whole leakage of the inverse-gamma circuit does; 1: all leakage behind the main
// flux, which carries the rotor current.
//
// T circuit, where leakage saturates on both sides (0 < rotor_share < 1): rotor_share splits L_l,
//   M = L_m + rotor_share L_l,  L_ls = (1 - rotor_share) L_l,  L_lr = M rotor_share L_l / L_m,  k = L_m / M
//   W = min over psi_m of E_s(psi_s - psi_m) + E_r(psi_r/k - psi_m) + |psi_m|^2/(2 M) + E_x(psi_m + d (psi_s
//   - psi_r))
// Both leakages bend at the same current; d is the difference between the place where the main flux saturates
// and the node's. The node's flux psi_m is solved by Newton's method for values, and one more step from there
// carries the derivatives (implicit function theorem). Source: Lipo and Consoli 1984, IEEE Trans. Industry
// Applications 20(1).

#include <cmath>
#include <complex>

#include "estimators/model/base_machine.h"
#include "estimators/model/effects/effect.h"
#include "estimators/model/effects/saturation_law.h"
#include "estimators/model/effects/scalar.h"

namespace imrig::est {

template <class T>
class SaturatedIron {
 public:
  SaturatedIron(const MachineParameters<T>& base, const IronBends<T>& bends)
      : bends_(bends),
        inverse_leakage_(1.0 / base.L_l),
        inverse_magnetizing_(1.0 / base.L_m),
        leakage_weight_(1.0 + bends.rotor_share * base.L_l / base.L_m) {
    const double share = value_of(bends.rotor_share);
    split_ = bends.leakage_live && share > 0.0 && share < 1.0;
    if (!split_) return;
    nodes_ = nodes_of(base);
    plain_ = plain(nodes_);
  }

  // A; psi_s, psi_r in Wb.
  Currents<T> currents(const Cx<T>& psi_s, const Cx<T>& psi_r) const {
    return split_ ? of_the_t_circuit(psi_s, psi_r) : side_by_side(psi_s, psi_r);
  }

 private:
  template <class S>
  struct Branch {
    S inverse{};  // 1/H
    SaturationCurve<S> curve;
    Cx<S> current(const Cx<S>& psi) const { return scaled(inverse * (1.0 + curve.share(psi)), psi); }
  };
  template <class S>
  struct Nodes {
    Branch<S> stator, rotor;
    SaturationCurve<S> main;
    S inverse_main{}, inverse_magnetizing{}, inverse_k{}, apart{};
    Cx<S> extra(const Cx<S>& psi) const { return scaled(main.share(psi) * inverse_magnetizing, psi); }
  };
  struct Symmetric {
    double xx = 0.0, xy = 0.0, yy = 0.0;
    Symmetric operator+(const Symmetric& o) const { return {xx + o.xx, xy + o.xy, yy + o.yy}; }
    template <class S>
    Cx<S> operator*(const Cx<S>& a) const {
      return {xx * a.re + xy * a.im, xy * a.re + yy * a.im};
    }
    Symmetric inverse() const {
      const double d = 1.0 / (xx * yy - xy * xy);
      return {yy * d, -xy * d, xx * d};
    }
  };
  struct Solved {
    Cx<double> psi_m;
    Symmetric stator, rotor, extra, inverse;  // tangents, 1/H, and the inverse of their sum at the node
  };
  static constexpr double kConverged2 = 1e-19;  // of the fluxes, squared: the tangents are those of the end
  static constexpr int kMostRounds = 60;

  Nodes<T> nodes_of(const MachineParameters<T>& base) const {
    const T& p = bends_.rotor_share;
    const T M = base.L_m + p * base.L_l, L_ls = (1.0 - p) * base.L_l, L_lr = M * p * base.L_l / base.L_m;
    const T inverse_k = M / base.L_m, bend_A = bends_.leakage.psi_ref_Wb / base.L_l;
    Nodes<T> n;
    n.stator = {1.0 / L_ls, bends_.leakage};
    n.stator.curve.psi_ref_Wb = L_ls * bend_A;
    n.rotor = {1.0 / L_lr, bends_.leakage};
    n.rotor.curve.psi_ref_Wb = L_lr * bend_A;
    n.main = bends_.main;
    n.inverse_main = 1.0 / M;
    n.inverse_magnetizing = inverse_magnetizing_;
    n.inverse_k = inverse_k;
    const T of_rotor = L_ls * inverse_k;  // the node's shares of psi_s and psi_r are L_lr : L_ls / k
    n.apart = of_rotor / (L_lr + of_rotor) - bends_.place;
    return n;
  }

  static SaturationCurve<double> plain(const SaturationCurve<T>& c) {
    return {value_of(c.extra), value_of(c.exponent), value_of(c.bend), value_of(c.psi_ref_Wb)};
  }
  static Nodes<double> plain(const Nodes<T>& n) {
    return {{value_of(n.stator.inverse), plain(n.stator.curve)},
            {value_of(n.rotor.inverse), plain(n.rotor.curve)},
            plain(n.main),
            value_of(n.inverse_main),
            value_of(n.inverse_magnetizing),
            value_of(n.inverse_k),
            value_of(n.apart)};
  }
  static Cx<double> plain(const Cx<T>& a) { return {value_of(a.re), value_of(a.im)}; }

  Currents<T> side_by_side(const Cx<T>& psi_s, const Cx<T>& psi_r) const {
    Currents<T> i;
    i.stator = scaled(inverse_leakage_, psi_s - psi_r);
    i.rotor = i.stator - scaled(inverse_magnetizing_, psi_r);
    if (bends_.main_live) {
      const Cx<T> psi = psi_r + scaled(1.0 - bends_.place, psi_s - psi_r);
      const Cx<T> extra = scaled(bends_.main.share(psi) * inverse_magnetizing_, psi);
      i.stator = i.stator + scaled(1.0 - bends_.place, extra);
      i.rotor = i.rotor - scaled(bends_.place, extra);
    }
    if (bends_.leakage_live) {
      const Cx<T> psi = psi_s - scaled(leakage_weight_, psi_r);
      const Cx<T> extra = scaled(bends_.leakage.share(psi) * inverse_leakage_, psi);
      i.stator = i.stator + extra;
      i.rotor = i.rotor + scaled(leakage_weight_, extra);
    }
    return i;
  }

  // d/dpsi of (linear + share(psi) factor) psi
  static Symmetric tangent(double linear, double factor, const SaturationCurve<double>& curve,
                           const Cx<double>& psi) {
    const double secant = linear + factor * curve.share(psi), rank = 2.0 * factor * curve.slope(psi);
    return {secant + rank * psi.re * psi.re, rank * psi.re * psi.im, secant + rank * psi.im * psi.im};
  }

  // The residual is the gradient of a convex function of psi_m, so a short enough step along Newton's
  // direction always lessens it.
  Solved solve(const Cx<double>& psi_s, const Cx<double>& psi_r) const {
    const Nodes<double>& n = plain_;
    const Cx<double> rotor = scaled(n.inverse_k, psi_r), apart = scaled(n.apart, psi_s - psi_r);
    Solved at;
    at.psi_m = scaled(1.0 / (n.stator.inverse + n.rotor.inverse + n.inverse_main),
                      scaled(n.stator.inverse, psi_s) + scaled(n.rotor.inverse, rotor));
    const double enough = kConverged2 * (norm(psi_s) + norm(psi_r));
    Cx<double> step;
    double last = INFINITY;
    for (int round = 0; round < kMostRounds; ++round) {
      const Cx<double> y_s = psi_s - at.psi_m, y_r = rotor - at.psi_m, x = at.psi_m + apart;
      Cx<double> residual = scaled(n.inverse_main, at.psi_m) - n.stator.current(y_s) - n.rotor.current(y_r);
      if (bends_.main_live) residual = residual + n.extra(x);
      const double size = norm(residual);
      if (size > last) {
        step = scaled(0.5, step);
        at.psi_m = at.psi_m + step;
        continue;
      }
      last = size;
      at.stator = tangent(n.stator.inverse, n.stator.inverse, n.stator.curve, y_s);
      at.rotor = tangent(n.rotor.inverse, n.rotor.inverse, n.rotor.curve, y_r);
      at.extra = bends_.main_live ? tangent(0.0, n.inverse_magnetizing, n.main, x) : Symmetric{};
      const Symmetric linear{n.inverse_main, 0.0, n.inverse_main};
      at.inverse = (at.stator + at.rotor + at.extra + linear).inverse();
      step = at.inverse * residual;
      at.psi_m = at.psi_m - step;
      if (norm(step) <= enough) break;
    }
    return at;
  }

  Currents<T> of_the_t_circuit(const Cx<T>& psi_s, const Cx<T>& psi_r) const {
    const Solved at = solve(plain(psi_s), plain(psi_r));
    const Nodes<T>& n = nodes_;
    const Cx<T> psi_m(T(at.psi_m.re), T(at.psi_m.im));
    Cx<T> stator = n.stator.current(psi_s - psi_m);
    Cx<T> rotor = n.rotor.current(scaled(n.inverse_k, psi_r) - psi_m);
    Cx<T> extra;
    if (bends_.main_live) extra = n.extra(psi_m + scaled(n.apart, psi_s - psi_r));
    const Cx<T> step = at.inverse * (scaled(n.inverse_main, psi_m) + extra - stator - rotor);
    stator = stator + at.stator * step;
    rotor = rotor + at.rotor * step;
    extra = extra - at.extra * step;
    const Cx<T> shifted = scaled(n.apart, extra);
    return {stator + shifted, shifted - scaled(n.inverse_k, rotor)};
  }

  IronBends<T> bends_;
  T inverse_leakage_, inverse_magnetizing_, leakage_weight_;
  bool split_ = false;
  Nodes<T> nodes_;
  Nodes<double> plain_;
};

}  // namespace imrig::est
