// SPDX-License-Identifier: Apache-2.0
/// CRC-32 (IEEE 802.3, reflected, as in zlib and PNG).
#ifndef VERGENCE_CORE_CRC_H
#define VERGENCE_CORE_CRC_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Continues `crc` (0 to begin) over `length` bytes.
uint32_t crc_update(uint32_t crc, const void *data, size_t length);

#ifdef __cplusplus
}
#endif

#endif
