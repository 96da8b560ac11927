// The saturated magnetic circuit against what can be worked out without it: curve limits, and a T circuit
// built from its branches outwards, so that no node has to be solved.

#include "estimators/model/effects/saturated_iron.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>

namespace imrig::est {
namespace {

using Complex = std::complex<double>;

const MachineParameters<double> kMotor{0.39, 0.22, 0.006, 0.068};

TEST(SaturationCurve, WithoutABendIsThePowerLaw) {
  const SaturationCurve<double> curve{0.7, 5.0, 0.0, 0.5};
  for (const double u : {0.2, 1.0, 1.6})
    EXPECT_NEAR(curve.share({0.5 * u, 0.0}), 0.7 * std::pow(u, 5.0), 1e-9);
  const SaturationCurve<double> far{0.7, 5.0, 1e-3, 0.5};
  EXPECT_NEAR(far.share({0.4, 0.3}), curve.share({0.4, 0.3}), 1e-12);
}

TEST(SaturationCurve, RunsAlongASecondLineBeyondTheKnee) {
  const double b = 2.0, n = 6.0;
  const SaturationCurve<double> curve{1.0, n, b, 1.0};
  // psi (share - its limit) is the same everywhere far out: the line's distance from the origin's, limit/b.
  const double limit = 1.0 / (1.0 - std::pow(1.0 + std::pow(b, n), -1.0 / n));
  for (const double psi : {20.0, 40.0, 80.0})
    EXPECT_NEAR(psi * (limit - curve.share({psi, 0.0})), limit / b, 1e-6) << psi;
  // Below the knee hardly anything.
  EXPECT_LT(curve.share({0.1, 0.0}), 1e-4);
}

TEST(SaturationCurve, BeginsWithTheSquareOfTheFluxByItsOnset) {
  const double b = 2.0, n = 6.0, onset = 0.3;
  const SaturationCurve<double> early{1.0, n, b, 1.0, onset}, sharp{1.0, n, b, 1.0, 0.0},
      soft{1.0, 2.0, b, 1.0};
  EXPECT_NEAR(early.share({0.0, 1.0}), 1.0, 1e-12) << "extra is the share at the reference flux";
  // Far below the knee s = o (b u)^2 / 2.
  const double s_n = 1.0 - std::pow(1.0 + std::pow(b, n), -1.0 / n), s_2 = 1.0 - 1.0 / std::sqrt(1.0 + b * b);
  const double whole = (1.0 - onset) * s_n + onset * s_2;
  EXPECT_NEAR(early.share({0.01, 0.0}) * whole, onset * 0.5 * 1e-4 * b * b, 1e-7);
  for (const double psi : {0.2, 0.5, 0.9}) {
    const double between =
        (1.0 - onset) * s_n * sharp.share({psi, 0.0}) + onset * s_2 * soft.share({psi, 0.0});
    EXPECT_NEAR(early.share({psi, 0.0}) * whole, between, 1e-9) << psi;
  }
}

TEST(SaturationCurve, SlopeIsThatOfDifferences) {
  for (const auto& [bend, onset] : {std::pair{0.0, 0.0}, {0.5, 0.0}, {3.0, 0.0}, {3.0, 0.4}}) {
    const SaturationCurve<double> curve{0.7, 3.3, bend, 0.5, onset};
    for (const double psi : {0.05, 0.3, 0.5, 0.9}) {
      const double h = 1e-5 * psi;
      const double difference = (curve.share({psi + h, 0.0}) - curve.share({psi - h, 0.0})) / (4.0 * psi * h);
      EXPECT_NEAR(curve.tangent({psi, 0.0}).slope, difference, 1e-7 * std::abs(difference))
          << bend << " " << psi;
    }
  }
}

// Flux that drives a current through a branch, by bisection: none of the class's own solving.
Complex flux_of(double L, const SaturationCurve<double>& curve, Complex current) {
  double low = 0.0, high = L * std::abs(current);
  for (int k = 0; k < 200; ++k) {
    const double psi = 0.5 * (low + high);
    (psi / L * (1.0 + curve.share({psi, 0.0})) < std::abs(current) ? low : high) = psi;
  }
  return std::abs(current) == 0.0 ? 0.0 : low * current / std::abs(current);
}

struct Branches {
  double M, L_ls, L_lr, k;
  explicit Branches(double share)
      : M(kMotor.L_m + share * kMotor.L_l),
        L_ls((1.0 - share) * kMotor.L_l),
        L_lr(M * share * kMotor.L_l / kMotor.L_m),
        k(kMotor.L_m / M) {}
};

TEST(SaturatedIron, TCircuitGivesTheCurrentsThatItsBranchesWereBuiltFrom) {
  for (const double share : {0.05, 0.4, 0.5, 0.8}) {
    for (const bool main : {false, true}) {
      const Branches b(share);
      IronBends<double> bends;
      bends.leakage = {0.8, 4.0, 3.0, 60.0 * kMotor.L_l};
      bends.leakage_live = true;
      bends.rotor_share = share;
      bends.main = {0.9, 6.0, 1.5, 0.5};
      bends.main_live = main;
      // The place of the node itself: its shares of psi_r and psi_s, which add up to one.
      const double of_r = b.L_ls / b.k;
      bends.place = of_r / (b.L_lr + of_r);
      const SaturatedIron<double> iron(kMotor, bends);
      const SaturationCurve<double> main_curve = bends.main.curve();
      const SaturationCurve<double> s(0.8, 4.0, 3.0, 60.0 * b.L_ls), r(0.8, 4.0, 3.0, 60.0 * b.L_lr);
      for (const double size : {3.0, 20.0, 90.0}) {
        const Complex psi_m = std::polar(0.47, 0.3), i_s = std::polar(size, -0.6);
        const double extra = main ? main_curve.share(Cx<double>(psi_m)) / kMotor.L_m : 0.0;
        const Complex i_r = psi_m * (1.0 / b.M + extra) - i_s;
        const Complex psi_s = psi_m + flux_of(b.L_ls, s, i_s),
                      psi_r = b.k * (psi_m + flux_of(b.L_lr, r, i_r));
        const Currents<double> found = iron.currents(Cx<double>(psi_s), Cx<double>(psi_r));
        EXPECT_LT(std::abs(plain(found.stator) - i_s), 1e-9 * size) << share << " " << main << " " << size;
        EXPECT_LT(std::abs(plain(found.rotor) + i_r / b.k), 1e-9 * size)
            << share << " " << main << " " << size;
      }
    }
  }
}

TEST(SaturatedIron, BothCircuitsAreTheLinearOneWhereNothingBends) {
  IronBends<double> bends;
  bends.leakage = {1e-12, 2.0, 0.0, 0.3};
  bends.main = {1e-12, 6.0, 0.0, 0.5};
  bends.main_live = true;
  bends.place = 0.3;
  const Cx<double> psi_s(0.41, -0.12), psi_r(0.33, -0.25);
  for (const double share : {0.0, 0.3, 0.9, 1.0}) {
    bends.rotor_share = share;
    for (const bool live : {false, true}) {
      bends.leakage_live = live;
      const Currents<double> i = SaturatedIron<double>(kMotor, bends).currents(psi_s, psi_r);
      const Complex stator = plain(psi_s - psi_r) / kMotor.L_l, rotor = stator - plain(psi_r) / kMotor.L_m;
      EXPECT_LT(std::abs(plain(i.stator) - stator), 1e-9) << share;
      EXPECT_LT(std::abs(plain(i.rotor) - rotor), 1e-9) << share;
    }
  }
}

// The ends of the split are the combinations of two fluxes that stand beside the linear circuit.
TEST(SaturatedIron, TheTCircuitGoesOverIntoItsEnds) {
  IronBends<double> bends;
  bends.leakage = {0.8, 4.0, 2.0, 0.3};
  bends.leakage_live = true;
  const Cx<double> psi_s(0.55, 0.1), psi_r(0.30, -0.05);
  for (const double end : {0.0, 1.0}) {
    bends.rotor_share = end;
    const Currents<double> at_end = SaturatedIron<double>(kMotor, bends).currents(psi_s, psi_r);
    bends.rotor_share = std::abs(end - 1e-7);
    const Currents<double> near = SaturatedIron<double>(kMotor, bends).currents(psi_s, psi_r);
    EXPECT_LT(std::abs(plain(near.stator) - plain(at_end.stator)), 1e-4 * std::abs(plain(at_end.stator)))
        << end;
    EXPECT_LT(std::abs(plain(near.rotor) - plain(at_end.rotor)), 1e-4 * std::abs(plain(at_end.rotor))) << end;
  }
}

// A few times the fluxes that any motor reaches, and curves as steep as the bounds allow.
TEST(SaturatedIron, TheNodeIsFoundFarBeyondTheKnees) {
  for (const double exponent : {0.5, 2.0, 10.0}) {
    for (const double bend : {0.0, 0.1, 10.0}) {
      IronBends<double> bends;
      bends.leakage = {20.0, exponent, bend, 0.3};
      bends.main = {20.0, 16.0, bend, 0.5};
      bends.leakage_live = bends.main_live = true;
      bends.rotor_share = 0.01;
      bends.place = 1.0;
      const SaturatedIron<double> iron(kMotor, bends);
      for (const double psi : {0.01, 0.5, 2.0}) {
        const Complex psi_s = std::polar(psi, 0.2), psi_r = std::polar(0.7 * psi, -1.9);
        const Currents<double> i = iron.currents(Cx<double>(psi_s), Cx<double>(psi_r));
        // One torque: a node that is not settled breaks the balance.
        const double by_stator = (std::conj(psi_s) * plain(i.stator)).imag(),
                     by_rotor = (std::conj(psi_r) * plain(i.rotor)).imag();
        const double scale = psi * (std::abs(plain(i.stator)) + std::abs(plain(i.rotor)));
        EXPECT_NEAR(by_stator, by_rotor, 1e-9 * scale) << exponent << " " << bend << " " << psi;
      }
    }
  }
}

}  // namespace
}  // namespace imrig::est
