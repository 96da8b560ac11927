#include "rig/link/device/frame.h"

#include "rig/link/device/crc32.h"

size_t imrig_frame_write(uint8_t* payload, size_t n, uint8_t* out, size_t capacity) {
  const uint32_t crc = imrig_crc32(payload, n);
  size_t encoded;
  if (capacity < 2) return 0;
  payload[n] = (uint8_t)(crc >> 24);
  payload[n + 1] = (uint8_t)(crc >> 16);
  payload[n + 2] = (uint8_t)(crc >> 8);
  payload[n + 3] = (uint8_t)crc;
  encoded = imrig_cobs_encode(payload, n + IMRIG_CRC_BYTES, out + 1, capacity - 2);
  if (encoded == 0) return 0;
  out[0] = 0;
  out[1 + encoded] = 0;
  return encoded + 2;
}

size_t imrig_frame_open(uint8_t* frame, size_t n) {
  const size_t whole = imrig_cobs_decode(frame, n, frame, n);
  size_t size;
  uint32_t told;
  if (whole <= IMRIG_CRC_BYTES) return 0;
  size = whole - IMRIG_CRC_BYTES;
  told = ((uint32_t)frame[size] << 24) | ((uint32_t)frame[size + 1] << 16) |
         ((uint32_t)frame[size + 2] << 8) | (uint32_t)frame[size + 3];
  return told == imrig_crc32(frame, size) ? size : 0;
}
