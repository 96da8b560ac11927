/* Samples gathered into blocks: a block ends after 256 samples, or where segment, record, profile or gates
 * change. A few blocks wait here to be sent; when all are taken the samples are dropped, and the block
 * numbers jump so that the host sees the loss. One side fills (imrig_blocks_push), one side drains (first,
 * pop); on one core the two may interrupt each other. */
#ifndef IMRIG_LINK_DEVICE_BLOCKS_H
#define IMRIG_LINK_DEVICE_BLOCKS_H

#include <stdint.h>

#include "rig/link/device/messages.h"

#ifdef __cplusplus
extern "C" {
#endif

#define IMRIG_WAITING_BLOCKS 4

/* Raw counts as the converters and the encoder counter give them: zero in the middle of the range, encoder
 * wrapping modulo 2^32. */
typedef struct imrig_counts {
  int16_t i[3];
  int16_t v[3];
  int32_t encoder;
  float stator_C; /* NaN without a sensor */
} imrig_counts;

/* What a sample belongs to; all samples of a block have the same. */
typedef struct imrig_tag {
  int32_t profile_id, segment, record, gates_on;
} imrig_tag;

typedef struct imrig_blocks {
  imrig_block slots[IMRIG_WAITING_BLOCKS];
  volatile uint32_t filled, sent; /* blocks closed and drained so far; slot = number % IMRIG_WAITING_BLOCKS */
  int32_t open;                   /* 1: slots[filled] is being filled */
  int32_t dropped;                /* samples dropped since the block number last jumped */
  imrig_tag tag;
  int64_t next_seq;
} imrig_blocks;

void imrig_blocks_init(imrig_blocks* b);
void imrig_blocks_push(imrig_blocks* b, const imrig_tag* tag, int64_t index, int64_t utime,
                       const imrig_counts* counts);
/* Oldest closed block, NULL when there is none. It stays valid until popped. */
const imrig_block* imrig_blocks_first(const imrig_blocks* b);
void imrig_blocks_pop(imrig_blocks* b);
/* Throws away what waits, without a jump in the numbers: a new host starts with the next sample. */
void imrig_blocks_clear(imrig_blocks* b);

#ifdef __cplusplus
}
#endif
#endif
