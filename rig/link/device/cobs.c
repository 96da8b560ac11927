#include "rig/link/device/cobs.h"

size_t imrig_cobs_encode(const uint8_t* in, size_t n, uint8_t* out, size_t capacity) {
  size_t lead = 0; /* where the running group's length goes */
  size_t to = 1;
  size_t from;
  uint8_t length = 1;
  if (capacity < IMRIG_COBS_MAX(n)) return 0;
  for (from = 0; from < n; ++from) {
    if (in[from] != 0) {
      out[to++] = in[from];
      ++length;
    }
    /* A full group that ends the input needs no group behind it. */
    if (in[from] == 0 || (length == 0xFF && from + 1 < n)) {
      out[lead] = length;
      lead = to++;
      length = 1;
    }
  }
  out[lead] = length;
  return to;
}

size_t imrig_cobs_decode(const uint8_t* in, size_t n, uint8_t* out, size_t capacity) {
  size_t from = 0;
  size_t to = 0;
  while (from < n) {
    const size_t length = in[from++];
    size_t k;
    if (length == 0 || length - 1 > n - from || length - 1 > capacity - to) return 0;
    for (k = 1; k < length; ++k) {
      if (in[from] == 0) return 0;
      out[to++] = in[from++];
    }
    if (length != 0xFF && from < n) {
      if (to >= capacity) return 0;
      out[to++] = 0;
    }
  }
  return to;
}
