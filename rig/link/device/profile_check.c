#include <math.h>
#include <stddef.h>

#include "rig/link/device/profile.h"

#define MAX_DURATION 1000000000 /* samples: over 16 hours of 60 us */
#define MAX_FREQUENCY_HZ 1000.0
#define MAX_GAIN 1e6
#define MAX_PERIOD 1000

/* False for NaN. */
static int within(double x, double low, double high) { return x >= low && x <= high; }
static int gain_ok(double x) { return isnan(x) || within(x, 0.0, MAX_GAIN); }
static int period_ok(int32_t samples) { return samples >= 0 && samples <= MAX_PERIOD; }

static int32_t check_voltage(const imrig_segment* s, const imrig_profile_limits* l) {
  if (!within(s->frequency_start_Hz, -MAX_FREQUENCY_HZ, MAX_FREQUENCY_HZ) ||
      !within(s->frequency_end_Hz, -MAX_FREQUENCY_HZ, MAX_FREQUENCY_HZ)) {
    return IMRIG_MALFORMED;
  }
  if (!(s->amplitude_start_V >= 0.0) || !(s->amplitude_end_V >= 0.0)) return IMRIG_MALFORMED;
  return s->amplitude_start_V <= l->voltage_V && s->amplitude_end_V <= l->voltage_V ? IMRIG_DONE
                                                                                    : IMRIG_OVER_LIMIT;
}

static int32_t check_current(const imrig_segment* s, const imrig_profile_limits* l) {
  const int32_t period = s->period_samples > 0 ? s->period_samples : IMRIG_DEFAULT_PERIOD;
  const double nyquist_Hz = 0.5 / (period * l->sample_s);
  double sum_A = fabs(s->offset_A);
  int32_t k;
  if (!within(s->angle_rad, -1e3, 1e3) || s->n_tones < 0 || s->n_tones > IMRIG_TONES) return IMRIG_MALFORMED;
  if (!gain_ok(s->kp_V_per_A) || !gain_ok(s->ki_V_per_As) || !period_ok(s->period_samples))
    return IMRIG_MALFORMED;
  for (k = 0; k < s->n_tones; ++k) {
    if (!within(s->tone_Hz[k], 0.0, nyquist_Hz) || !within(s->tone_rad[k], -1e3, 1e3)) return IMRIG_MALFORMED;
    sum_A += fabs(s->tone_A[k]);
  }
  if (isnan(sum_A)) return IMRIG_MALFORMED;
  return sum_A <= l->current_A ? IMRIG_DONE : IMRIG_OVER_LIMIT;
}

static int32_t check_dc(const imrig_segment* s, const imrig_profile_limits* l) {
  if (s->plus_phases < 1 || s->plus_phases > 7 || s->minus_phases < 1 || s->minus_phases > 7)
    return IMRIG_MALFORMED;
  if ((s->plus_phases & s->minus_phases) != 0 || !period_ok(s->period_samples)) return IMRIG_MALFORMED;
  if (isnan(s->level_A)) {
    if (isnan(s->level_V)) return IMRIG_MALFORMED;
    return fabs(s->level_V) <= l->voltage_V ? IMRIG_DONE : IMRIG_OVER_LIMIT;
  }
  if (!gain_ok(s->kp_V_per_A) || !gain_ok(s->ki_V_per_As)) return IMRIG_MALFORMED;
  return fabs(s->level_A) <= l->current_A ? IMRIG_DONE : IMRIG_OVER_LIMIT;
}

int32_t imrig_segment_check(const imrig_segment* s, const imrig_profile_limits* limits) {
  if (s->duration_samples < 1 || s->duration_samples > MAX_DURATION || s->record < 0) return IMRIG_MALFORMED;
  switch (s->kind) {
    case IMRIG_GATES_OFF:
      return IMRIG_DONE;
    case IMRIG_VOLTAGE:
      return check_voltage(s, limits);
    case IMRIG_CURRENT:
      return check_current(s, limits);
    case IMRIG_DC:
      return check_dc(s, limits);
    default:
      return IMRIG_MALFORMED;
  }
}

int32_t imrig_profile_check(const imrig_profile* p, const imrig_profile_limits* limits) {
  int32_t k;
  if (p->n_segments < 1 || p->n_segments > IMRIG_MAX_SEGMENTS) return IMRIG_MALFORMED;
  if (p->at_end != IMRIG_AT_END_GATES_OFF && p->at_end != IMRIG_AT_END_HOLD) return IMRIG_MALFORMED;
  for (k = 0; k < p->n_segments; ++k) {
    int32_t result;
    if ((p->have & (1u << k)) == 0) return IMRIG_INCOMPLETE;
    result = imrig_segment_check(&p->segments[k], limits);
    if (result != IMRIG_DONE) return result;
  }
  return IMRIG_DONE;
}
