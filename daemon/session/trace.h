// SPDX-License-Identifier: Apache-2.0
/// Text form of hal calls in calls.log: "WHAT ARGUMENTS = RESULTS", one line a call. Recorder and
/// replay print the first half with the same functions, so two calls are equal exactly if their
/// texts are. session.md describes the lines.
///
/// Each function prints into `text` (TRACE_LINE_MAX + 1 bytes), zero-terminated.
#ifndef VERGENCE_DAEMON_SESSION_TRACE_H
#define VERGENCE_DAEMON_SESSION_TRACE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "hal/camera.h"
#include "hal/gpio.h"
#include "hal/i2c.h"

#ifdef __cplusplus
extern "C" {
#endif

#define TRACE_FIRST_LINE "vergence-calls 1"
#define TRACE_EQUALS " = "
#define TRACE_CHECK "crc32 "

enum {
    TRACE_LINE_MAX = 8192,
    TRACE_BYTES_MAX = 2048,  // of a serial line, in one call
};

/// Marker, not a call: calls of rig_idle follow, which no command asked for.
void trace_idle(char *text);
/// Marker, not a call: the observer asked the command to stop here.
void trace_cancel(char *text);

void trace_clock_now(char *text);
void trace_clock_wait(char *text, uint64_t time_us);

void trace_i2c_transfer(char *text, const struct hal_i2c_message *messages, size_t count,
                        uint64_t deadline_us);
void trace_i2c_lines(char *text, unsigned pulled);

/// At most TRACE_BYTES_MAX bytes.
void trace_uart_write(char *text, const void *data, size_t bytes, uint64_t deadline_us);
void trace_uart_read(char *text, size_t capacity, uint64_t deadline_us);
void trace_uart_discard(char *text);

void trace_gpio_set(char *text, enum hal_gpio_line line, bool active);
void trace_gpio_get(char *text, enum hal_gpio_line line);

/// `camera` is 0 or 1.
void trace_camera_start(char *text, int camera, const struct hal_camera_format *format);
void trace_camera_stop(char *text, int camera);
void trace_camera_take(char *text, int camera, uint64_t not_before_us, uint64_t deadline_us);
void trace_camera_give_back(char *text, int camera, uint32_t sequence);
void trace_camera_control(char *text, int camera, enum hal_camera_control control, int32_t value);
void trace_camera_counts(char *text, int camera);

/// Appends bytes as hexadecimal digits, "-" for none; returns the new end. The caller ensures
/// space.
char *trace_put_bytes(char *end, const uint8_t *data, size_t bytes);
/// Reads such digits from `*text`, which is moved past them. Returns the number of bytes, at most
/// `capacity`, or -1.
long trace_take_bytes(const char **text, uint8_t *data, size_t capacity);

#ifdef __cplusplus
}
#endif

#endif
