/* What comes from the host: frames, hello, credits, requests. */
#include <math.h>
#include <string.h>

#include "rig/link/device/device_internal.h"

#define KEEPALIVE_STATUS_MS 100
#define MAX_RAMP_S 60.0

static int limit_ok(double x) { return x > 0.0 && x <= 1e9; }

static int hello_ok(const imrig_hello* m) {
  return m->watchdog_ms >= 20 && m->watchdog_ms <= 2000 && limit_ok(m->current_limit_A) &&
         limit_ok(m->speed_limit_rpm) && limit_ok(m->stator_limit_C) && limit_ok(m->voltage_limit_V);
}

/* A new host starts with nothing asked, nothing remembered, no credit, and the next sample. */
static void new_session(imrig_device* d) {
  memset(d->remembered, 0, sizeof d->remembered);
  d->highest_request = d->highest_order = 0;
  d->n_replies = 0;
  d->until_index = d->next_index;
  imrig_blocks_clear(&d->blocks);
}

static int host_is_alive(const imrig_device* d) {
  return d->welcomed && d->now_ms - d->heard_ms <= d->host.watchdog_ms;
}

/* A host that is heard keeps the device; another one is welcome once it has fallen silent. */
static int handle_hello(imrig_device* d, const imrig_hello* m) {
  const int known = d->welcomed && m->host_nonce == d->host.host_nonce;
  if (!hello_ok(m)) return 0;
  if (!known && host_is_alive(d)) return 1;
  if (!known) new_session(d);
  d->host = *m;
  d->welcomed = 1;
  d->heard_ms = d->now_ms;
  d->drive.voltage_limit_V = m->voltage_limit_V;
  d->welcome_pending = 1;
  imrig_changed(d);
  return 1;
}

static void drop_loaded(imrig_profile* p, int32_t profile_id) {
  p->profile_id = profile_id;
  p->have = 0;
  p->committed = 0;
}

static int32_t do_segment(imrig_device* d, const imrig_segment* m) {
  imrig_profile* p = imrig_spare_bank(d);
  const imrig_profile_limits limits = imrig_limits_of(d);
  int32_t result;
  if (d->state == IMRIG_TRIPPED) return IMRIG_IS_TRIPPED;
  if (d->start_pending) return IMRIG_BUSY;
  if (m->profile_id < 1 || m->position < 0 || m->position >= IMRIG_MAX_SEGMENTS) return IMRIG_MALFORMED;
  if (p->profile_id != m->profile_id || p->committed) {
    if (p->committed) imrig_changed(d);
    drop_loaded(p, m->profile_id);
  }
  result = imrig_segment_check(m, &limits);
  if (result != IMRIG_DONE) return result;
  p->segments[m->position] = *m;
  p->have |= 1u << m->position;
  return IMRIG_DONE;
}

static int32_t do_commit(imrig_device* d, const imrig_commit* m) {
  imrig_profile* p = imrig_spare_bank(d);
  const imrig_profile_limits limits = imrig_limits_of(d);
  int32_t result;
  if (d->state == IMRIG_TRIPPED) return IMRIG_IS_TRIPPED;
  if (d->start_pending) return IMRIG_BUSY;
  if (m->profile_id < 1 || p->profile_id != m->profile_id) return IMRIG_INCOMPLETE;
  p->n_segments = m->n_segments;
  p->at_end = m->at_end;
  result = imrig_profile_check(p, &limits);
  p->committed = result == IMRIG_DONE;
  imrig_changed(d);
  return result;
}

static int32_t do_start(imrig_device* d, const imrig_order* m) {
  const imrig_profile* p = imrig_spare_bank(d);
  const imrig_profile_limits limits = imrig_limits_of(d);
  int32_t result;
  if (d->state == IMRIG_TRIPPED) return IMRIG_IS_TRIPPED;
  if (d->state == IMRIG_RUNNING || d->state == IMRIG_STOPPING || d->start_pending) return IMRIG_BUSY;
  if (!p->committed || p->profile_id != m->profile_id) return IMRIG_NO_PROFILE;
  /* A later hello may have lowered the limits. */
  result = imrig_profile_check(p, &limits);
  if (result == IMRIG_DONE) d->start_pending = 1;
  return result;
}

static int32_t do_stop(imrig_device* d, const imrig_order* m) {
  if (d->state == IMRIG_TRIPPED) return IMRIG_IS_TRIPPED;
  if (!(m->ramp_s >= 0.0 && m->ramp_s <= MAX_RAMP_S)) return IMRIG_MALFORMED;
  d->start_pending = 0;
  if (d->state != IMRIG_IDLE) imrig_enter_stop(d, m->ramp_s);
  return IMRIG_DONE;
}

static int32_t do_clear(imrig_device* d) {
  if (d->state == IMRIG_TRIPPED) {
    d->trip = IMRIG_TRIP_NONE;
    imrig_enter_idle(d);
  }
  return IMRIG_DONE;
}

