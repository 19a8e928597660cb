// SPDX-License-Identifier: Apache-2.0
/// Bytes as text: Base64 with padding, without line ends. Source: RFC 4648, section 4.
#ifndef VERGENCE_DAEMON_BASE_BASE64_H
#define VERGENCE_DAEMON_BASE_BASE64_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Room that the text of so many bytes needs, its terminating zero included.
#define BASE64_TEXT_BYTES(bytes) (((bytes) + 2) / 3 * 4 + 1)

/// Writes `bytes` bytes of `data` as text, terminated, of BASE64_TEXT_BYTES(bytes) in all.
void base64_encode(const void *data, size_t bytes, char *text);

/// Reads what base64_encode writes, and nothing else: the number of bytes, or -1 when the text is
/// no such one or stands for more than `capacity` bytes. `data` is undefined then.
long base64_decode(const char *text, void *data, size_t capacity);

#ifdef __cplusplus
}
#endif

#endif
