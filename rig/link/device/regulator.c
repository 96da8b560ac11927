#include "rig/link/device/regulator.h"

double imrig_regulator_step(imrig_regulator* r, double reference_A, double measured_A) {
  const double error = reference_A - measured_A;
  const double wanted = r->kp_V_per_A * error + r->integral_V;
  const int above = wanted > r->limit_V;
  const int below = wanted < -r->limit_V;
  if (!(above && error > 0) && !(below && error < 0)) r->integral_V += r->ki_V_per_As * r->period_s * error;
  if (above) return r->limit_V;
  return below ? -r->limit_V : wanted;
}
