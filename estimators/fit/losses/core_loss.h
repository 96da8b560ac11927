#pragma once
// Core loss, friction and windage from no-load tests by power (Proca and Keyhani 2002, section VI):
//   P_rotor = P_in - (3/2) R_s |I|^2                                        (15), peak values
// a) as published: the network N_d(psi, w_e) of (16)-(17) maps P_rotor; at zero flux it is friction and
// windage
//    (19); the rest is core loss (18); R_c = (3/2) (w_e psi)^2 / P_core (20), mapped by a network of its own.
// b) by physics, with w_0, psi_0 the largest frequency and flux of the tests:
//      P_rotor = P_core + T w_e/n_p,    P_core = h (w_e/w_0) x^a + e (w_e/w_0)^2 x^2
//      x = (psi/psi_0) sqrt(1 + g (psi/psi_0)^n)                            the T circuit's rotor flux
//      T       = c_0 + c_1 w_M + c_2 w_M^2 + d |I|^2 w_M^(p-1)              friction, windage, stray drag
//      T       = (3/2) n_p w_s psi^2 / (kappa R_r)                          what the slip says
//    linear in h, e, c, d and 1/R_r for given a and p, which are scanned; coefficients that come out negative
//    are left out. The slip's row separates what brakes the shaft from what the iron takes; it needs slip
//    known to 1e-5, which an encoder gives over a whole record. kappa: R_r falls as the main flux saturates,
//    (L_mT/L_r)^2 of the T circuit over its unsaturated value, leakages taken as equal. The iron burns by the
//    T circuit's flux, psi/sqrt(kappa): g and n are a fit to the points' kappa. Without them the law bends to
//    follow the large fluxes and lacks a tenth at the small ones.
// Both predict the points of five folds that they have not seen.

#include <optional>
#include <string>
#include <vector>

#include "estimators/fit/losses/tanh_network.h"
#include "estimators/fit/maps/steady_phasor.h"
#include "estimators/model/model.h"

namespace imrig::est {

struct NoLoadPoint {
  std::size_t record = 0;
  double w_e = 0.0, w_s = 0.0;  // electrical, rad/s
  double slip_sigma = 0.0;      // of w_s
  double psi_r_Wb = 0.0;
  double I_A = 0.0;  // peak
  double kappa = 1.0;
  double P_rotor_W = 0.0;  // (15)
  double input_W = 0.0;
};

struct CoreLossLaw {
  double w_0 = 1.0, psi_0 = 1.0;
  double synchronous_per_w_e = 1.0;        // 1/n_p
  Parameter hysteresis_W, eddy_W;          // at w_0, psi_0
  double exponent = 2.0;                   // a
  double rise = 0.0, rise_exponent = 2.0;  // g, n
  Parameter coulomb_Nm, viscous_Nms, windage_Nms2;
  Parameter drag;                       // d, N m / A^2, with w_M in rad/s
  double drag_exponent = 2.0;           // p
  Parameter R_r;                        // what the slip says, unsaturated, at the temperature of the tests
  double iron_share(double psi) const;  // x
  double core_W(double w_e, double psi) const;
  double R_c(double w_e, double psi) const;  // ohm; infinite without core loss
  double friction_Nm(double w_M) const;      // friction and windage
  double rotor_W(const NoLoadPoint& point, int pole_pairs) const;
};

// Prediction of points that the fit had not seen: rms over them.
struct HeldOut {
  double network_W = kMissing;
  double physics_W = kMissing;
  double network_relative = kMissing;
  double physics_relative = kMissing;
  bool physics_wins() const { return physics_W < network_W; }
};

struct CoreLossResult {
  std::string failure;
  std::vector<NoLoadPoint> points;
  CoreLossLaw physics;
  TanhNetwork network;      // P_rotor(psi, w_e)
  TanhNetwork R_c_network;  // ln R_c(psi, w_e)
  bool has_R_c_network = false;
  HeldOut held_out;
  double fitted_physics_W = kMissing, fitted_network_W = kMissing;  // rms over all points
  std::vector<std::string> notes;
};

// The physical law alone, or nothing when the points do not carry it.
std::optional<CoreLossLaw> fit_core_law(const std::vector<NoLoadPoint>& points, int pole_pairs);

CoreLossResult fit_core_loss(const std::vector<NoLoadPoint>& points, int pole_pairs);

}  // namespace imrig::est
