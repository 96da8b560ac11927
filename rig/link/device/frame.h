/* A frame on the wire: 0x00, COBS(payload, CRC-32 of the payload, big-endian), 0x00. The payload is one
 * LCM-encoded struct. Big-endian because everything in an LCM struct is. The leading 0x00 ends whatever noise
 * came before, so that a wrong bit, or a lost 0x00, costs one frame and never the next; a receiver needs only
 * the closing one. */
#ifndef IMRIG_LINK_DEVICE_FRAME_H
#define IMRIG_LINK_DEVICE_FRAME_H

#include <stddef.h>
#include <stdint.h>

#include "rig/link/device/cobs.h"

#ifdef __cplusplus
extern "C" {
#endif

#define IMRIG_CRC_BYTES 4u
/* Longest payload: a block_t of 256 samples is 60 + 256 x 16 = 4156 bytes. */
#define IMRIG_PAYLOAD_MAX 4160u
/* Longest frame with both its 0x00. */
#define IMRIG_FRAME_MAX (IMRIG_COBS_MAX(IMRIG_PAYLOAD_MAX + IMRIG_CRC_BYTES) + 2u)

/* Appends the CRC to the payload (which needs room for it) and writes the frame. Returns its size, 0 when it
 * does not fit. */
size_t imrig_frame_write(uint8_t* payload, size_t n, uint8_t* out, size_t capacity);

/* Undoes COBS in place on what stood before a 0x00 and checks the CRC. Returns the payload's size, 0 for a
 * bad frame. */
size_t imrig_frame_open(uint8_t* frame, size_t n);

#ifdef __cplusplus
}
#endif
#endif
