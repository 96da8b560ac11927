/* Profiles: a list of segments, checked whole before anything moves, then turned into one voltage command per
 * sample.
 *
 * Command number m acts over [t_m, t_m+1), t_m = m T; it is computed when sample m-1 has been taken. Segment
 * s covers the commands and samples first..first+duration-1; t counts from its first sample. GATES_OFF  all
 * legs open. VOLTAGE    amplitude(t) exp(j angle(t)): amplitude and frequency ramp linearly from start to
 * end, angle is the integral of 2 pi frequency and goes on from where the last VOLTAGE segment (or hold)
 * ended, also across profiles; it starts at 0 when a profile starts from idle. Updated at the PWM cycle (m a
 * multiple of pwm_samples) with the values of that moment; in between the last command stays. CURRENT
 * reference(t) = offset_A + sum tone_A sin(2 pi tone_Hz t + tone_rad) along the fixed axis angle_rad; a PI
 * regulator drives the projection of the measured current on that axis, every period_samples. DC         the
 * legs of plus_phases at +V/2, those of minus_phases at -V/2, the others open; V is level_V, or follows from
 * a PI regulator that holds the current out of the minus side at level_A, every period_samples. A segment of
 * the same kind, axis (CURRENT) or sides (DC) as the one before keeps its regulator's integral; otherwise it
 * starts at 0.
 */
#ifndef IMRIG_LINK_DEVICE_PROFILE_H
#define IMRIG_LINK_DEVICE_PROFILE_H

#include <stdint.h>

#include "rig/link/device/messages.h"
#include "rig/link/device/regulator.h"
#include "rig/link/device/result.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Used where a segment says NaN (gains) or 0 (period). */
#define IMRIG_DEFAULT_KP 1.6
#define IMRIG_DEFAULT_KI 116.0
#define IMRIG_DEFAULT_PERIOD 5

typedef struct imrig_profile {
  int32_t profile_id; /* 0: empty */
  int32_t n_segments;
  int32_t at_end;
  uint32_t have; /* bit k: segment k has arrived */
  int32_t committed;
  imrig_segment segments[IMRIG_MAX_SEGMENTS];
} imrig_profile;

typedef struct imrig_profile_limits {
  double voltage_V; /* peak phase voltage */
  double current_A; /* of references */
  double sample_s;
} imrig_profile_limits;

/* IMRIG_DONE, IMRIG_MALFORMED or IMRIG_OVER_LIMIT. Only the fields of the segment's own kind are looked at.
 */
int32_t imrig_segment_check(const imrig_segment* s, const imrig_profile_limits* limits);
/* The same for all segments; IMRIG_INCOMPLETE when one is missing. */
int32_t imrig_profile_check(const imrig_profile* p, const imrig_profile_limits* limits);

typedef struct imrig_command {
  double v_V[3]; /* legs a, b, c against the middle of the DC link; a common part is without effect */
  uint32_t legs; /* bit 0 a, bit 1 b, bit 2 c: that leg switches; 0: all gates off */
} imrig_command;

#define IMRIG_ALL_LEGS 7u

typedef struct imrig_drive {
  /* fixed */
  double sample_s;
  int32_t pwm_samples;
  double voltage_limit_V;
  /* running segment; NULL while ramping down or off */
  const imrig_segment* segment;
  int64_t n;          /* samples since the segment's start */
  int32_t beyond;     /* 1: the segment is over and held */
  double angle_start; /* turns at the segment's start, of the VOLTAGE vector */
  imrig_regulator regulator;
  /* ramp down */
  int64_t ramp_samples, ramp_n;
  double ramp_amplitude_V, ramp_frequency_Hz, ramp_angle;
  imrig_command ramp_from; /* of a segment that is no VOLTAGE */
  int32_t ramp_turns;      /* 1: a turning vector, 0: ramp_from */
  /* last command */
  imrig_command command;
} imrig_drive;

void imrig_drive_init(imrig_drive* d, double sample_s, int32_t pwm_samples);
/* All legs open at once; the angle is forgotten. */
void imrig_drive_off(imrig_drive* d);
/* The next command is the first of this segment. The segment must stay where it is until another is entered.
 */
void imrig_drive_enter(imrig_drive* d, const imrig_segment* s);
/* From the next command on the segment's end values go on: voltage vector turning, current reference and DC
 * level regulated. */
void imrig_drive_hold(imrig_drive* d);
/* From the next command on the voltage falls linearly to zero over so many samples, at the present frequency.
 */
void imrig_drive_ramp_down(imrig_drive* d, int64_t samples);
int imrig_drive_ramped(const imrig_drive* d); /* 1: the ramp has reached zero */
/* Command number m; i_A: the currents of sample m-1. */
const imrig_command* imrig_drive_step(imrig_drive* d, int64_t m, const double i_A[3]);

#ifdef __cplusplus
}
#endif
#endif
