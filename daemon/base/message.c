// SPDX-License-Identifier: Apache-2.0
#include "daemon/base/message.h"

#include <stdarg.h>
#include <stdbool.h>
#include <string.h>

#include "core/utf8.h"

int message_set(struct message *message, int code, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    const int length = vsnprintf(message->text, sizeof message->text, format, arguments);
    va_end(arguments);
    if (length < 0) {
        message->text[0] = '\0';
    }
    utf8_mask_controls(message->text);
    return code;
}

void printable_print(FILE *file, const char *text) {
    for (;;) {
        const size_t bytes = utf8_count_printable(text);
        fwrite(text, 1, bytes, file);
        text += bytes;
        if (*text == '\0') {
            return;
        }
        // Further bytes of the character follow as ones that are not UTF-8.
        fprintf(file, "\\x%02x", (unsigned)(unsigned char)*text++);
    }
}

void printable_print_json(FILE *file, const char *text) {
    while (*text != '\0') {
        uint32_t character = 0;
        const size_t bytes = utf8_character(text, &character);
        if (bytes == 0) {
            fputc(*text, file);
        } else if (character < 0x20) {
            fputc(' ', file);  // white space between values: strings contain none
        } else if (utf8_is_control(character)) {
            fprintf(file, "\\u%04x", (unsigned)character);
        } else {
            fwrite(text, 1, bytes, file);
        }
        text += bytes != 0 ? bytes : 1;
    }
}
