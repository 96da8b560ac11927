/* The DSP link's messages as C structs, field by field as in lcmtypes/link/NAME.lcm, where units, signs and
 * origins stand. */
#ifndef IMRIG_LINK_DEVICE_MESSAGES_H
#define IMRIG_LINK_DEVICE_MESSAGES_H

#include <stdint.h>

#define IMRIG_BLOCK_SAMPLES 256
#define IMRIG_TONES 8
#define IMRIG_MAX_SEGMENTS 24

enum imrig_kind { IMRIG_GATES_OFF = 0, IMRIG_VOLTAGE = 1, IMRIG_CURRENT = 2, IMRIG_DC = 3 };
enum imrig_at_end { IMRIG_AT_END_GATES_OFF = 0, IMRIG_AT_END_HOLD = 1 };
enum imrig_action { IMRIG_START = 1, IMRIG_STOP = 2, IMRIG_TRIP = 3, IMRIG_CLEAR = 4 };
enum imrig_state {
  IMRIG_IDLE = 0,
  IMRIG_RUNNING = 1,
  IMRIG_HOLDING = 2,
  IMRIG_STOPPING = 3,
  IMRIG_TRIPPED = 4
};

typedef struct imrig_hello {
  int64_t utime, seq;
  int32_t hello_v1;
  int64_t host_nonce;
  int32_t watchdog_ms;
  double current_limit_A, speed_limit_rpm, stator_limit_C, voltage_limit_V;
} imrig_hello;

typedef struct imrig_welcome {
  int64_t utime, seq;
  int32_t welcome_v1;
  int64_t host_nonce, boot_id, next_index, next_block, sample_time_ns, pwm_time_ns;
  float current_A_per_count, voltage_V_per_count, voltage_filter_s;
  int32_t full_scale_counts, encoder_counts_per_rev, max_segments, waits_for_credit;
} imrig_welcome;

typedef struct imrig_segment {
  int64_t utime, seq;
  int32_t segment_v1;
  int32_t profile_id, position, kind, record;
  int64_t duration_samples;
  double amplitude_start_V, amplitude_end_V, frequency_start_Hz, frequency_end_Hz;
  double angle_rad, offset_A;
  int32_t n_tones;
  double tone_A[IMRIG_TONES], tone_Hz[IMRIG_TONES], tone_rad[IMRIG_TONES];
  double kp_V_per_A, ki_V_per_As;
  int32_t period_samples, plus_phases, minus_phases;
  double level_A, level_V;
} imrig_segment;

typedef struct imrig_commit {
  int64_t utime, seq;
  int32_t commit_v1;
  int32_t profile_id, n_segments, at_end;
} imrig_commit;

typedef struct imrig_order {
  int64_t utime, seq;
  int32_t order_v1;
  int32_t action, profile_id;
  double ramp_s;
} imrig_order;

typedef struct imrig_credit {
  int64_t utime, seq;
  int32_t credit_v1;
  int64_t until_index;
} imrig_credit;

typedef struct imrig_reply {
  int64_t utime, seq;
  int32_t reply_v1;
  int64_t of_seq;
  int32_t result;
} imrig_reply;

typedef struct imrig_block {
  int64_t utime, seq;
  int32_t block_v1;
  int64_t first_index;
  int32_t profile_id, segment, record, gates_on;
  float stator_C;
  int32_t n;
  int16_t i_a[IMRIG_BLOCK_SAMPLES], i_b[IMRIG_BLOCK_SAMPLES], i_c[IMRIG_BLOCK_SAMPLES];
  int16_t v_a[IMRIG_BLOCK_SAMPLES], v_b[IMRIG_BLOCK_SAMPLES], v_c[IMRIG_BLOCK_SAMPLES];
  int32_t encoder[IMRIG_BLOCK_SAMPLES];
} imrig_block;

typedef struct imrig_status {
  int64_t utime, seq;
  int32_t device_status_v1;
  int64_t boot_id, next_index;
  int32_t state, trip, profile_id, profile_loaded, segment;
  int64_t bad_frames;
  float current_peak_A, speed_rpm, stator_C;
} imrig_status;

#endif
