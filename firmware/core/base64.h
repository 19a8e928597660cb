// SPDX-License-Identifier: Apache-2.0
/// Base64 with padding and without line ends. Source: RFC 4648, section 4.
#ifndef VERGENCE_CORE_BASE64_H
#define VERGENCE_CORE_BASE64_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Size of the text for `bytes` bytes, including the terminating zero.
#define BASE64_TEXT_BYTES(bytes) (((bytes) + 2) / 3 * 4 + 1)

/// Encodes `bytes` bytes of `data` as zero-terminated text; `text` has BASE64_TEXT_BYTES(bytes).
void base64_encode(const void *data, size_t bytes, char *text);

/// Decodes exactly what base64_encode writes. Returns the number of bytes, or -1 if the text is not
/// valid or decodes to more than `capacity` bytes; `data` is undefined then.
long base64_decode(const char *text, void *data, size_t capacity);

#ifdef __cplusplus
}
#endif

#endif
