#include "rig/link/device/profile.h"

#include <math.h>
#include <stddef.h>

static const double kTwoPi = 6.283185307179586476925286766559;
static const double kHalfRoot3 = 0.86602540378443864676372317075294;

static double fraction(double turns) { return turns - floor(turns); }

static double segment_time(const imrig_drive* d) { return (double)d->n * d->sample_s; }
static double segment_length(const imrig_drive* d) {
  return (double)d->segment->duration_samples * d->sample_s;
}

/* Amplitude, frequency and angle of the VOLTAGE segment, n samples after its start; beyond its end the end
 * values go on. */
static double amplitude_now(const imrig_drive* d) {
  const imrig_segment* s = d->segment;
  if (d->beyond) return s->amplitude_end_V;
  return s->amplitude_start_V +
         (s->amplitude_end_V - s->amplitude_start_V) * (double)d->n / (double)s->duration_samples;
}

static double frequency_now(const imrig_drive* d) {
  const imrig_segment* s = d->segment;
  if (d->beyond) return s->frequency_end_Hz;
  return s->frequency_start_Hz +
         (s->frequency_end_Hz - s->frequency_start_Hz) * (double)d->n / (double)s->duration_samples;
}

static double angle_now(const imrig_drive* d) {
  const imrig_segment* s = d->segment;
  const double length = segment_length(d);
  const double t = segment_time(d);
  if (s->kind != IMRIG_VOLTAGE) return d->angle_start;
  if (d->beyond) {
    return fraction(d->angle_start + 0.5 * (s->frequency_start_Hz + s->frequency_end_Hz) * length +
                    s->frequency_end_Hz * (t - length));
  }
  return fraction(d->angle_start + s->frequency_start_Hz * t +
                  0.5 * (s->frequency_end_Hz - s->frequency_start_Hz) * t * t / length);
}

static void command_vector(imrig_command* c, double alpha_V, double beta_V) {
  c->v_V[0] = alpha_V;
  c->v_V[1] = -0.5 * alpha_V + kHalfRoot3 * beta_V;
  c->v_V[2] = -0.5 * alpha_V - kHalfRoot3 * beta_V;
  c->legs = IMRIG_ALL_LEGS;
}

static void command_off(imrig_command* c) {
  c->v_V[0] = c->v_V[1] = c->v_V[2] = 0.0;
  c->legs = 0;
}

static void command_turning(imrig_command* c, double amplitude_V, double turns) {
  command_vector(c, amplitude_V * cos(kTwoPi * turns), amplitude_V * sin(kTwoPi * turns));
}

static void command_sides(imrig_command* c, const imrig_segment* s, double voltage_V) {
  int k;
  command_off(c);
  for (k = 0; k < 3; ++k) {
    if (s->plus_phases & (1 << k)) c->v_V[k] = 0.5 * voltage_V;
    if (s->minus_phases & (1 << k)) c->v_V[k] = -0.5 * voltage_V;
  }
  c->legs = (uint32_t)(s->plus_phases | s->minus_phases);
}

static double reference_A(const imrig_segment* s, double t) {
  double sum = s->offset_A;
  int32_t k;
  for (k = 0; k < s->n_tones; ++k)
    sum += s->tone_A[k] * sin(kTwoPi * fraction(s->tone_Hz[k] * t) + s->tone_rad[k]);
  return sum;
}

static void step_current(imrig_drive* d, const double i_A[3]) {
  const imrig_segment* s = d->segment;
  const double x = cos(s->angle_rad);
  const double y = sin(s->angle_rad);
  const double alpha = (2.0 * i_A[0] - i_A[1] - i_A[2]) / 3.0;
  const double beta = (i_A[1] - i_A[2]) / (2.0 * kHalfRoot3);
  const double v = imrig_regulator_step(&d->regulator, reference_A(s, segment_time(d)), alpha * x + beta * y);
  command_vector(&d->command, v * x, v * y);
}

static void step_dc(imrig_drive* d, const double i_A[3]) {
  const imrig_segment* s = d->segment;
  double out_A = 0.0;
  int k;
  if (isnan(s->level_A)) {
    command_sides(&d->command, s, s->level_V);
    return;
  }
  for (k = 0; k < 3; ++k) {
    if (s->minus_phases & (1 << k)) out_A -= i_A[k];
  }
  command_sides(&d->command, s, imrig_regulator_step(&d->regulator, s->level_A, out_A));
}

static int32_t period_of(const imrig_segment* s) {
  return s->period_samples > 0 ? s->period_samples : IMRIG_DEFAULT_PERIOD;
}

