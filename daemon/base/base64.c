// SPDX-License-Identifier: Apache-2.0
#include "daemon/base/base64.h"

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "core/invariant.h"

enum { GROUP_BYTES = 3, GROUP_DIGITS = 4, DIGIT_BITS = 6, NO_DIGIT = -1 };

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

static int value_of(char digit) {
    const char *at = digit != '\0' ? strchr(digits, digit) : NULL;
    return at != NULL ? (int)(at - digits) : NO_DIGIT;
}

/// Decodes one group of four; returns its number of bytes, or -1. Only the last group may be
/// padded, and unused bits must be 0, so that each value has exactly one encoding.
static int decode_group(const char *text, bool last, uint8_t bytes[GROUP_BYTES]) {
    int given = GROUP_DIGITS;
    while (last && given > 2 && text[given - 1] == '=') {
        given--;
    }
    uint32_t four = 0;
    for (int k = 0; k < GROUP_DIGITS; k++) {
        const int value = k < given ? value_of(text[k]) : 0;
        if (value == NO_DIGIT) {
            return -1;
        }
        four = four << DIGIT_BITS | (uint32_t)value;
    }
    for (int k = 0; k < GROUP_BYTES; k++) {
        bytes[k] = (uint8_t)(four >> (16 - 8 * k));
    }
    const int count = given - 1;
    INVARIANT(count >= 1 && count <= GROUP_BYTES);
    return count == GROUP_BYTES || (four & ((1u << (24 - 8 * count)) - 1)) == 0 ? count : -1;
}

long base64_decode(const char *text, void *data, size_t capacity) {
    const size_t length = strlen(text);
    uint8_t *to = data;
    size_t done = 0;
    if (length % GROUP_DIGITS != 0) {
        return -1;
    }
    for (size_t i = 0; i < length; i += GROUP_DIGITS) {
        uint8_t bytes[GROUP_BYTES];
        const int count = decode_group(text + i, i + GROUP_DIGITS == length, bytes);
        if (count < 0 || (size_t)count > capacity - done) {
            return -1;
        }
        memcpy(to + done, bytes, (size_t)count);
        done += (size_t)count;
    }
    return (long)done;
}
