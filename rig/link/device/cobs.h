/* Consistent Overhead Byte Stuffing (Cheshire and Baker, IEEE/ACM Transactions on Networking 7(2), 1999):
 * bytes without any 0x00, so that 0x00 can end a frame. Each group is led by its length + 1; a group of 254
 * non-zero bytes has the lead 0xFF and no zero behind it. At most one byte more per 254. */
#ifndef IMRIG_LINK_DEVICE_COBS_H
#define IMRIG_LINK_DEVICE_COBS_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Largest encoded size of n bytes, without the closing 0x00. */
#define IMRIG_COBS_MAX(n) ((n) + (n) / 254u + 1u)

/* Encodes n bytes into out (no overlap), without a closing 0x00. Returns the encoded size, 0 when it does not
 * fit into capacity. */
size_t imrig_cobs_encode(const uint8_t* in, size_t n, uint8_t* out, size_t capacity);

/* Decodes n bytes (without the closing 0x00) into out; in place (out == in) is allowed. Returns the decoded
 * size, 0 when the bytes are no COBS, decode to nothing, or do not fit into capacity. */
size_t imrig_cobs_decode(const uint8_t* in, size_t n, uint8_t* out, size_t capacity);

#ifdef __cplusplus
}
#endif
#endif
