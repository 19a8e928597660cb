// SPDX-License-Identifier: Apache-2.0
#include "fake_rig.h"

#include <errno.h>
#include <linux/i2c-dev.h>
#include <linux/i2c.h>
#include <linux/videodev2.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/backends/sim/sim_backend.h"
#include "fake_file.h"
#include "fake_gpio.h"
#include "fake_i2c.h"
#include "fake_kernel.h"
#include "fake_serial.h"
#include "fake_video.h"

enum {
    TIMEOUT_UNIT_US = 10000,
    LINE_BITS_PER_S = B9600,
    // Time a driver needs per frame before the port takes another: of small frames every
    // millisecond most are lost, and are then not simulated.
    DRIVER_BUSY_US = 5000,
};

static struct sim_backend backend;
static bool connected;
static atomic_ullong now_us;  // read by the event loop's thread while another one waits
static _Thread_local unsigned asking;

static struct fake_i2c *bus;
static struct fake_video *camera;
static bool camera_runs;
static uint32_t first_number;  // of the stream's first frame
static uint64_t ready_us;      // when the driver has finished the last frame
static struct fake_gpio *chip;
static unsigned reset_wire, irq_wire;
static struct fake_serial serial;
static bool has_serial;

// The sim client's own invariants; hidden, so that the program keeps its own handler.
__attribute__((visibility("hidden"))) void invariant_failed(const char *file, int line,
                                                            const char *condition) {
    fprintf(stderr, "fake kernel: internal error at %s:%d: %s\n", file, line, condition);
    abort();
}

static void stop(const char *what) {
    fprintf(stderr, "fake kernel: the simulated rig: %s: %s\n", what, backend.connection.text);
    abort();
}

/// Bracket every request to the rig, which may advance the time. One thread at a time.
static void begin_asking(void) {
    fake_kernel_lock();
    asking++;
}

static void end_asking(void) {
    atomic_store(&now_us, FAKE_RIG_BEGIN_US + backend.connection.now_us);
    asking--;
    fake_kernel_unlock();
}

bool fake_rig_is_connected(void) {
    return connected;
}

bool fake_rig_asks(void) {
    return asking > 0;
}

uint64_t fake_rig_now_us(void) {
    return atomic_load(&now_us);
}

static uint64_t rig_time_us(uint64_t time_us) {
    return time_us > FAKE_RIG_BEGIN_US ? time_us - FAKE_RIG_BEGIN_US : 0;
}

void fake_rig_connect(const char *where) {
    begin_asking();
    if (sim_backend_open(&backend, where, SIM_CONNECTION_TIMEOUT_MS) != ERROR_OK) {
        stop(where);
    }
    backend.connection.now_us = backend.clock.operations->now_us(backend.clock.self);
    connected = true;
    end_asking();
    fake_kernel_virtual_time(fake_rig_now_us());
}

// ---- the bus

static int errno_of(int error) {
    switch (error) {
        case ERROR_OK:
            return 0;
        case ERROR_I2C_NACK:
            return ENXIO;
        case ERROR_I2C_ARBITRATION:
            return EAGAIN;
        case ERROR_TIMEOUT:
            return ETIMEDOUT;
        case ERROR_I2C_STUCK:
            return EBUSY;
        default:
            return EIO;
    }
}

static int transfer(struct fake_i2c *self, const struct i2c_rdwr_ioctl_data *data) {
    struct hal_i2c_message messages[HAL_I2C_MESSAGES_MAX];
    if (data->nmsgs < 1 || data->nmsgs > HAL_I2C_MESSAGES_MAX) {
        return -EINVAL;
    }
    for (unsigned i = 0; i < data->nmsgs; i++) {
        const struct i2c_msg *message = &data->msgs[i];
        if (message->len < 1 || message->len > HAL_I2C_BYTES_MAX ||
            (message->flags & ~(unsigned)I2C_M_RD) != 0) {
            return -EOPNOTSUPP;
        }
        messages[i] = (struct hal_i2c_message){.address = (uint8_t)message->addr,
                                               .read = (message->flags & I2C_M_RD) != 0,
                                               .bytes = message->len,
                                               .data = message->buf};
    }
    size_t begun = 0;
    begin_asking();
    const uint64_t limit_us = backend.connection.now_us + self->timeout_10ms * TIMEOUT_UNIT_US;
    const int error =
        backend.i2c.operations->transfer(backend.i2c.self, messages, data->nmsgs, limit_us, &begun);
    end_asking();
    return error == ERROR_OK ? (int)data->nmsgs : -errno_of(error);
}

void fake_rig_i2c(const char *path) {
    bus = fake_i2c_add(path, 0);
    bus->transfer = transfer;
}

// ---- the port

