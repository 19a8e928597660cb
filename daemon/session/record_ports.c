// SPDX-License-Identifier: Apache-2.0
#include <inttypes.h>
#include <string.h>

#include "core/invariant.h"
#include "daemon/session/record.h"
#include "daemon/session/trace.h"

// ---- clock

static uint64_t clock_now_us(void *context) {
    struct record *self = context;
    const struct hal_clock *inner = self->inner.clock;
    return record_clock(self, inner->operations->now_us(inner->self));
}

static void clock_wait_until_us(void *context, uint64_t time_us) {
    struct record *self = context;
    const struct hal_clock *inner = self->inner.clock;
    inner->operations->wait_until_us(inner->self, time_us);
    record_call(self, TRACE_CLOCK_WAIT TRACE_EQUALS "0", time_us);
}

static bool clock_idle_is_due(void *context) {
    const struct hal_clock *inner = ((const struct record *)context)->inner.clock;
    return inner->operations->idle_is_due(inner->self);
}

// ---- I2C

static int i2c_transfer(void *context, const struct hal_i2c_message *messages, size_t count,
                        uint64_t deadline_us, size_t *begun) {
    struct record *self = context;
    const struct hal_i2c *inner = self->inner.i2c;
    const int code = inner->operations->transfer(inner->self, messages, count, deadline_us, begun);
    INVARIANT(code <= 0 && count <= HAL_I2C_MESSAGES_MAX);
    if (!record_is_on(self)) {
        return code;
    }
    char sent[TRACE_LINE_MAX + 1], read[TRACE_LINE_MAX + 1];
    char *end = read;
    *end = '\0';
    for (size_t i = 0; i < count && code == 0; i++) {
        if (messages[i].read) {
            *end++ = ' ';
            end = trace_put_bytes(end, messages[i].data, messages[i].bytes);
        }
    }
    trace_i2c(sent, messages, count);
    record_call(self, TRACE_I2C_TRANSFER TRACE_EQUALS "%d %zu%s", deadline_us, sent, code, *begun,
                read);
    return code;
}

static int i2c_lines(void *context, unsigned pulled, unsigned *high) {
    struct record *self = context;
    const struct hal_i2c *inner = self->inner.i2c;
    const int code = inner->operations->lines(inner->self, pulled, high);
    record_call(self, TRACE_I2C_LINES TRACE_EQUALS "%d %u", pulled, code, code == 0 ? *high : 0);
    return code;
}

// ---- serial line

static int uart_write(void *context, const void *data, size_t bytes, uint64_t deadline_us) {
    struct record *self = context;
    const struct hal_uart *inner = self->inner.lens_uart;
    const uint8_t *at = data;
    int code = 0;
    while (code == 0 && bytes > 0) {
        char sent[TRACE_LINE_MAX + 1];
        const size_t some = bytes < TRACE_BYTES_MAX ? bytes : TRACE_BYTES_MAX;
        code = inner->operations->write(inner->self, at, some, deadline_us);
        INVARIANT(code <= 0);
        trace_put_bytes(sent, at, some);
        record_call(self, TRACE_UART_WRITE TRACE_EQUALS "%d", deadline_us, sent, code);
        at += some;
        bytes -= some;
    }
    return code;
}

static int uart_read(void *context, void *data, size_t capacity, uint64_t deadline_us,
                     size_t *bytes) {
    struct record *self = context;
    const struct hal_uart *inner = self->inner.lens_uart;
    char came[TRACE_LINE_MAX + 1];
    const size_t some = capacity < TRACE_BYTES_MAX ? capacity : TRACE_BYTES_MAX;
    const int code = inner->operations->read(inner->self, data, some, deadline_us, bytes);
    INVARIANT(code != 0 || (*bytes > 0 && *bytes <= some));
    trace_put_bytes(came, data, code == 0 ? *bytes : 0);
    record_call(self, TRACE_UART_READ TRACE_EQUALS "%d %s", deadline_us, some, code, came);
    return code;
}

static int uart_discard(void *context) {
    struct record *self = context;
    const struct hal_uart *inner = self->inner.lens_uart;
    const int code = inner->operations->discard(inner->self);
    record_call(self, TRACE_UART_DISCARD TRACE_EQUALS "%d", code);
    return code;
}

static const struct hal_uart_operations uart_operations = {uart_write, uart_read, uart_discard};

// ---- lines

