/* LCM encoding of the link's messages (lcmtypes/link), by hand: 8 bytes fingerprint, then the fields in
 * order, all big-endian, floats as their IEEE 754 bits, arrays without padding. Decoding is strict: right
 * fingerprint, exact length, lengths of arrays in range. The fingerprints are those that lcm-gen computes;
 * the tests compare both, byte by byte. */
#ifndef IMRIG_LINK_DEVICE_CODEC_H
#define IMRIG_LINK_DEVICE_CODEC_H

#include <stddef.h>
#include <stdint.h>

#include "rig/link/device/messages.h"

#ifdef __cplusplus
extern "C" {
#endif

enum imrig_type {
  IMRIG_TYPE_NONE = 0,
  IMRIG_TYPE_HELLO,
  IMRIG_TYPE_WELCOME,
  IMRIG_TYPE_SEGMENT,
  IMRIG_TYPE_COMMIT,
  IMRIG_TYPE_ORDER,
  IMRIG_TYPE_CREDIT,
  IMRIG_TYPE_REPLY,
  IMRIG_TYPE_BLOCK,
  IMRIG_TYPE_STATUS
};

/* The type whose fingerprint leads the bytes; IMRIG_TYPE_NONE when none does. */
enum imrig_type imrig_type_of(const uint8_t* data, size_t n);
uint64_t imrig_fingerprint(enum imrig_type type);

/* Return the size written, 0 when it does not fit into capacity (or a block's n is not 1..256). */
size_t imrig_encode_hello(const imrig_hello* m, uint8_t* out, size_t capacity);
size_t imrig_encode_welcome(const imrig_welcome* m, uint8_t* out, size_t capacity);
size_t imrig_encode_segment(const imrig_segment* m, uint8_t* out, size_t capacity);
size_t imrig_encode_commit(const imrig_commit* m, uint8_t* out, size_t capacity);
size_t imrig_encode_order(const imrig_order* m, uint8_t* out, size_t capacity);
size_t imrig_encode_credit(const imrig_credit* m, uint8_t* out, size_t capacity);
size_t imrig_encode_reply(const imrig_reply* m, uint8_t* out, size_t capacity);
size_t imrig_encode_block(const imrig_block* m, uint8_t* out, size_t capacity);
size_t imrig_encode_status(const imrig_status* m, uint8_t* out, size_t capacity);

/* Return 1, or 0 when the bytes are not exactly one message of that type; *m is then undefined. */
int imrig_decode_hello(const uint8_t* data, size_t n, imrig_hello* m);
int imrig_decode_welcome(const uint8_t* data, size_t n, imrig_welcome* m);
int imrig_decode_segment(const uint8_t* data, size_t n, imrig_segment* m);
int imrig_decode_commit(const uint8_t* data, size_t n, imrig_commit* m);
int imrig_decode_order(const uint8_t* data, size_t n, imrig_order* m);
int imrig_decode_credit(const uint8_t* data, size_t n, imrig_credit* m);
int imrig_decode_reply(const uint8_t* data, size_t n, imrig_reply* m);
int imrig_decode_block(const uint8_t* data, size_t n, imrig_block* m);
int imrig_decode_status(const uint8_t* data, size_t n, imrig_status* m);

#ifdef __cplusplus
}
#endif
#endif
