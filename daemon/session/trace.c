// SPDX-License-Identifier: Apache-2.0
#include "daemon/session/trace.h"

#include <stdio.h>

#include "core/invariant.h"

static const char digits[] = "0123456789abcdef";

char *trace_put_bytes(char *end, const uint8_t *data, size_t bytes) {
    if (bytes == 0) {
        *end++ = '-';
    }
    for (size_t i = 0; i < bytes; i++) {
        *end++ = digits[data[i] >> 4];
        *end++ = digits[data[i] & 15];
    }
    *end = '\0';
    return end;
}

int trace_digit(char c) {
    if (c >= '0' && c <= '9') {
        return c - '0';
    }
    return c >= 'a' && c <= 'f' ? c - 'a' + 10 : 16;
}

long trace_take_bytes(const char **text, uint8_t *data, size_t capacity) {
    size_t bytes = 0;
    if (**text == '-') {
        (*text)++;
        return 0;
    }
    for (; trace_digit((*text)[0]) < 16 && trace_digit((*text)[1]) < 16; *text += 2) {
        if (bytes == capacity) {
            return -1;
        }
        data[bytes++] = (uint8_t)(trace_digit((*text)[0]) << 4 | trace_digit((*text)[1]));
    }
    return bytes > 0 ? (long)bytes : -1;
}

void trace_i2c(char *text, const struct hal_i2c_message *messages, size_t count) {
    INVARIANT(count <= HAL_I2C_MESSAGES_MAX);
    char *end = text;
    *end = '\0';
    for (size_t i = 0; i < count; i++) {
        const struct hal_i2c_message *message = &messages[i];
        INVARIANT(message->bytes <= HAL_I2C_BYTES_MAX);
        const size_t room = (size_t)(text + TRACE_LINE_MAX + 1 - end);
        end += snprintf(end, room, " %02x %c ", message->address, message->read ? 'r' : 'w');
        if (message->read) {
            end += snprintf(end, room, "%d", message->bytes);
        } else {
            end = trace_put_bytes(end, message->data, message->bytes);
        }
    }
}