static int32_t do_order(imrig_device* d, const imrig_order* m) {
  if (m->seq < d->highest_order) return IMRIG_OVERTAKEN;
  d->highest_order = m->seq;
  switch (m->action) {
    case IMRIG_START:
      return do_start(d, m);
    case IMRIG_STOP:
      return do_stop(d, m);
    case IMRIG_TRIP:
      imrig_enter_trip(d, IMRIG_TRIP_ORDERED);
      return IMRIG_DONE;
    case IMRIG_CLEAR:
      return do_clear(d);
    default:
      return IMRIG_MALFORMED;
  }
}

static void queue_reply(imrig_device* d, int64_t of_seq, int32_t result) {
  if (d->n_replies == IMRIG_WAITING_REPLIES) return; /* the host asks again */
  d->replies[d->n_replies].of_seq = of_seq;
  d->replies[d->n_replies].result = result;
  ++d->n_replies;
}

/* 1: the request is new and shall be carried out. Otherwise it was answered again, or is too old to be known.
 */
static int is_new(imrig_device* d, int64_t seq) {
  int k;
  if (seq < 1 || seq <= d->highest_request - IMRIG_REMEMBERED) return 0;
  for (k = 0; k < IMRIG_REMEMBERED; ++k) {
    if (d->remembered[k].seq == seq) {
      queue_reply(d, seq, d->remembered[k].result);
      return 0;
    }
  }
  return 1;
}

static void answer(imrig_device* d, int64_t seq, int32_t result) {
  const size_t slot = (size_t)(seq % IMRIG_REMEMBERED);
  d->remembered[slot].seq = seq;
  d->remembered[slot].result = result;
  if (seq > d->highest_request) d->highest_request = seq;
  queue_reply(d, seq, result);
}

static int handle_segment(imrig_device* d, const uint8_t* payload, size_t n) {
  imrig_segment m;
  if (!imrig_decode_segment(payload, n, &m)) return 0;
  if (is_new(d, m.seq)) answer(d, m.seq, do_segment(d, &m));
  return 1;
}

static int handle_commit(imrig_device* d, const uint8_t* payload, size_t n) {
  imrig_commit m;
  if (!imrig_decode_commit(payload, n, &m)) return 0;
  if (is_new(d, m.seq)) answer(d, m.seq, do_commit(d, &m));
  return 1;
}

static int handle_order(imrig_device* d, const uint8_t* payload, size_t n) {
  imrig_order m;
  if (!imrig_decode_order(payload, n, &m)) return 0;
  if (is_new(d, m.seq)) answer(d, m.seq, do_order(d, &m));
  return 1;
}

static int handle_credit(imrig_device* d, const uint8_t* payload, size_t n) {
  imrig_credit m;
  if (!imrig_decode_credit(payload, n, &m)) return 0;
  if (m.until_index > d->until_index) d->until_index = m.until_index;
  return 1;
}

int imrig_handle_payload(imrig_device* d, const uint8_t* payload, size_t n) {
  const enum imrig_type type = imrig_type_of(payload, n);
  int understood = 0;
  if (type == IMRIG_TYPE_HELLO) {
    imrig_hello m;
    return imrig_decode_hello(payload, n, &m) && handle_hello(d, &m);
  }
  /* Who has not said hello is not listened to; it would not know what it is talking to. */
  if (!d->welcomed) return 1;
  if (type == IMRIG_TYPE_SEGMENT) understood = handle_segment(d, payload, n);
  if (type == IMRIG_TYPE_COMMIT) understood = handle_commit(d, payload, n);
  if (type == IMRIG_TYPE_ORDER) understood = handle_order(d, payload, n);
  if (type == IMRIG_TYPE_CREDIT) understood = handle_credit(d, payload, n);
  if (understood) d->heard_ms = d->now_ms;
  return understood;
}

static void end_frame(imrig_device* d) {
  const size_t n = d->n_received;
  size_t size;
  d->n_received = 0;
  if (d->overlong) {
    d->overlong = 0;
    ++d->bad_frames;
    return;
  }
  if (n == 0) return; /* zeros between frames are allowed */
  size = imrig_frame_open(d->received, n);
  if (size == 0) {
    ++d->bad_frames;
    return;
  }
  imrig_lock(d);
  if (!imrig_handle_payload(d, d->received, size)) ++d->bad_frames;
  imrig_unlock(d);
}

void imrig_device_feed(imrig_device* d, const uint8_t* bytes, size_t n, int64_t now_ms) {
  size_t k;
  if (now_ms > d->now_ms) d->now_ms = now_ms;
  for (k = 0; k < n; ++k) {
    if (bytes[k] == 0) {
      end_frame(d);
    } else if (d->n_received == sizeof d->received) {
      d->overlong = 1;
    } else {
      d->received[d->n_received++] = bytes[k];
    }
  }
}

void imrig_device_tick(imrig_device* d, int64_t now_ms) {
  imrig_lock(d);
  if (now_ms > d->now_ms) d->now_ms = now_ms;
  if (imrig_is_driving(d) && !host_is_alive(d)) imrig_enter_trip(d, IMRIG_TRIP_WATCHDOG);
  if (d->welcomed && d->now_ms - d->last_status_ms >= KEEPALIVE_STATUS_MS) d->status_pending = 1;
  imrig_unlock(d);
}
