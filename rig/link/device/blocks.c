#include "rig/link/device/blocks.h"

#include <stddef.h>

static int same_tag(const imrig_tag* a, const imrig_tag* b) {
  return a->profile_id == b->profile_id && a->segment == b->segment && a->record == b->record &&
         a->gates_on == b->gates_on;
}

static imrig_block* filling(imrig_blocks* b) { return &b->slots[b->filled % IMRIG_WAITING_BLOCKS]; }

static void close_block(imrig_blocks* b) {
  if (!b->open) return;
  b->open = 0;
  b->filled = b->filled + 1;
}

static void open_block(imrig_blocks* b, int64_t index, int64_t utime, const imrig_counts* counts) {
  imrig_block* block = filling(b);
  block->utime = utime;
  block->seq = b->next_seq++;
  block->block_v1 = 1;
  block->first_index = index;
  block->profile_id = b->tag.profile_id;
  block->segment = b->tag.segment;
  block->record = b->tag.record;
  block->gates_on = b->tag.gates_on;
  block->stator_C = counts->stator_C;
  block->n = 0;
  b->open = 1;
  b->dropped = 0;
}

static void drop_sample(imrig_blocks* b, int changed) {
  if (b->dropped == 0 || changed || b->dropped == IMRIG_BLOCK_SAMPLES) {
    ++b->next_seq;
    b->dropped = 0;
  }
  ++b->dropped;
}

static void store(imrig_block* block, const imrig_counts* counts) {
  const int32_t n = block->n++;
  block->i_a[n] = counts->i[0];
  block->i_b[n] = counts->i[1];
  block->i_c[n] = counts->i[2];
  block->v_a[n] = counts->v[0];
  block->v_b[n] = counts->v[1];
  block->v_c[n] = counts->v[2];
  block->encoder[n] = counts->encoder;
}

void imrig_blocks_init(imrig_blocks* b) {
  b->filled = b->sent = 0;
  b->open = 0;
  b->dropped = 0;
  b->next_seq = 0;
  b->tag.profile_id = b->tag.record = b->tag.gates_on = 0;
  b->tag.segment = -1;
}

void imrig_blocks_push(imrig_blocks* b, const imrig_tag* tag, int64_t index, int64_t utime,
                       const imrig_counts* counts) {
  const int changed = !same_tag(tag, &b->tag);
  if (changed) close_block(b);
  b->tag = *tag;
  if (!b->open) {
    if (b->filled - b->sent >= IMRIG_WAITING_BLOCKS) {
      drop_sample(b, changed);
      return;
    }
    open_block(b, index, utime, counts);
  }
  store(filling(b), counts);
  if (filling(b)->n == IMRIG_BLOCK_SAMPLES) close_block(b);
}

const imrig_block* imrig_blocks_first(const imrig_blocks* b) {
  return b->filled == b->sent ? NULL : &b->slots[b->sent % IMRIG_WAITING_BLOCKS];
}

void imrig_blocks_pop(imrig_blocks* b) { b->sent = b->sent + 1; }

void imrig_blocks_clear(imrig_blocks* b) {
  b->open = 0;
  b->sent = b->filled;
}
