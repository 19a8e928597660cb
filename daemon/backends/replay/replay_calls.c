// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/replay/replay_calls.h"

#include <errno.h>
#include <inttypes.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "core/crc.h"
#include "core/error.h"
#include "core/invariant.h"

enum { HEAD_LINES = 2 };
#define WAIT_OVER_US 1000000u  // added by each clock read after the replay has ended

// ---- the log: valid lines, and the next line

/// Reads the next line without its end. False: end of file, or a line that is too long.
static bool next_line(struct replay *self) {
    if (fgets(self->text, sizeof self->text, self->log) == NULL) {
        return false;
    }
    const size_t length = strlen(self->text);
    if (length == 0 || self->text[length - 1] != '\n') {
        return false;
    }
    self->text[length - 1] = '\0';
    return true;
}

static bool is_check(const char *text) {
    return strncmp(text, TRACE_CHECK, strlen(TRACE_CHECK)) == 0;
}

/// Counts the lines up to the last matching check.
static int count_lines(struct replay *self, struct message *message) {
    uint32_t crc = 0, line = 0, calls = 0;
    while (next_line(self)) {
        line++;
        char check[sizeof TRACE_CHECK + SESSION_CRC_DIGITS + 1];
        snprintf(check, sizeof check, TRACE_CHECK "%08" PRIx32, crc);
        if (is_check(self->text)) {
            if (strcmp(self->text, check) != 0) {
                return message_set(message, ERROR_CRC, "%s/%s: checksum mismatch before line %u",
                                   self->session.path, SESSION_CALLS_NAME, line);
            }
            self->lines = line;
            self->calls = calls;
        } else {
            calls += line > HEAD_LINES;
        }
        crc = crc_update(crc, self->text, strlen(self->text));
        crc = crc_update(crc, "\n", 1);
    }
    if (self->lines == 0) {
        return message_set(message, ERROR_MISSING, "%s/%s: contains no complete record",
                           self->session.path, SESSION_CALLS_NAME);
    }
    rewind(self->log);
    return 0;
}

