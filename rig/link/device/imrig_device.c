#include <math.h>
#include <string.h>

#include "rig/link/device/device_internal.h"

#define SPEED_WINDOW 128   /* samples: one count of 4096 is 1.9 rpm over 7.7 ms */
#define STATUS_NS 10000000 /* of device time */

void imrig_device_init(imrig_device* d, const imrig_device_config* config) {
  memset(d, 0, sizeof *d);
  d->config = *config;
  d->sample_s = (double)config->sample_time_ns * 1e-9;
  imrig_drive_init(&d->drive, d->sample_s, config->pwm_samples);
  imrig_blocks_init(&d->blocks);
  d->segment = -1;
  d->tag.segment = -1;
  d->encoder_mark_index = -1;
  d->stator_C = NAN;
}

void imrig_changed(imrig_device* d) { d->status_pending = 1; }

imrig_profile* imrig_spare_bank(imrig_device* d) { return &d->banks[1 - d->active]; }

imrig_profile_limits imrig_limits_of(const imrig_device* d) {
  imrig_profile_limits limits;
  limits.voltage_V = d->host.voltage_limit_V;
  limits.current_A = d->host.current_limit_A;
  limits.sample_s = d->sample_s;
  return limits;
}

int imrig_is_driving(const imrig_device* d) {
  return d->start_pending || d->state == IMRIG_RUNNING || d->state == IMRIG_HOLDING ||
         d->state == IMRIG_STOPPING;
}

/* What sample next_index, and the command that acts from its instant on, belong to. */
static void set_tag(imrig_device* d) {
  const imrig_profile* p = &d->banks[d->active];
  const int in_profile = d->state == IMRIG_RUNNING || d->state == IMRIG_HOLDING || d->state == IMRIG_STOPPING;
  d->tag.profile_id = in_profile ? p->profile_id : 0;
  d->tag.segment = d->segment;
  d->tag.record = d->segment >= 0 ? p->segments[d->segment].record : 0;
  d->tag.gates_on = d->drive.command.legs != 0;
}

void imrig_enter_idle(imrig_device* d) {
  imrig_drive_off(&d->drive);
  d->state = IMRIG_IDLE;
  d->segment = -1;
  d->banks[d->active].profile_id = 0;
  set_tag(d);
  imrig_changed(d);
}

void imrig_enter_trip(imrig_device* d, int32_t trip) {
  if (d->state == IMRIG_TRIPPED) return;
  d->start_pending = 0;
  imrig_spare_bank(d)->profile_id = 0;
  imrig_spare_bank(d)->committed = 0;
  imrig_enter_idle(d);
  d->state = IMRIG_TRIPPED;
  d->trip = trip;
}

/* Without a ramp, or with nothing driven, the next command is the last one's end. */
void imrig_enter_stop(imrig_device* d, double ramp_s) {
  const int64_t samples = d->drive.command.legs == 0 ? 0 : (int64_t)(ramp_s / d->sample_s + 0.5);
  if (d->state == IMRIG_STOPPING && samples >= d->drive.ramp_samples - d->drive.ramp_n) return;
  imrig_drive_ramp_down(&d->drive, samples);
  d->state = IMRIG_STOPPING;
  d->segment = -1;
  set_tag(d);
  imrig_changed(d);
}

static void enter_segment(imrig_device* d, int32_t segment) {
  const imrig_segment* s = &d->banks[d->active].segments[segment];
  imrig_drive_enter(&d->drive, s);
  d->segment = segment;
  d->segment_left = s->duration_samples;
  imrig_changed(d);
}

static void begin_profile(imrig_device* d) {
  d->start_pending = 0;
  if (d->state == IMRIG_IDLE) imrig_drive_off(&d->drive);
  d->drive.voltage_limit_V = d->host.voltage_limit_V;
  d->banks[d->active].profile_id = 0;
  d->active = 1 - d->active;
  d->banks[d->active].committed = 0;
  imrig_spare_bank(d)->committed = 0;
  d->state = IMRIG_RUNNING;
  enter_segment(d, 0);
}

