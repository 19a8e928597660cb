// SPDX-License-Identifier: Apache-2.0
#include "daemon/session/record.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/files/file_error.h"
#include "daemon/files/sync_file.h"
#include "daemon/session/record_disk.h"

static bool is_on(const struct record *self) {
    return self->writer != NULL && !self->ending && !self->out_of_memory &&
           record_disk_failed(self) == 0;
}

/// Adds the running command to the session: it has made a call, or has succeeded.
static void write_note(struct record *self) {
    if (self->note[0] != '\0') {
        record_disk_command(self, self->note);
        self->note[0] = '\0';
    }
}

/// Adds one call: the request, and the result as printed by `format`.
static void add_call(struct record *self, const char *asked, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
static void add_call(struct record *self, const char *asked, const char *format, ...) {
    char answer[TRACE_LINE_MAX + 1];
    va_list arguments;
    va_start(arguments, format);
    const int length = vsnprintf(answer, sizeof answer, format, arguments);
    va_end(arguments);
    INVARIANT(length >= 0 && (size_t)length < sizeof answer);
    write_note(self);
    self->calls++;
    record_disk_text(self, asked, strlen(asked));
    record_disk_text(self, TRACE_EQUALS, strlen(TRACE_EQUALS));
    record_disk_text(self, answer, (size_t)length);
    record_disk_text(self, "\n", 1);
}

// ---- clock

static uint64_t clock_now_us(void *context) {
    struct record *self = context;
    const struct hal_clock *inner = self->inner.clock;
    const uint64_t now_us = inner->operations->now_us(inner->self);
    if (is_on(self)) {
        char asked[TRACE_LINE_MAX + 1];
        trace_clock_now(asked);
        add_call(self, asked, "%" PRIu64, now_us);
    }
    return now_us;
}

static void clock_wait_until_us(void *context, uint64_t time_us) {
    struct record *self = context;
    const struct hal_clock *inner = self->inner.clock;
    inner->operations->wait_until_us(inner->self, time_us);
    if (is_on(self)) {
        char asked[TRACE_LINE_MAX + 1];
        trace_clock_wait(asked, time_us);
        add_call(self, asked, "0");
    }
}

static const struct hal_clock_operations clock_operations = {clock_now_us, clock_wait_until_us};

// ---- I2C

static int i2c_transfer(void *context, const struct hal_i2c_message *messages, size_t count,
                        uint64_t deadline_us, size_t *begun) {
    struct record *self = context;
    const struct hal_i2c *inner = self->inner.i2c;
    const int code = inner->operations->transfer(inner->self, messages, count, deadline_us, begun);
    if (is_on(self)) {
        char asked[TRACE_LINE_MAX + 1], data[TRACE_LINE_MAX + 1];
        char *end = data;
        *end = '\0';
        for (size_t i = 0; i < count && code == 0; i++) {
            if (messages[i].read) {
                *end++ = ' ';
                end = trace_put_bytes(end, messages[i].data, messages[i].bytes);
            }
        }
        trace_i2c_transfer(asked, messages, count, deadline_us);
        add_call(self, asked, "%d %zu%s", code, *begun, data);
    }
    return code;
}

static int i2c_lines(void *context, unsigned pulled, unsigned *high) {
    struct record *self = context;
    const struct hal_i2c *inner = self->inner.i2c;
    const int code = inner->operations->lines(inner->self, pulled, high);
    if (is_on(self)) {
        char asked[TRACE_LINE_MAX + 1];
        trace_i2c_lines(asked, pulled);
        add_call(self, asked, "%d %u", code, code == 0 ? *high : 0);
    }
    return code;
}

// ---- serial line

static int uart_write(void *context, const void *data, size_t bytes, uint64_t deadline_us) {
    struct record *self = context;
    const struct hal_uart *inner = self->inner.lens_uart;
    const uint8_t *at = data;
    int code = 0;
    while (code == 0 && bytes > 0) {
        const size_t some = bytes < TRACE_BYTES_MAX ? bytes : TRACE_BYTES_MAX;
        code = inner->operations->write(inner->self, at, some, deadline_us);
        if (is_on(self)) {
            char asked[TRACE_LINE_MAX + 1];
            trace_uart_write(asked, at, some, deadline_us);
            add_call(self, asked, "%d", code);
        }
        at += some;
        bytes -= some;
    }
    return code;
}

static int uart_read(void *context, void *data, size_t capacity, uint64_t deadline_us,
                     size_t *bytes) {
    struct record *self = context;
    const struct hal_uart *inner = self->inner.lens_uart;
    const size_t some = capacity < TRACE_BYTES_MAX ? capacity : TRACE_BYTES_MAX;
    const int code = inner->operations->read(inner->self, data, some, deadline_us, bytes);
    if (is_on(self)) {
        char asked[TRACE_LINE_MAX + 1], came[TRACE_LINE_MAX + 1];
        trace_uart_read(asked, some, deadline_us);
        trace_put_bytes(came, data, code == 0 ? *bytes : 0);
        add_call(self, asked, "%d %s", code, came);
    }
    return code;
}

static int uart_discard(void *context) {
    struct record *self = context;
    const struct hal_uart *inner = self->inner.lens_uart;
    const int code = inner->operations->discard(inner->self);
    if (is_on(self)) {
        char asked[TRACE_LINE_MAX + 1];
        trace_uart_discard(asked);
        add_call(self, asked, "%d", code);
    }
    return code;
}

static const struct hal_uart_operations uart_operations = {uart_write, uart_read, uart_discard};

// ---- lines

static int gpio_set(void *context, enum hal_gpio_line line, bool active) {
    struct record *self = context;
    const struct hal_gpio *inner = self->inner.gpio;
    const int code = inner->operations->set(inner->self, line, active);
    if (is_on(self)) {
        char asked[TRACE_LINE_MAX + 1];
        trace_gpio_set(asked, line, active);
        add_call(self, asked, "%d", code);
    }
    return code;
}

static int gpio_get(void *context, enum hal_gpio_line line, bool *active) {
    struct record *self = context;
    const struct hal_gpio *inner = self->inner.gpio;
    const int code = inner->operations->get(inner->self, line, active);
    if (is_on(self)) {
        char asked[TRACE_LINE_MAX + 1];
        trace_gpio_get(asked, line);
        add_call(self, asked, "%d %d", code, code == 0 && *active);
    }
    return code;
}

static const struct hal_gpio_operations gpio_operations = {gpio_set, gpio_get};

// ---- cameras

static int camera_start(void *context, const struct hal_camera_format *format) {
    const struct record_camera *camera = context;
    const int code = camera->inner->operations->start(camera->inner->self, format);
    if (is_on(camera->record)) {
        char asked[TRACE_LINE_MAX + 1];
        trace_camera_start(asked, camera->number, format);
        add_call(camera->record, asked, "%d", code);
    }
    return code;
}

static int camera_stop(void *context) {
    const struct record_camera *camera = context;
    const int code = camera->inner->operations->stop(camera->inner->self);
    if (is_on(camera->record)) {
        char asked[TRACE_LINE_MAX + 1];
        trace_camera_stop(asked, camera->number);
        add_call(camera->record, asked, "%d", code);
    }
    return code;
}

static int camera_take(void *context, uint64_t not_before_us, uint64_t deadline_us,
                       struct hal_camera_frame *frame) {
    const struct record_camera *camera = context;
    struct record *self = camera->record;
    const int code =
        camera->inner->operations->take(camera->inner->self, not_before_us, deadline_us, frame);
    uint32_t crc32 = 0;
    if (!is_on(self) || (code == 0 && !record_disk_frame(self, frame, &crc32))) {
        return code;
    }
    char asked[TRACE_LINE_MAX + 1];
    trace_camera_take(asked, camera->number, not_before_us, deadline_us);
    if (code != 0) {
        add_call(self, asked, "%d", code);
    } else {
        add_call(self, asked,
                 "0 %08" PRIx32 " %dx%d %d %d %" PRIu32 " %" PRIu32 " %" PRIu64 " %" PRIu64, crc32,
                 frame->width_px, frame->height_px, frame->bits, (int)frame->layout,
                 frame->sequence, frame->faults, frame->begin_us, frame->end_us);
    }
    return code;
}

static void camera_give_back(void *context, const struct hal_camera_frame *frame) {
    const struct record_camera *camera = context;
    if (is_on(camera->record)) {
        char asked[TRACE_LINE_MAX + 1];
        trace_camera_give_back(asked, camera->number, frame->sequence);
        add_call(camera->record, asked, "0");
    }
    camera->inner->operations->give_back(camera->inner->self, frame);
}

static int camera_control(void *context, enum hal_camera_control control, int32_t value,
                          int32_t *applied) {
    const struct record_camera *camera = context;
    const int code =
        camera->inner->operations->control(camera->inner->self, control, value, applied);
    if (is_on(camera->record)) {
        char asked[TRACE_LINE_MAX + 1];
        trace_camera_control(asked, camera->number, control, value);
        add_call(camera->record, asked, "%d %" PRId32, code, code == 0 ? *applied : 0);
    }
    return code;
}

static void camera_counts(void *context, struct hal_camera_counts *counts) {
    const struct record_camera *camera = context;
    camera->inner->operations->counts(camera->inner->self, counts);
    if (is_on(camera->record)) {
        char asked[TRACE_LINE_MAX + 1];
        trace_camera_counts(asked, camera->number);
        add_call(camera->record, asked, "%" PRIu32 " %" PRIu32 " %" PRIu32 " %" PRIu32 " %" PRIu32,
                 counts->frames, counts->faulty, counts->gaps, counts->timeouts, counts->restarts);
    }
}

// ---- all together

static const struct hal_camera *wrap_camera(struct record *self, int number) {
    const struct hal_camera *inner = self->inner.camera[number];
    if (inner == NULL) {
        return NULL;
    }
    self->camera_operations[number] = (struct hal_camera_operations){
        camera_start, camera_stop, camera_take, camera_give_back, camera_control, camera_counts};
    if (inner->operations->control == NULL) {
        self->camera_operations[number].control = NULL;
    }
    self->camera_state[number] = (struct record_camera){self, inner, number};
    self->camera[number].operations = &self->camera_operations[number];
    self->camera[number].self = &self->camera_state[number];
    return &self->camera[number];
}

void record_init(struct record *self, const struct rig_ports *inner, struct rig_ports *outer) {
    memset(self, 0, sizeof *self);
    self->inner = *inner;
    self->log = -1;
    *outer = *inner;
    self->clock = (struct hal_clock){&clock_operations, self};
    outer->clock = &self->clock;
    if (inner->i2c != NULL) {
        self->i2c_operations.transfer = i2c_transfer;
        self->i2c_operations.lines = inner->i2c->operations->lines != NULL ? i2c_lines : NULL;
        self->i2c = (struct hal_i2c){&self->i2c_operations, self};
        outer->i2c = &self->i2c;
    }
    if (inner->gpio != NULL) {
        self->gpio = (struct hal_gpio){&gpio_operations, self};
        outer->gpio = &self->gpio;
    }
    if (inner->lens_uart != NULL) {
        self->uart = (struct hal_uart){&uart_operations, self};
        outer->lens_uart = &self->uart;
    }
    outer->camera[RIG_LEFT] = wrap_camera(self, RIG_LEFT);
    outer->camera[RIG_RIGHT] = inner->camera[RIG_RIGHT] == inner->camera[RIG_LEFT]
                                   ? outer->camera[RIG_LEFT]
                                   : wrap_camera(self, RIG_RIGHT);
}

/// Creates calls.log and syncs its name, but not its contents.
static int open_log(struct record *self, const struct session_writer *writer,
                    struct message *message) {
    // In an existing directory such a file is not ours.
    self->log = openat(writer->directory, SESSION_CALLS_NAME,
                       O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, SESSION_FILE_MODE);
    if (self->log >= 0 && sync_file(writer->directory)) {
        return 0;
    }
    const int number = errno;
    if (self->log >= 0) {
        close(self->log);
        self->log = -1;
        unlinkat(writer->directory, SESSION_CALLS_NAME, 0);
    }
    return message_set(message, file_error(number), "%s/%s: cannot be written: %s", writer->path,
                       SESSION_CALLS_NAME, strerror(number));
}

int record_start(struct record *self, struct session_writer *writer, struct message *message) {
    INVARIANT(self->writer == NULL);
    const int opened = open_log(self, writer, message);
    if (opened != 0) {
        return opened;
    }
    self->writer = writer;
    self->ending = false;
    self->out_of_memory = false;
    self->failed = 0;
    self->crc = 0;
    self->calls = 0;
    self->note[0] = '\0';
    self->filled = 0;
    // The ports that exist, so that a replay offers the same.
    char line[TRACE_LINE_MAX + 1];
    const struct rig_ports *inner = &self->inner;
    const bool one = inner->camera[RIG_LEFT] == inner->camera[RIG_RIGHT];
    const int length =
        snprintf(line, sizeof line,
                 TRACE_FIRST_LINE
                 "\nports i2c=%d lines=%d gpio=%d uart=%d "
                 "cameras=%d controls=%d%d\n",
                 inner->i2c != NULL, self->i2c_operations.lines != NULL, inner->gpio != NULL,
                 inner->lens_uart != NULL,
                 (inner->camera[RIG_LEFT] != NULL) + (!one && inner->camera[RIG_RIGHT] != NULL),
                 self->camera_operations[RIG_LEFT].control != NULL,
                 self->camera_operations[RIG_RIGHT].control != NULL);
    record_disk_text(self, line, (size_t)length);
    const int error = record_flush(self, message);
    if (error != 0) {
        struct message again;
        record_stop(self, &again);
        unlinkat(writer->directory, SESSION_CALLS_NAME, 0);
    }
    return error;
}

void record_command(struct record *self, const char *line) {
    if (is_on(self)) {
        INVARIANT(strlen(line) < sizeof self->note);
        strcpy(self->note, line);
    }
}

void record_command_end(struct record *self, int error) {
    if (is_on(self)) {
        if (error == 0) {
            write_note(self);
        }
        record_disk_send(self);  // a killed process loses no finished command
    }
    self->note[0] = '\0';
}

int record_run(struct record *self, const struct command *command, const struct command_call *call,
               const char *line) {
    if ((command->flags & (COMMAND_NO_RIG | COMMAND_UNRECORDED)) != 0) {
        return command_run(command, call);
    }
    record_command(self, line);
    const int error = command_run(command, call);
    record_command_end(self, error);
    return error;
}

/// Adds a marker, which is not a call but which a replay needs.
static void add_mark(struct record *self, void (*print)(char *text)) {
    if (is_on(self)) {
        char asked[TRACE_LINE_MAX + 1];
        print(asked);
        add_call(self, asked, "0");
    }
}

void record_idle(struct record *self) {
    add_mark(self, trace_idle);
}

void record_cancel(struct record *self) {
    add_mark(self, trace_cancel);
}

int record_flush(struct record *self, struct message *message) {
    if (self->writer == NULL) {
        return 0;
    }
    const int error = record_disk_flush(self);
    return error != 0 ? message_set(message, error, "%s", self->last_error.text) : 0;
}

bool record_is_under_way(const struct record *self) {
    return self->writer != NULL;
}

const char *record_cut(const struct record *self) {
    return self->writer != NULL && record_disk_failed(self) != 0 ? self->last_error.text : NULL;
}

int record_stop(struct record *self, struct message *message) {
    self->ending = true;
    const int code = record_flush(self, message);
    if (self->log >= 0) {
        close(self->log);
    }
    self->log = -1;
    self->writer = NULL;
    return code;
}
