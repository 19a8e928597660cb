// SPDX-License-Identifier: Apache-2.0
/// Text form of hal calls in calls.log: "TIME WHAT ARGUMENTS = RESULTS", one line a call. Recorder
/// and replay print WHAT ARGUMENTS with the same formats, so two calls are equal exactly if their
/// texts are; RESULTS are printed and read by the same formats. session.md describes the lines.
#ifndef VERGENCE_DAEMON_SESSION_TRACE_H
#define VERGENCE_DAEMON_SESSION_TRACE_H

#include <inttypes.h>
#include <stddef.h>
#include <stdint.h>

#include "hal/i2c.h"

#ifdef __cplusplus
extern "C" {
#endif

#define TRACE_FIRST_LINE "vergence-calls 2"
#define TRACE_EQUALS " = "

// What printf writes and sscanf reads: the recorder and the replay have the same formats.
#define TRACE_PORTS "ports i2c=%d lines=%d gpio=%d uart=%d cameras=%d controls=%1d%1d"
#define TRACE_PORTS_VALUES 7
// Results of `take` after the code: CRC-32 of the file, size, bits, layout, sequence, faults,
// begin, end.
#define TRACE_FRAME "%08" PRIx32 " %dx%d %d %d %" PRIu32 " %" PRIu32 " %" PRIu64 " %" PRIu64
#define TRACE_FRAME_VALUES 9
// Results of `counts`, in the order of struct hal_camera_counts.
#define TRACE_COUNTS "%" PRIu32 " %" PRIu32 " %" PRIu32 " %" PRIu32 " %" PRIu32
#define TRACE_COUNTS_VALUES 5

// Lines that are not calls.
#define TRACE_CHECK "crc32 "
#define TRACE_TIME \
    "time %" PRIu64 " %u"      // the clock's value from this read of it on, see session.md
#define TRACE_IDLE "idle"      // rig_idle is called
#define TRACE_CANCEL "cancel"  // the running command is cancelled

// Calls and their arguments, as formats of printf.
#define TRACE_CLOCK_WAIT "clock wait %" PRIu64                  // time at which the wait ends
#define TRACE_I2C_TRANSFER "i2c transfer %" PRIu64 "%s"         // deadline, trace_i2c
#define TRACE_I2C_LINES "i2c lines %u"                          // pulled
#define TRACE_UART_WRITE "uart write %" PRIu64 " %s"            // deadline, trace_put_bytes
#define TRACE_UART_READ "uart read %" PRIu64 " %zu"             // deadline, capacity
#define TRACE_UART_DISCARD "uart discard"                       //
#define TRACE_GPIO_SET "gpio set %d %d"                         // line, active
#define TRACE_GPIO_GET "gpio get %d"                            // line
#define TRACE_CAMERA_START "camera%d start %dx%d"               // camera (0, 1), size
#define TRACE_CAMERA_STOP "camera%d stop"                       // camera
#define TRACE_CAMERA_TAKE "camera%d take %" PRIu64 " %" PRIu64  // camera, not before, deadline
#define TRACE_CAMERA_CONTROL "camera%d control %d %" PRId32     // camera, control, value
#define TRACE_CAMERA_COUNTS "camera%d counts"                   // camera

enum {
    TRACE_LINE_MAX = 8192,
    TRACE_BYTES_MAX = 2048,  // maximum number of bytes of a serial line in one call
};

/// Prints the messages of a transfer, each with a blank before it, into TRACE_LINE_MAX + 1 bytes.
void trace_i2c(char *text, const struct hal_i2c_message *messages, size_t count);

/// Appends bytes as hexadecimal digits, "-" for none; returns the new end. The caller ensures
/// space.
char *trace_put_bytes(char *end, const uint8_t *data, size_t bytes);
/// Value of the digit `c` of such bytes (0-9, a-f); 16 for any other character.
int trace_digit(char c);
/// Reads such digits from `*text`, which is moved past them. Returns the number of bytes, at most
/// `capacity`, or -1.
long trace_take_bytes(const char **text, uint8_t *data, size_t capacity);

#ifdef __cplusplus
}
#endif

#endif