static void end_segment(imrig_device* d) {
  const imrig_profile* p = &d->banks[d->active];
  if (d->segment + 1 < p->n_segments) {
    enter_segment(d, d->segment + 1);
  } else if (p->at_end == IMRIG_AT_END_HOLD && p->segments[d->segment].kind != IMRIG_GATES_OFF) {
    imrig_drive_hold(&d->drive);
    d->state = IMRIG_HOLDING;
    d->segment = -1;
    imrig_changed(d);
  } else {
    imrig_enter_idle(d);
  }
}

/* Decides what command number next_index belongs to, and computes it. */
static void advance(imrig_device* d, const double i_A[3]) {
  const int64_t m = d->next_index;
  if (d->state == IMRIG_RUNNING && d->segment_left == 0) end_segment(d);
  if (d->start_pending && m % d->config.pwm_samples == 0) begin_profile(d);
  if (d->state == IMRIG_STOPPING && imrig_drive_ramped(&d->drive)) imrig_enter_idle(d);
  if (d->state == IMRIG_RUNNING) --d->segment_left;
  if (d->state != IMRIG_IDLE && d->state != IMRIG_TRIPPED) imrig_drive_step(&d->drive, m, i_A);
  set_tag(d);
}

static void measure_speed(imrig_device* d, const imrig_counts* counts) {
  const int64_t span = d->next_index - d->encoder_mark_index;
  if (d->encoder_mark_index < 0) {
    d->encoder_mark_index = d->next_index;
    d->encoder_mark = counts->encoder;
  } else if (span >= SPEED_WINDOW) {
    /* Unsigned on purpose: the counter wraps. Above 2^31 the shaft went backwards. */
    const uint32_t difference = (uint32_t)counts->encoder - (uint32_t)d->encoder_mark;
    const double turned = difference < 0x80000000u ? (double)difference : (double)difference - 4294967296.0;
    d->speed_rpm =
        (float)(60.0 * turned / ((double)d->config.encoder_counts_per_rev * (double)span * d->sample_s));
    d->encoder_mark_index = d->next_index;
    d->encoder_mark = counts->encoder;
  }
}

static void check_limits(imrig_device* d, double current_A) {
  if (!d->welcomed) return;
  if (current_A > d->host.current_limit_A) imrig_enter_trip(d, IMRIG_TRIP_OVER_CURRENT);
  if (fabs((double)d->speed_rpm) > d->host.speed_limit_rpm) imrig_enter_trip(d, IMRIG_TRIP_OVER_SPEED);
  if ((double)d->stator_C > d->host.stator_limit_C) imrig_enter_trip(d, IMRIG_TRIP_OVER_TEMPERATURE);
}

static double measure_current(imrig_device* d, const imrig_counts* counts, double i_A[3]) {
  double alpha;
  double beta;
  double amplitude_A;
  int k;
  for (k = 0; k < 3; ++k) i_A[k] = (double)counts->i[k] * (double)d->config.current_A_per_count;
  alpha = (2.0 * i_A[0] - i_A[1] - i_A[2]) / 3.0;
  beta = (i_A[1] - i_A[2]) / 1.7320508075688772;
  amplitude_A = sqrt(alpha * alpha + beta * beta);
  if (amplitude_A > d->current_peak_A) d->current_peak_A = amplitude_A;
  return amplitude_A;
}

imrig_command imrig_device_sample(imrig_device* d, const imrig_counts* counts) {
  double i_A[3];
  const double current_A = measure_current(d, counts, i_A);
  if (d->welcomed) {
    imrig_blocks_push(&d->blocks, &d->tag, d->next_index, d->next_index * d->config.sample_time_ns / 1000,
                      counts);
  }
  measure_speed(d, counts);
  d->stator_C = counts->stator_C;
  ++d->next_index;
  check_limits(d, current_A);
  advance(d, i_A);
  if ((d->next_index - d->last_status_index) * d->config.sample_time_ns >= STATUS_NS) d->status_pending = 1;
  return d->drive.command;
}

int imrig_device_must_be_off(const imrig_device* d) { return d->state == IMRIG_TRIPPED; }

int imrig_device_may_sample(const imrig_device* d) {
  return d->welcomed && (!d->config.waits_for_credit || d->next_index < d->until_index);
}
