/* The device's side of the DSP link as one state machine: bytes in, bytes out, one call per sample. C99, no
 * allocation, no I/O, no clock; about 40 kB. docs/dsp-link.md tells the exchange and what a firmware has to
 * supply.
 *
 *   sampling interrupt: command = imrig_device_sample(&device, &counts);   apply it from the next sample on
 *   background loop:    imrig_device_feed(&device, received, n, now_ms);
 *                       imrig_device_tick(&device, now_ms);
 *                       while ((n = imrig_device_take(&device, frame, sizeof frame)) != 0) send(frame, n);
 *                       if (imrig_device_must_be_off(&device)) open all gates now
 *
 * The command returned for sample k is command number k+1: it acts over [t_k+1, t_k+2), t_k being the instant
 * of sample k. States: IDLE -start-> RUNNING -profile over-> HOLDING or IDLE;  RUNNING, HOLDING -stop->
 * STOPPING -ramp over-> IDLE;  any -trip-> TRIPPED -clear-> IDLE. HOLDING -start-> RUNNING without opening
 * the gates. */
#ifndef IMRIG_LINK_DEVICE_IMRIG_DEVICE_H
#define IMRIG_LINK_DEVICE_IMRIG_DEVICE_H

#include <stddef.h>
#include <stdint.h>

#include "rig/link/device/blocks.h"
#include "rig/link/device/codec.h"
#include "rig/link/device/frame.h"
#include "rig/link/device/profile.h"
#include "rig/link/device/result.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Longest frame a host sends (segment_t, 340 bytes of payload), and some. */
#define IMRIG_RECEIVE_MAX 512
/* Requests whose answers are remembered; older ones are not acted on again. */
#define IMRIG_REMEMBERED 64
#define IMRIG_WAITING_REPLIES 16

typedef struct imrig_device_config {
  int64_t boot_id;           /* random per boot, positive */
  int64_t sample_time_ns;    /* 60000 */
  int32_t pwm_samples;       /* samples per PWM cycle: 4 */
  float current_A_per_count; /* nominal scales; zero is not removed */
  float voltage_V_per_count;
  float voltage_filter_s;
  int32_t full_scale_counts;
  int32_t encoder_counts_per_rev;
  int32_t waits_for_credit;
  /* Mask and unmask the sampling interrupt around what sample() shares with the background loop; NULL where
   * both run in one thread. */
  void (*lock)(void);
  void (*unlock)(void);
} imrig_device_config;

typedef struct imrig_device {
  imrig_device_config config;
  double sample_s;
  /* session */
  int32_t welcomed; /* a host has said hello since boot */
  imrig_hello host; /* its last hello: nonce and limits */
  int64_t heard_ms; /* when the host's last valid frame came */
  int64_t until_index;
  int64_t bad_frames;
  int64_t frame_seq;
  /* receiving */
  uint8_t received[IMRIG_RECEIVE_MAX];
  size_t n_received;
  int32_t overlong;
  /* requests */
  struct {
    int64_t seq;
    int32_t result;
  } remembered[IMRIG_REMEMBERED];
  int64_t highest_request, highest_order;
  struct {
    int64_t of_seq;
    int32_t result;
  } replies[IMRIG_WAITING_REPLIES];
  uint32_t n_replies;
  /* profiles: banks[active] runs or holds, the other is being uploaded or waits to start */
  imrig_profile banks[2];
  int32_t active;
  int32_t start_pending; /* start at the next PWM cycle */
  imrig_drive drive;
  int32_t state, trip, segment;
  int64_t segment_left; /* samples, of the running segment */
  /* samples */
  int64_t next_index;
  imrig_tag tag; /* of sample next_index */
  imrig_blocks blocks;
  int32_t encoder_mark;
  int64_t encoder_mark_index; /* -1 before the first sample */
  float speed_rpm, stator_C;
  double current_peak_A;
  /* status */
  int32_t welcome_pending, status_pending;
  int64_t last_status_index, last_status_ms, now_ms;
  uint8_t payload[IMRIG_PAYLOAD_MAX + IMRIG_CRC_BYTES];
} imrig_device;

void imrig_device_init(imrig_device* d, const imrig_device_config* config);

/* Bytes from the wire in pieces of any size; now_ms: any clock that only rises. */
void imrig_device_feed(imrig_device* d, const uint8_t* bytes, size_t n, int64_t now_ms);
/* Watchdog and keepalive status: call it at least every 10 ms, after everything received has been fed. */
void imrig_device_tick(imrig_device* d, int64_t now_ms);
/* Writes the next frame (capacity at least IMRIG_FRAME_MAX) and returns its size; 0 when there is nothing to
 * send. */
size_t imrig_device_take(imrig_device* d, uint8_t* out, size_t capacity);
int imrig_device_has_output(const imrig_device* d);

/* One sample; returns the command that acts from the next sample on. */
imrig_command imrig_device_sample(imrig_device* d, const imrig_counts* counts);
/* 1 while tripped: the gates must be open now, whatever command was returned before. */
int imrig_device_must_be_off(const imrig_device* d);
/* 1 when a host is there and, if the device waits for credit, has granted the next sample. */
int imrig_device_may_sample(const imrig_device* d);

#ifdef __cplusplus
}
#endif
#endif
