/* What goes to the host, most urgent first: welcome, replies, whole blocks, status. So a status comes behind
 * every block that was closed before it. */
#include <math.h>
#include <string.h>

#include "rig/link/device/device_internal.h"

static int64_t device_us(const imrig_device* d) { return d->next_index * d->config.sample_time_ns / 1000; }

static size_t put_welcome(imrig_device* d) {
  imrig_welcome m;
  imrig_lock(d);
  d->welcome_pending = 0;
  m.utime = device_us(d);
  m.seq = d->frame_seq++;
  m.welcome_v1 = 1;
  m.host_nonce = d->host.host_nonce;
  m.boot_id = d->config.boot_id;
  m.next_index = d->next_index;
  m.next_block = d->blocks.next_seq;
  m.sample_time_ns = d->config.sample_time_ns;
  m.pwm_time_ns = d->config.sample_time_ns * d->config.pwm_samples;
  m.current_A_per_count = d->config.current_A_per_count;
  m.voltage_V_per_count = d->config.voltage_V_per_count;
  m.voltage_filter_s = d->config.voltage_filter_s;
  m.full_scale_counts = d->config.full_scale_counts;
  m.encoder_counts_per_rev = d->config.encoder_counts_per_rev;
  m.max_segments = IMRIG_MAX_SEGMENTS;
  m.waits_for_credit = d->config.waits_for_credit;
  imrig_unlock(d);
  return imrig_encode_welcome(&m, d->payload, IMRIG_PAYLOAD_MAX);
}

static size_t put_reply(imrig_device* d) {
  imrig_reply m;
  imrig_lock(d);
  m.utime = device_us(d);
  m.seq = d->frame_seq++;
  m.reply_v1 = 1;
  m.of_seq = d->replies[0].of_seq;
  m.result = d->replies[0].result;
  --d->n_replies;
  memmove(&d->replies[0], &d->replies[1], d->n_replies * sizeof d->replies[0]);
  imrig_unlock(d);
  return imrig_encode_reply(&m, d->payload, IMRIG_PAYLOAD_MAX);
}

static size_t put_block(imrig_device* d, const imrig_block* block) {
  const size_t n = imrig_encode_block(block, d->payload, IMRIG_PAYLOAD_MAX);
  imrig_blocks_pop(&d->blocks);
  return n;
}

static size_t put_status(imrig_device* d) {
  imrig_status m;
  const imrig_profile* spare;
  imrig_lock(d);
  spare = imrig_spare_bank(d);
  d->status_pending = 0;
  d->last_status_index = d->next_index;
  d->last_status_ms = d->now_ms;
  m.utime = device_us(d);
  m.seq = d->frame_seq++;
  m.device_status_v1 = 1;
  m.boot_id = d->config.boot_id;
  m.next_index = d->next_index;
  m.state = d->state;
  m.trip = d->trip;
  m.profile_id = d->banks[d->active].profile_id;
  m.profile_loaded = spare->committed ? spare->profile_id : 0;
  m.segment = d->segment;
  m.bad_frames = d->bad_frames;
  m.current_peak_A = (float)d->current_peak_A;
  d->current_peak_A = 0.0;
  m.speed_rpm = d->speed_rpm;
  m.stator_C = d->stator_C;
  imrig_unlock(d);
  return imrig_encode_status(&m, d->payload, IMRIG_PAYLOAD_MAX);
}

int imrig_device_has_output(const imrig_device* d) {
  return d->welcomed &&
         (d->welcome_pending || d->n_replies > 0 || d->blocks.filled != d->blocks.sent || d->status_pending);
}

size_t imrig_device_take(imrig_device* d, uint8_t* out, size_t capacity) {
  const imrig_block* block = imrig_blocks_first(&d->blocks);
  size_t n;
  if (!d->welcomed || capacity < IMRIG_FRAME_MAX) return 0;
  if (d->welcome_pending)
    n = put_welcome(d);
  else if (d->n_replies > 0)
    n = put_reply(d);
  else if (block != NULL)
    n = put_block(d, block);
  else if (d->status_pending)
    n = put_status(d);
  else
    return 0;
  return imrig_frame_write(d->payload, n, out, capacity);
}
