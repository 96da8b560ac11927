#include "rig/link/device/codec.h"

#include <string.h>

/* One walk over a struct's fields serves both directions, so that they cannot differ. */
typedef struct cursor {
  uint8_t* out; /* writing: where to; NULL when reading */
  const uint8_t* in;
  size_t left;
  int ok;
} cursor;

static int take(cursor* c, size_t n) {
  if (!c->ok || c->left < n) {
    c->ok = 0;
    return 0;
  }
  c->left -= n;
  return 1;
}

static void put(cursor* c, uint64_t bits, unsigned bytes) {
  unsigned k;
  for (k = bytes; k > 0; --k) *c->out++ = (uint8_t)(bits >> (8u * (k - 1u)));
}

static uint64_t get(cursor* c, unsigned bytes) {
  uint64_t bits = 0;
  unsigned k;
  for (k = 0; k < bytes; ++k) bits = (bits << 8) | *c->in++;
  return bits;
}

static void word64(cursor* c, uint64_t* bits) {
  if (!take(c, 8)) return;
  if (c->out != NULL)
    put(c, *bits, 8);
  else
    *bits = get(c, 8);
}

static void word32(cursor* c, uint32_t* bits) {
  if (!take(c, 4)) return;
  if (c->out != NULL)
    put(c, *bits, 4);
  else
    *bits = (uint32_t)get(c, 4);
}

static void i64(cursor* c, int64_t* value) {
  uint64_t bits;
  memcpy(&bits, value, sizeof bits);
  word64(c, &bits);
  memcpy(value, &bits, sizeof bits);
}

static void i32(cursor* c, int32_t* value) {
  uint32_t bits;
  memcpy(&bits, value, sizeof bits);
  word32(c, &bits);
  memcpy(value, &bits, sizeof bits);
}

static void f64(cursor* c, double* value) {
  uint64_t bits;
  memcpy(&bits, value, sizeof bits);
  word64(c, &bits);
  memcpy(value, &bits, sizeof bits);
}

static void f32(cursor* c, float* value) {
  uint32_t bits;
  memcpy(&bits, value, sizeof bits);
  word32(c, &bits);
  memcpy(value, &bits, sizeof bits);
}

static void f64s(cursor* c, double* values, int n) {
  int k;
  for (k = 0; k < n; ++k) f64(c, &values[k]);
}

static void i16s(cursor* c, int16_t* values, size_t n) {
  size_t k;
  if (!take(c, 2 * n)) return;
  for (k = 0; k < n; ++k) {
    uint16_t bits;
    if (c->out != NULL) {
      memcpy(&bits, &values[k], sizeof bits);
      *c->out++ = (uint8_t)(bits >> 8);
      *c->out++ = (uint8_t)(bits & 0xFFu);
    } else {
      bits = (uint16_t)(((unsigned)c->in[0] << 8) | c->in[1]);
      c->in += 2;
      memcpy(&values[k], &bits, sizeof bits);
    }
  }
}

static void i32s(cursor* c, int32_t* values, size_t n) {
  size_t k;
  for (k = 0; k < n; ++k) i32(c, &values[k]);
}

static void walk_hello(cursor* c, imrig_hello* m) {
  i64(c, &m->utime);
  i64(c, &m->seq);
  i32(c, &m->hello_v1);
  i64(c, &m->host_nonce);
  i32(c, &m->watchdog_ms);
  f64(c, &m->current_limit_A);
  f64(c, &m->speed_limit_rpm);
  f64(c, &m->stator_limit_C);
  f64(c, &m->voltage_limit_V);
}

static void walk_welcome(cursor* c, imrig_welcome* m) {
  i64(c, &m->utime);
  i64(c, &m->seq);
  i32(c, &m->welcome_v1);
  i64(c, &m->host_nonce);
  i64(c, &m->boot_id);
  i64(c, &m->next_index);
  i64(c, &m->next_block);
  i64(c, &m->sample_time_ns);
  i64(c, &m->pwm_time_ns);
  f32(c, &m->current_A_per_count);
  f32(c, &m->voltage_V_per_count);
  f32(c, &m->voltage_filter_s);
  i32(c, &m->full_scale_counts);
  i32(c, &m->encoder_counts_per_rev);
  i32(c, &m->max_segments);
  i32(c, &m->waits_for_credit);
}

static void walk_segment(cursor* c, imrig_segment* m) {
  i64(c, &m->utime);
  i64(c, &m->seq);
  i32(c, &m->segment_v1);
  i32(c, &m->profile_id);
  i32(c, &m->position);
  i32(c, &m->kind);
  i32(c, &m->record);
  i64(c, &m->duration_samples);
  f64(c, &m->amplitude_start_V);
  f64(c, &m->amplitude_end_V);
  f64(c, &m->frequency_start_Hz);
  f64(c, &m->frequency_end_Hz);
  f64(c, &m->angle_rad);
  f64(c, &m->offset_A);
  i32(c, &m->n_tones);
  f64s(c, m->tone_A, IMRIG_TONES);
  f64s(c, m->tone_Hz, IMRIG_TONES);
  f64s(c, m->tone_rad, IMRIG_TONES);
  f64(c, &m->kp_V_per_A);
  f64(c, &m->ki_V_per_As);
  i32(c, &m->period_samples);
  i32(c, &m->plus_phases);
  i32(c, &m->minus_phases);
  f64(c, &m->level_A);
  f64(c, &m->level_V);
}

static void walk_commit(cursor* c, imrig_commit* m) {
  i64(c, &m->utime);
  i64(c, &m->seq);
  i32(c, &m->commit_v1);
  i32(c, &m->profile_id);
  i32(c, &m->n_segments);
  i32(c, &m->at_end);
}