static void fill(struct fake_video *self, const struct hal_camera_frame *frame) {
    const struct raw_image *image = &frame->image;
    const size_t values = (size_t)image->width_px * (size_t)image->height_px;
    uint8_t *bytes = malloc(2 * values);
    if (bytes == NULL) {
        stop("no memory for a frame");
    }
    for (size_t i = 0; i < values; i++) {
        bytes[2 * i] = (uint8_t)image->data[i];
        bytes[2 * i + 1] = (uint8_t)(image->data[i] >> 8);
    }
    const struct fake_video_frame filled = {.data = bytes,
                                            .bytes = 2 * values,
                                            .sequence = frame->sequence - first_number,
                                            .begin_us = FAKE_RIG_BEGIN_US + frame->begin_us,
                                            .end_us = FAKE_RIG_BEGIN_US + frame->end_us,
                                            .damaged = frame->faults != 0};
    fake_video_fill(self, &filled);
    free(bytes);
}

/// Arms the port while a buffer waits, and fills it with a complete frame.
static void look_at_port(struct fake_video *self) {
    const struct hal_camera *port = &backend.camera;
    begin_asking();
    if (!self->on && camera_runs) {
        port->operations->stop(port->self);
        camera_runs = false;
    }
    if (self->on && !camera_runs) {
        const struct hal_camera_format format = {(uint16_t)self->format.width_px,
                                                 (uint16_t)self->format.height_px};
        camera_runs = port->operations->start(port->self, &format) == ERROR_OK;
        ready_us = 0;
        first_number = 0;
    }
    struct hal_camera_frame frame;
    while (camera_runs && self->queued_count > 0 && backend.connection.now_us >= ready_us &&
           port->operations->take(port->self, 0, backend.connection.now_us, &frame) == ERROR_OK) {
        first_number = first_number == 0 ? frame.sequence : first_number;
        fill(self, &frame);
        raw_image_release(&frame.image);
        ready_us = backend.connection.now_us + DRIVER_BUSY_US;
    }
    end_asking();
}

void fake_rig_video(const char *path) {
    camera = fake_video_add(path, V4L2_PIX_FMT_SGRBG10, MT9T001_WIDTH_PX, MT9T001_HEIGHT_PX);
    camera->takes_any_size = true;
    camera->reports_frame_time = false;
    camera->time_flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
    camera->look = look_at_port;
}

// ---- the lens controller's line

static void send(const uint8_t *bytes, size_t count) {
    begin_asking();
    if (backend.uart.operations->write(backend.uart.self, bytes, count, UINT64_MAX) != ERROR_OK) {
        stop("its serial line");
    }
    end_asking();
}

static void look_at_line(struct fake_serial *self) {
    uint8_t bytes[256];
    size_t count = 0;
    begin_asking();
    while (backend.uart.operations->read(backend.uart.self, bytes, sizeof bytes,
                                         backend.connection.now_us, &count) == ERROR_OK) {
        fake_serial_receive(self, bytes, count);
    }
    end_asking();
}

void fake_rig_serial(const char *path) {
    serial = (struct fake_serial){.speed = LINE_BITS_PER_S, .send = send, .look = look_at_line};
    has_serial = true;
    fake_serial_add(path, &serial);
}

// ---- the lines

static void look_at_lines(struct fake_gpio *self) {
    bool high = false;
    begin_asking();
    if (backend.gpio.operations->get(backend.gpio.self, HAL_GPIO_BRIDGE_IRQ, &high) != ERROR_OK) {
        stop("its interrupt");
    }
    self->wire[irq_wire] = high;
    end_asking();
}

static void drive(struct fake_gpio *self, unsigned wire) {
    if (wire != reset_wire) {
        return;
    }
    begin_asking();
    if (backend.gpio.operations->set(backend.gpio.self, HAL_GPIO_BRIDGE_RESET, !self->wire[wire]) !=
        ERROR_OK) {
        stop("its reset");
    }
    end_asking();
}

void fake_rig_gpio(const char *path, unsigned reset_line, unsigned irq_line) {
    chip = fake_gpio_add(path);
    reset_wire = reset_line;
    irq_wire = irq_line;
    chip->wire[reset_wire] = true;  // pulled up by a resistor
    chip->look = look_at_lines;
    chip->drive = drive;
}

// ---- time

/// Does what interrupts would do, so that no event stays in the rig, where it would wake this code
/// again.
static void look_at_all(void) {
    if (camera != NULL) {
        look_at_port(camera);
    }
    if (has_serial) {
        look_at_line(&serial);
    }
}

void fake_rig_pass(uint64_t until_us, bool news) {
    const uint32_t wake =
        (has_serial ? SIMRIG_WAKE_SERIAL : 0U) | (camera_runs ? SIMRIG_WAKE_FRAME : 0U);
    begin_asking();
    const uint64_t end_us = rig_time_us(until_us);
    bool goes_on = true;
    while (goes_on) {
        look_at_all();
        const bool busy = camera_runs && backend.connection.now_us < ready_us;
        const uint64_t step_us = busy && ready_us < end_us ? ready_us : end_us;
        uint32_t woken = 0;
        if (sim_connection_advance(&backend.connection, step_us, wake, &woken) != ERROR_OK) {
            stop("it has gone");
        }
        goes_on = woken != 0 ? !news : step_us < end_us;
    }
    look_at_all();
    end_asking();
}
