// SPDX-License-Identifier: Apache-2.0
/// SHA-256 (FIPS 180-4), by which an image of the board names its parts.
#ifndef VERGENCE_DAEMON_SYSTEM_SHA256_H
#define VERGENCE_DAEMON_SYSTEM_SHA256_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { SHA256_BYTES = 32 };

/// The sum of `bytes` bytes of data.
void sha256(const void *data, size_t bytes, uint8_t sum[SHA256_BYTES]);

#ifdef __cplusplus
}
#endif

#endif