static void walk_order(cursor* c, imrig_order* m) {
  i64(c, &m->utime);
  i64(c, &m->seq);
  i32(c, &m->order_v1);
  i32(c, &m->action);
  i32(c, &m->profile_id);
  f64(c, &m->ramp_s);
}

static void walk_credit(cursor* c, imrig_credit* m) {
  i64(c, &m->utime);
  i64(c, &m->seq);
  i32(c, &m->credit_v1);
  i64(c, &m->until_index);
}

static void walk_reply(cursor* c, imrig_reply* m) {
  i64(c, &m->utime);
  i64(c, &m->seq);
  i32(c, &m->reply_v1);
  i64(c, &m->of_seq);
  i32(c, &m->result);
}

static void walk_block(cursor* c, imrig_block* m) {
  size_t n;
  i64(c, &m->utime);
  i64(c, &m->seq);
  i32(c, &m->block_v1);
  i64(c, &m->first_index);
  i32(c, &m->profile_id);
  i32(c, &m->segment);
  i32(c, &m->record);
  i32(c, &m->gates_on);
  f32(c, &m->stator_C);
  i32(c, &m->n);
  if (!c->ok || m->n < 1 || m->n > IMRIG_BLOCK_SAMPLES) {
    c->ok = 0;
    return;
  }
  n = (size_t)m->n;
  i16s(c, m->i_a, n);
  i16s(c, m->i_b, n);
  i16s(c, m->i_c, n);
  i16s(c, m->v_a, n);
  i16s(c, m->v_b, n);
  i16s(c, m->v_c, n);
  i32s(c, m->encoder, n);
}

static void walk_status(cursor* c, imrig_status* m) {
  i64(c, &m->utime);
  i64(c, &m->seq);
  i32(c, &m->device_status_v1);
  i64(c, &m->boot_id);
  i64(c, &m->next_index);
  i32(c, &m->state);
  i32(c, &m->trip);
  i32(c, &m->profile_id);
  i32(c, &m->profile_loaded);
  i32(c, &m->segment);
  i64(c, &m->bad_frames);
  f32(c, &m->current_peak_A);
  f32(c, &m->speed_rpm);
  f32(c, &m->stator_C);
}

static const uint64_t kFingerprints[] = {
    0,
    0xeadad4a27411304dull, /* hello_t */
    0xe6c5a5486fcf94e2ull, /* welcome_t */
    0x86941ba1d3206fa4ull, /* segment_t */
    0x5f7b7a6caee40ea1ull, /* commit_t */
    0x3394cf6eb214c7bcull, /* order_t */
    0x69ad4f2fc0558315ull, /* credit_t */
    0xfe927baee5e9722full, /* reply_t */
    0x6596cb19808f451bull, /* block_t */
    0x39d44e608884508dull  /* device_status_t */
};

uint64_t imrig_fingerprint(enum imrig_type type) { return kFingerprints[type]; }

enum imrig_type imrig_type_of(const uint8_t* data, size_t n) {
  cursor c;
  uint64_t fingerprint;
  int type;
  if (n < 8) return IMRIG_TYPE_NONE;
  c.in = data;
  fingerprint = get(&c, 8);
  for (type = IMRIG_TYPE_HELLO; type <= IMRIG_TYPE_STATUS; ++type) {
    if (fingerprint == kFingerprints[type]) return (enum imrig_type)type;
  }
  return IMRIG_TYPE_NONE;
}

static cursor writer(enum imrig_type type, uint8_t* out, size_t capacity) {
  uint64_t fingerprint = kFingerprints[type];
  cursor c;
  c.out = out;
  c.in = NULL;
  c.left = capacity;
  c.ok = 1;
  word64(&c, &fingerprint);
  return c;
}

static cursor reader(enum imrig_type type, const uint8_t* data, size_t n) {
  uint64_t fingerprint = 0;
  cursor c;
  c.out = NULL;
  c.in = data;
  c.left = n;
  c.ok = 1;
  word64(&c, &fingerprint);
  if (fingerprint != kFingerprints[type]) c.ok = 0;
  return c;
}

/* The walk only reads *m while writing out; the cast takes nothing that was const away for good. */
#define IMRIG_CODEC(name, TYPE)                                                      \
  size_t imrig_encode_##name(const imrig_##name* m, uint8_t* out, size_t capacity) { \
    cursor c = writer(TYPE, out, capacity);                                          \
    walk_##name(&c, (imrig_##name*)m);                                               \
    return c.ok ? capacity - c.left : 0;                                             \
  }                                                                                  \
  int imrig_decode_##name(const uint8_t* data, size_t n, imrig_##name* m) {          \
    cursor c = reader(TYPE, data, n);                                                \
    memset(m, 0, sizeof *m);                                                         \
    walk_##name(&c, m);                                                              \
    return c.ok && c.left == 0;                                                      \
  }

IMRIG_CODEC(hello, IMRIG_TYPE_HELLO)
IMRIG_CODEC(welcome, IMRIG_TYPE_WELCOME)
IMRIG_CODEC(segment, IMRIG_TYPE_SEGMENT)
IMRIG_CODEC(commit, IMRIG_TYPE_COMMIT)
IMRIG_CODEC(order, IMRIG_TYPE_ORDER)
IMRIG_CODEC(credit, IMRIG_TYPE_CREDIT)
IMRIG_CODEC(reply, IMRIG_TYPE_REPLY)
IMRIG_CODEC(block, IMRIG_TYPE_BLOCK)
IMRIG_CODEC(status, IMRIG_TYPE_STATUS)