static void step_segment(imrig_drive* d, int64_t m, const double i_A[3]) {
  const imrig_segment* s = d->segment;
  switch (s->kind) {
    case IMRIG_VOLTAGE:
      if (m % d->pwm_samples == 0) command_turning(&d->command, amplitude_now(d), angle_now(d));
      break;
    case IMRIG_CURRENT:
      if (d->n % period_of(s) == 0) step_current(d, i_A);
      break;
    case IMRIG_DC:
      if (d->n % period_of(s) == 0) step_dc(d, i_A);
      break;
    default:
      command_off(&d->command);
      break;
  }
  ++d->n;
}

static void step_ramp(imrig_drive* d, int64_t m) {
  double left;
  if (d->ramp_n >= d->ramp_samples) {
    command_off(&d->command);
    return;
  }
  left = 1.0 - (double)d->ramp_n / (double)d->ramp_samples;
  if (!d->ramp_turns) {
    int k;
    for (k = 0; k < 3; ++k) d->command.v_V[k] = left * d->ramp_from.v_V[k];
  } else if (m % d->pwm_samples == 0) {
    const double t = (double)d->ramp_n * d->sample_s;
    command_turning(&d->command, left * d->ramp_amplitude_V,
                    fraction(d->ramp_angle + d->ramp_frequency_Hz * t));
  }
  ++d->ramp_n;
}

void imrig_drive_init(imrig_drive* d, double sample_s, int32_t pwm_samples) {
  d->sample_s = sample_s;
  d->pwm_samples = pwm_samples;
  d->voltage_limit_V = 0.0;
  imrig_drive_off(d);
}

void imrig_drive_off(imrig_drive* d) {
  d->segment = NULL;
  d->n = 0;
  d->beyond = 0;
  d->angle_start = 0.0;
  d->ramp_samples = d->ramp_n = 0;
  command_off(&d->command);
}

static int same_regulation(const imrig_segment* a, const imrig_segment* b) {
  if (a == NULL || a->kind != b->kind) return 0;
  if (a->kind == IMRIG_CURRENT) return a->angle_rad == b->angle_rad;
  return a->kind == IMRIG_DC && a->plus_phases == b->plus_phases && a->minus_phases == b->minus_phases &&
         !isnan(a->level_A);
}

void imrig_drive_enter(imrig_drive* d, const imrig_segment* s) {
  if (d->segment != NULL) d->angle_start = angle_now(d);
  if (!same_regulation(d->segment, s)) d->regulator.integral_V = 0.0;
  d->regulator.kp_V_per_A = isnan(s->kp_V_per_A) ? IMRIG_DEFAULT_KP : s->kp_V_per_A;
  d->regulator.ki_V_per_As = isnan(s->ki_V_per_As) ? IMRIG_DEFAULT_KI : s->ki_V_per_As;
  d->regulator.period_s = period_of(s) * d->sample_s;
  d->regulator.limit_V = d->voltage_limit_V;
  d->segment = s;
  d->n = 0;
  d->beyond = 0;
}

void imrig_drive_hold(imrig_drive* d) { d->beyond = 1; }

/* Where the ramp that is under way stands, or the segment, is where the new ramp begins. */
void imrig_drive_ramp_down(imrig_drive* d, int64_t samples) {
  if (d->segment != NULL) {
    d->ramp_turns = d->segment->kind == IMRIG_VOLTAGE;
    d->ramp_amplitude_V = d->ramp_turns ? amplitude_now(d) : 0.0;
    d->ramp_frequency_Hz = d->ramp_turns ? frequency_now(d) : 0.0;
    d->ramp_angle = angle_now(d);
  } else if (d->ramp_n < d->ramp_samples) {
    d->ramp_amplitude_V *= 1.0 - (double)d->ramp_n / (double)d->ramp_samples;
    d->ramp_angle = fraction(d->ramp_angle + d->ramp_frequency_Hz * (double)d->ramp_n * d->sample_s);
  }
  d->ramp_from = d->command;
  d->segment = NULL;
  d->ramp_samples = samples;
  d->ramp_n = 0;
}

int imrig_drive_ramped(const imrig_drive* d) { return d->segment == NULL && d->ramp_n >= d->ramp_samples; }

const imrig_command* imrig_drive_step(imrig_drive* d, int64_t m, const double i_A[3]) {
  if (d->segment != NULL)
    step_segment(d, m, i_A);
  else
    step_ramp(d, m);
  return &d->command;
}
