/* Proportional-integral regulator with clamping anti-windup:
 *   e = reference - measured,  u = kp e + s,  s <- s + ki T e unless u is clamped at +-limit and e drives it
 * further out. The regulator of Fang, Lin and Wang (2005): kp 1.6 V/A, ki 116 V/(A s), T 0.3 ms. */
#ifndef IMRIG_LINK_DEVICE_REGULATOR_H
#define IMRIG_LINK_DEVICE_REGULATOR_H

#ifdef __cplusplus
extern "C" {
#endif

typedef struct imrig_regulator {
  double kp_V_per_A, ki_V_per_As, period_s, limit_V;
  double integral_V;
} imrig_regulator;

/* One period; returns the voltage in V, within +-limit_V. */
double imrig_regulator_step(imrig_regulator* r, double reference_A, double measured_A);

#ifdef __cplusplus
}
#endif
#endif
