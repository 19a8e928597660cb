// SPDX-License-Identifier: Apache-2.0
#include "daemon/session/trace.h"

#include <inttypes.h>
#include <stdio.h>

#include "core/invariant.h"

#define ROOM (TRACE_LINE_MAX + 1)

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

static int digit_of(char c) {
    return c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

long trace_take_bytes(const char **text, uint8_t *data, size_t capacity) {
    size_t bytes = 0;
    if (**text == '-') {
        (*text)++;
        return 0;
    }
    for (; digit_of((*text)[0]) >= 0 && digit_of((*text)[1]) >= 0; *text += 2) {
        if (bytes == capacity) {
            return -1;
        }
        data[bytes++] = (uint8_t)(digit_of((*text)[0]) << 4 | digit_of((*text)[1]));
    }
    return bytes > 0 ? (long)bytes : -1;
}

void trace_cancel(char *text) {
    snprintf(text, ROOM, "cancel");
}

void trace_idle(char *text) {
    snprintf(text, ROOM, "idle");
}

void trace_clock_now(char *text) {
    snprintf(text, ROOM, "clock now");
}

void trace_clock_wait(char *text, uint64_t time_us) {
    snprintf(text, ROOM, "clock wait %" PRIu64, time_us);
}

void trace_i2c_transfer(char *text, const struct hal_i2c_message *messages, size_t count,
                        uint64_t deadline_us) {
    INVARIANT(count <= HAL_I2C_MESSAGES_MAX);
    char *end = text + snprintf(text, ROOM, "i2c transfer %" PRIu64, deadline_us);
    for (size_t i = 0; i < count; i++) {
        const struct hal_i2c_message *message = &messages[i];
        INVARIANT(message->bytes <= HAL_I2C_BYTES_MAX);
        end += snprintf(end, (size_t)(text + ROOM - end), " %02x %c ", message->address,
                        message->read ? 'r' : 'w');
        if (message->read) {
            end += snprintf(end, (size_t)(text + ROOM - end), "%d", message->bytes);
        } else {
            end = trace_put_bytes(end, message->data, message->bytes);
        }
    }
}

void trace_i2c_lines(char *text, unsigned pulled) {
    snprintf(text, ROOM, "i2c lines %u", pulled);
}

void trace_uart_write(char *text, const void *data, size_t bytes, uint64_t deadline_us) {
    INVARIANT(bytes <= TRACE_BYTES_MAX);
    char *end = text + snprintf(text, ROOM, "uart write %" PRIu64 " ", deadline_us);
    trace_put_bytes(end, data, bytes);
}

void trace_uart_read(char *text, size_t capacity, uint64_t deadline_us) {
    snprintf(text, ROOM, "uart read %" PRIu64 " %zu", deadline_us, capacity);
}

void trace_uart_discard(char *text) {
    snprintf(text, ROOM, "uart discard");
}

void trace_gpio_set(char *text, enum hal_gpio_line line, bool active) {
    snprintf(text, ROOM, "gpio set %d %d", (int)line, active);
}

void trace_gpio_get(char *text, enum hal_gpio_line line) {
    snprintf(text, ROOM, "gpio get %d", (int)line);
}

void trace_camera_start(char *text, int camera, const struct hal_camera_format *format) {
    snprintf(text, ROOM, "camera%d start %dx%d", camera, format->width_px, format->height_px);
}

void trace_camera_stop(char *text, int camera) {
    snprintf(text, ROOM, "camera%d stop", camera);
}

void trace_camera_take(char *text, int camera, uint64_t not_before_us, uint64_t deadline_us) {
    snprintf(text, ROOM, "camera%d take %" PRIu64 " %" PRIu64, camera, not_before_us, deadline_us);
}

void trace_camera_give_back(char *text, int camera, uint32_t sequence) {
    snprintf(text, ROOM, "camera%d give_back %" PRIu32, camera, sequence);
}

void trace_camera_control(char *text, int camera, enum hal_camera_control control, int32_t value) {
    snprintf(text, ROOM, "camera%d control %d %" PRId32, camera, (int)control, value);
}

void trace_camera_counts(char *text, int camera) {
    snprintf(text, ROOM, "camera%d counts", camera);
}
