// SPDX-License-Identifier: Apache-2.0
#include "core/base64.h"

#include <stdint.h>
#include <string.h>

enum { GROUP_BYTES = 3, GROUP_DIGITS = 4, DIGIT_BITS = 6 };

static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

void base64_encode(const void *data, size_t bytes, char *text) {
    const uint8_t *from = data;
    for (size_t i = 0; i < bytes; i += GROUP_BYTES) {
        const size_t left = bytes - i;
        const uint32_t three = (uint32_t)from[i] << 16 |
                               (left > 1 ? (uint32_t)from[i + 1] << 8 : 0) |
                               (left > 2 ? (uint32_t)from[i + 2] : 0);
        *text++ = digits[three >> 18];
        *text++ = digits[three >> 12 & 63];
        *text++ = left > 1 ? digits[three >> 6 & 63] : '=';
        *text++ = left > 2 ? digits[three & 63] : '=';
    }
    *text = '\0';
}

long base64_decode(const char *text, void *data, size_t capacity) {
    const size_t length = strlen(text);
    size_t given = length;
    uint32_t bits = 0;
    size_t done = 0;
    while (given > 0 && length - given < 2 && text[given - 1] == '=') {
        given--;
    }
    for (size_t i = 0; i < given; i++) {
        const char *digit = strchr(digits, text[i]);
        if (digit == NULL) {
            return -1;
        }
        bits = bits << DIGIT_BITS | (uint32_t)(digit - digits);
        const size_t place = i % GROUP_DIGITS;
        if (place == 0) {
            continue;
        }
        if (done == capacity) {
            return -1;
        }
        ((uint8_t *)data)[done++] = (uint8_t)(bits >> (DIGIT_BITS - 2 * place));
    }
    // Unused bits must be 0, so that each value has exactly one encoding.
    static const uint32_t unused[] = {0, 0x3, 0xf};  // by the number of '='
    return length % GROUP_DIGITS == 0 && (bits & unused[length - given]) == 0 ? (long)done : -1;
}