static int gpio_set(void *context, enum hal_gpio_line line, bool active) {
    struct record *self = context;
    const struct hal_gpio *inner = self->inner.gpio;
    const int code = inner->operations->set(inner->self, line, active);
    record_call(self, TRACE_GPIO_SET TRACE_EQUALS "%d", (int)line, active, code);
    return code;
}

static int gpio_get(void *context, enum hal_gpio_line line, bool *active) {
    struct record *self = context;
    const struct hal_gpio *inner = self->inner.gpio;
    const int code = inner->operations->get(inner->self, line, active);
    record_call(self, TRACE_GPIO_GET TRACE_EQUALS "%d %d", (int)line, code, code == 0 && *active);
    return code;
}

static const struct hal_gpio_operations gpio_operations = {gpio_set, gpio_get};

// ---- cameras

static int camera_start(void *context, const struct hal_camera_format *format) {
    const struct record_camera *camera = context;
    const int code = camera->inner->operations->start(camera->inner->self, format);
    record_call(camera->record, TRACE_CAMERA_START TRACE_EQUALS "%d", camera->number,
                format->width_px, format->height_px, code);
    return code;
}

static int camera_stop(void *context) {
    const struct record_camera *camera = context;
    const int code = camera->inner->operations->stop(camera->inner->self);
    record_call(camera->record, TRACE_CAMERA_STOP TRACE_EQUALS "%d", camera->number, code);
    return code;
}

static int camera_take(void *context, uint64_t not_before_us, uint64_t deadline_us,
                       struct hal_camera_frame *frame) {
    const struct record_camera *camera = context;
    struct record *self = camera->record;
    const struct hal_camera *inner = camera->inner;
    const int code = inner->operations->take(inner->self, not_before_us, deadline_us, frame);
    uint32_t crc32 = 0;
    if (!record_is_on(self) || (code == 0 && !record_frame(self, frame, &crc32))) {
        return code;
    }
    if (code != 0) {
        record_call(self, TRACE_CAMERA_TAKE TRACE_EQUALS "%d", camera->number, not_before_us,
                    deadline_us, code);
        return code;
    }
    record_call(self, TRACE_CAMERA_TAKE TRACE_EQUALS "0 " TRACE_FRAME, camera->number,
                not_before_us, deadline_us, crc32, frame->image.width_px, frame->image.height_px,
                frame->image.bits, (int)frame->image.layout, frame->sequence, frame->faults,
                frame->begin_us, frame->end_us);
    return 0;
}

static int camera_control(void *context, enum hal_camera_control control, int32_t value,
                          int32_t *applied) {
    const struct record_camera *camera = context;
    const int code =
        camera->inner->operations->control(camera->inner->self, control, value, applied);
    record_call(camera->record, TRACE_CAMERA_CONTROL TRACE_EQUALS "%d %" PRId32, camera->number,
                (int)control, value, code, code == 0 ? *applied : 0);
    return code;
}

static void camera_counts(void *context, struct hal_camera_counts *counts) {
    const struct record_camera *camera = context;
    camera->inner->operations->counts(camera->inner->self, counts);
    record_call(camera->record, TRACE_CAMERA_COUNTS TRACE_EQUALS TRACE_COUNTS, camera->number,
                counts->frames, counts->faulty, counts->gaps, counts->timeouts, counts->restarts);
}

// ---- all together

static const struct hal_camera *wrap_camera(struct record *self, int number) {
    const struct hal_camera *inner = self->inner.camera[number];
    if (inner == NULL) {
        return NULL;
    }
    self->camera_operations[number] = (struct hal_camera_operations){
        camera_start, camera_stop, camera_take, camera_control, camera_counts};
    if (inner->operations->control == NULL) {
        self->camera_operations[number].control = NULL;
    }
    self->camera_state[number] = (struct record_camera){self, inner, number};
    self->camera[number].operations = &self->camera_operations[number];
    self->camera[number].self = &self->camera_state[number];
    return &self->camera[number];
}

void record_init(struct record *self, const struct rig_ports *inner, struct rig_ports *outer) {
    INVARIANT(inner->clock != NULL && inner != outer);
    memset(self, 0, sizeof *self);
    self->inner = *inner;
    self->log = -1;
    *outer = *inner;
    self->clock_operations = (struct hal_clock_operations){
        clock_now_us, clock_wait_until_us,
        inner->clock->operations->idle_is_due != NULL ? clock_idle_is_due : NULL};
    self->clock = (struct hal_clock){&self->clock_operations, self};
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
