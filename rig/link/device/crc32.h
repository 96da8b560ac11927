/* CRC-32/IEEE 802.3 (also ISO-HDLC): polynomial 0x04C11DB7, reflected, start and final xor 0xFFFFFFFF. Of the
 * text "123456789": 0xCBF43926. */
#ifndef IMRIG_LINK_DEVICE_CRC32_H
#define IMRIG_LINK_DEVICE_CRC32_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

uint32_t imrig_crc32(const uint8_t* data, size_t n);

#ifdef __cplusplus
}
#endif
#endif
