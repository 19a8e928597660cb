// SPDX-License-Identifier: Apache-2.0
#include "core/utf8.h"

#include <string.h>

#include "core/invariant.h"

size_t utf8_character(const char *text, uint32_t *character) {
    static const struct {
        unsigned char mask, lead;
        uint32_t min;
    } forms[] = {{0x80, 0, 0}, {0xE0, 0xC0, 0x80}, {0xF0, 0xE0, 0x800}, {0xF8, 0xF0, 0x10000}};
    INVARIANT(text != NULL && character != NULL);
    const unsigned char *byte = (const unsigned char *)text;
    size_t more = 0;
    while (more < sizeof forms / sizeof forms[0] &&
           (byte[0] & forms[more].mask) != forms[more].lead) {
        more++;
    }
    if (more == sizeof forms / sizeof forms[0]) {
        return 0;
    }
    uint32_t value = byte[0] & (unsigned char)~forms[more].mask;
    for (size_t i = 1; i <= more; i++) {
        if ((byte[i] & 0xC0) != 0x80) {
            return 0;
        }
        value = value << 6 | (byte[i] & 0x3F);
    }
    if (value < forms[more].min || value > 0x10FFFF || (value >= 0xD800 && value <= 0xDFFF)) {
        return 0;
    }
    *character = value;
    return more + 1;
}

bool utf8_is_control(uint32_t character) {
    return character < 0x20 || (character >= 0x7F && character < 0xA0) || character == 0x061C ||
           (character >= 0x200E && character <= 0x200F) ||
           (character >= 0x2028 && character <= 0x202E) ||
           (character >= 0x2066 && character <= 0x2069);
}

size_t utf8_count_printable(const char *text) {
    INVARIANT(text != NULL);
    size_t length = 0;
    uint32_t character = 0;
    while (text[length] != '\0') {
        const size_t bytes = utf8_character(text + length, &character);
        if (bytes == 0 || utf8_is_control(character)) {
            break;
        }
        length += bytes;
    }
    return length;
}

void utf8_copy_printable(const char *text, char *to, size_t bytes) {
    size_t length = 0;
    INVARIANT(text != NULL && bytes > 0);
    while (*text != '\0' && length + 1 < bytes) {
        const size_t good = utf8_count_printable(text);
        const size_t room = bytes - 1 - length;
        size_t copied = good < room ? good : room;
        while (copied < good && copied > 0 && ((unsigned char)text[copied] & 0xC0) == 0x80) {
            copied--;  // no part of a character
        }
        memcpy(to + length, text, copied);
        length += copied;
        text += copied;
        if (copied < good) {
            break;
        }
        if (good == 0) {
            to[length++] = '?';
            text++;
        }
    }
    to[length] = '\0';
}

void utf8_mask_controls(char *text) {
    while (*text != '\0') {
        uint32_t character = 0;
        const size_t bytes = utf8_character(text, &character);
        if (bytes != 0 && utf8_is_control(character)) {
            memset(text, '?', bytes);
        }
        text += bytes != 0 ? bytes : 1;
    }
}