static void stop_playing(struct replay *self, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
static void stop_playing(struct replay *self, const char *format, ...) {
    char why[MESSAGE_BYTES];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(why, sizeof why, format, arguments);
    va_end(arguments);
    self->ended = true;
    message_set(&self->last_error, 0, "%s/%s: line %u: %s", self->session.path, SESSION_CALLS_NAME,
                self->line, why);
}

/// Reads the next call into `text`, unless it is there already. False: there is no next call.
static bool next_call(struct replay *self) {
    while (!self->peeked && !self->ended && self->line < self->lines && next_line(self)) {
        self->line++;
        self->peeked = !is_check(self->text);
    }
    return self->peeked && !self->ended;
}

bool replay_calls_take_mark(struct replay *self, void (*print)(char *text)) {
    char mark[TRACE_LINE_MAX + 1];
    print(mark);
    const size_t length = strlen(mark);
    if (!next_call(self) || strncmp(self->text, mark, length) != 0 ||
        strncmp(self->text + length, TRACE_EQUALS, strlen(TRACE_EQUALS)) != 0) {
        return false;
    }
    self->peeked = false;
    self->calls--;
    self->made++;
    return true;
}

/// The recorded answer to a call; NULL if the replay has ended or ends now.
static const char *answer_to(struct replay *self, const char *asked) {
    if (next_call(self)) {
        self->peeked = false;
        char *equals = strstr(self->text, TRACE_EQUALS);
        if (equals == NULL) {
            stop_playing(self, "not a call");
            return NULL;
        }
        *equals = '\0';
        if (strcmp(self->text, asked) != 0) {
            stop_playing(self, "expected the call '%.300s', got '%.300s'", self->text, asked);
            return NULL;
        }
        self->calls--;
        self->made++;
        return equals + strlen(TRACE_EQUALS);
    }
    if (!self->ended) {
        self->ran_out = true;
        stop_playing(self, "the recording ends here, got '%.300s'", asked);
    }
    return NULL;
}

/// Parses a number and a following blank at the front of an answer.
static bool take_number(const char **text, int64_t *value) {
    char *end;
    *value = strtoll(*text, &end, 10);
    const bool taken = end != *text;
    *text = *end == ' ' ? end + 1 : end;
    return taken;
}

/// The same for a time in microseconds; limited so that a sum of two fits.
static bool take_time(const char **text, int64_t *time_us) {
    errno = 0;
    return take_number(text, time_us) && errno == 0 && *time_us >= 0;
}

static int wrong_answer(struct replay *self) {
    stop_playing(self, "invalid answer to '%.300s'", self->text);
    return ERROR_IO;
}

/// Parses the result code of a call; the remaining answer is in `*rest`.
static int code_of(struct replay *self, const char *asked, const char **rest) {
    *rest = answer_to(self, asked);
    int64_t code;
    if (*rest == NULL) {
        return ERROR_IO;
    }
    return take_number(rest, &code) && code <= 0 && code > INT32_MIN ? (int)code
                                                                     : wrong_answer(self);
}

static int answer_code(struct replay *self, const char *asked) {
    const char *rest;
    return code_of(self, asked, &rest);
}

// ---- clock

static uint64_t clock_now_us(void *context) {
    struct replay *self = context;
    char asked[TRACE_LINE_MAX + 1];
    trace_clock_now(asked);
    const char *answer = answer_to(self, asked);
    int64_t reported_us = 0;
    if (answer != NULL && !take_time(&answer, &reported_us)) {
        wrong_answer(self);
    }
    if (!self->ended) {
        // A manipulated recording must not make time run backwards.
        self->now_us = (uint64_t)reported_us > self->now_us ? (uint64_t)reported_us : self->now_us;
    } else {
        self->now_us += WAIT_OVER_US;
    }
    return self->now_us;
}

static void clock_wait_until_us(void *context, uint64_t time_us) {
    char asked[TRACE_LINE_MAX + 1];
    trace_clock_wait(asked, time_us);
    answer_to(context, asked);
}

static const struct hal_clock_operations clock_operations = {clock_now_us, clock_wait_until_us};

// ---- I2C

static int i2c_transfer(void *context, const struct hal_i2c_message *messages, size_t count,
                        uint64_t deadline_us, size_t *begun) {
    struct replay *self = context;
    char asked[TRACE_LINE_MAX + 1];
    trace_i2c_transfer(asked, messages, count, deadline_us);
    const char *rest;
    const int code = code_of(self, asked, &rest);
    int64_t clocked = 0;
    *begun = 0;
    if (self->ended) {
        return code;
    }
    if (!take_number(&rest, &clocked) || clocked < 0) {
        return wrong_answer(self);
    }
    *begun = (size_t)clocked;
    for (size_t i = 0; i < count && code == 0; i++) {
        if (messages[i].read) {
            if (trace_take_bytes(&rest, messages[i].data, messages[i].bytes) != messages[i].bytes) {
                return wrong_answer(self);
            }
            rest += *rest == ' ';
        }
    }
    return code;
}

static int i2c_lines(void *context, unsigned pulled, unsigned *high) {
    struct replay *self = context;
    char asked[TRACE_LINE_MAX + 1];
    trace_i2c_lines(asked, pulled);
    const char *rest;
    const int code = code_of(self, asked, &rest);
    int64_t lines;
    if (self->ended) {
        return code;
    }
    if (!take_number(&rest, &lines)) {
        return wrong_answer(self);
    }
    *high = code == 0 ? (unsigned)lines : *high;
    return code;
}

// ---- serial line

static int uart_write(void *context, const void *data, size_t bytes, uint64_t deadline_us) {
    const uint8_t *at = data;
    int code = 0;
    while (code == 0 && bytes > 0) {  // in the pieces that the recorder writes
        const size_t some = bytes < TRACE_BYTES_MAX ? bytes : TRACE_BYTES_MAX;
        char asked[TRACE_LINE_MAX + 1];
        trace_uart_write(asked, at, some, deadline_us);
        code = answer_code(context, asked);
        at += some;
        bytes -= some;
    }
    return code;
}

static int uart_read(void *context, void *data, size_t capacity, uint64_t deadline_us,
                     size_t *bytes) {
    struct replay *self = context;
    const size_t some = capacity < TRACE_BYTES_MAX ? capacity : TRACE_BYTES_MAX;
    char asked[TRACE_LINE_MAX + 1];
    trace_uart_read(asked, some, deadline_us);
    const char *rest;
    const int code = code_of(self, asked, &rest);
    if (code != 0) {
        return code;
    }
    const long came = trace_take_bytes(&rest, data, some);
    if (came <= 0) {
        return wrong_answer(self);
    }
    *bytes = (size_t)came;
    return 0;
}

static int uart_discard(void *context) {
    char asked[TRACE_LINE_MAX + 1];
    trace_uart_discard(asked);
    return answer_code(context, asked);
}

static const struct hal_uart_operations uart_operations = {uart_write, uart_read, uart_discard};

// ---- lines

static int gpio_set(void *context, enum hal_gpio_line line, bool active) {
    char asked[TRACE_LINE_MAX + 1];
    trace_gpio_set(asked, line, active);
    return answer_code(context, asked);
}

static int gpio_get(void *context, enum hal_gpio_line line, bool *active) {
    struct replay *self = context;
    char asked[TRACE_LINE_MAX + 1];
    trace_gpio_get(asked, line);
    const char *rest;
    const int code = code_of(self, asked, &rest);
    int64_t level;
    if (code != 0) {
        return code;
    }
    if (!take_number(&rest, &level)) {
        return wrong_answer(self);
    }
    *active = level != 0;
    return 0;
}

static const struct hal_gpio_operations gpio_operations = {gpio_set, gpio_get};

// ---- cameras

static int camera_start(void *context, const struct hal_camera_format *format) {
    const struct replay_camera *camera = context;
    char asked[TRACE_LINE_MAX + 1];
    trace_camera_start(asked, camera->number, format);
    return answer_code(camera->replay, asked);
}

static int camera_stop(void *context) {
    const struct replay_camera *camera = context;
    char asked[TRACE_LINE_MAX + 1];
    trace_camera_stop(asked, camera->number);
    return answer_code(camera->replay, asked);
}

static int camera_take(void *context, uint64_t not_before_us, uint64_t deadline_us,
                       struct hal_camera_frame *frame) {
    struct replay_camera *camera = context;
    struct replay *self = camera->replay;
    char asked[TRACE_LINE_MAX + 1];
    trace_camera_take(asked, camera->number, not_before_us, deadline_us);
    const char *rest;
    int code = code_of(self, asked, &rest);
    if (code != 0) {
        return code;
    }
    struct pair_frame form = {0};
    uint32_t crc32, sequence, faults;
    unsigned bits, layout;
    const int fields = sscanf(rest,
                              "%8" SCNx32 " %" SCNu16 "x%" SCNu16 " %u %u %" SCNu32 " %" SCNu32
                              " %" SCNu64 " %" SCNu64,
                              &crc32, &form.width_px, &form.height_px, &bits, &layout, &sequence,
                              &faults, &form.begin_us, &form.end_us);
    if (fields != 9 || bits < 8 || bits > 16 || layout > HAL_CAMERA_BAYER_GRBG ||
        form.width_px == 0 || form.height_px == 0) {
        return wrong_answer(self);
    }
    form.bits = (uint8_t)bits;
    form.layout = (enum hal_camera_layout)layout;
    form.sequence = sequence;
    code = replay_camera_lend(camera, &form, crc32, frame);
    self->ended |= code != 0;
    frame->faults = faults;
    return code;
}

static void camera_give_back(void *context, const struct hal_camera_frame *frame) {
    struct replay_camera *camera = context;
    char asked[TRACE_LINE_MAX + 1];
    trace_camera_give_back(asked, camera->number, frame->sequence);
    answer_to(camera->replay, asked);
    replay_camera_take_back(camera, frame);
}

static int camera_control(void *context, enum hal_camera_control control, int32_t value,
                          int32_t *applied) {
    const struct replay_camera *camera = context;
    char asked[TRACE_LINE_MAX + 1];
    trace_camera_control(asked, camera->number, control, value);
    const char *rest;
    const int code = code_of(camera->replay, asked, &rest);
    int64_t value_applied;
    if (code != 0) {
        return code;
    }
    if (!take_number(&rest, &value_applied)) {
        return wrong_answer(camera->replay);
    }
    *applied = (int32_t)value_applied;
    return 0;
}

static void camera_counts(void *context, struct hal_camera_counts *counts) {
    const struct replay_camera *camera = context;
    char asked[TRACE_LINE_MAX + 1];
    trace_camera_counts(asked, camera->number);
    const char *answer = answer_to(camera->replay, asked);
    memset(counts, 0, sizeof *counts);
    if (answer != NULL &&
        sscanf(answer, "%" SCNu32 " %" SCNu32 " %" SCNu32 " %" SCNu32 " %" SCNu32, &counts->frames,
               &counts->faulty, &counts->gaps, &counts->timeouts, &counts->restarts) != 5) {
        wrong_answer(camera->replay);
    }
}

// ---- all together

static void set_camera(struct replay *self, int number, bool has_control) {
    self->camera_operations[number] =
        (struct hal_camera_operations){camera_start,
                                       camera_stop,
                                       camera_take,
                                       camera_give_back,
                                       has_control ? camera_control : NULL,
                                       camera_counts};
    self->ports.camera[number] = &self->camera[number];
}

static int set_ports(struct replay *self, struct message *message) {
    int i2c, lines, gpio, uart, cameras, left_control, right_control;
    const bool known = next_line(self) && strcmp(self->text, TRACE_FIRST_LINE) == 0;
    self->line = HEAD_LINES;
    if (!known || !next_line(self) ||
        sscanf(self->text, "ports i2c=%d lines=%d gpio=%d uart=%d cameras=%d controls=%1d%1d", &i2c,
               &lines, &gpio, &uart, &cameras, &left_control, &right_control) != 7) {
        return message_set(message, ERROR_VERSION, "%s/%s: unsupported version", self->session.path,
                           SESSION_CALLS_NAME);
    }
    self->clock = (struct hal_clock){&clock_operations, self};
    self->ports.clock = &self->clock;
    self->i2c_operations = (struct hal_i2c_operations){i2c_transfer, lines != 0 ? i2c_lines : NULL};
    self->i2c = (struct hal_i2c){&self->i2c_operations, self};
    self->gpio = (struct hal_gpio){&gpio_operations, self};
    self->uart = (struct hal_uart){&uart_operations, self};
    self->ports.i2c = i2c != 0 ? &self->i2c : NULL;
    self->ports.gpio = gpio != 0 ? &self->gpio : NULL;
    self->ports.lens_uart = uart != 0 ? &self->uart : NULL;
    if (cameras >= 1) {
        set_camera(self, RIG_LEFT, left_control != 0);
        self->ports.camera[RIG_RIGHT] = self->ports.camera[RIG_LEFT];
    }
    if (cameras == 2) {
        set_camera(self, RIG_RIGHT, right_control != 0);
    }
    return 0;
}

int replay_calls_open(struct replay *self, struct message *message) {
    self->log = session_reader_file(&self->session, SESSION_CALLS_NAME, message);
    if (self->log == NULL) {
        return ERROR_MISSING;
    }
    const int code = count_lines(self, message);
    return code != 0 ? code : set_ports(self, message);
}
