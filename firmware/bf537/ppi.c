// SPDX-License-Identifier: Apache-2.0
// Hardware Reference chapters 5 (DMA) and 15 (PPI). A frame is one two-dimensional transfer that
// the frame's sync begins.
#include "bf537/ppi.h"

#include <stdbool.h>

#include "bf537/clock.h"
#include "bf537/mmr.h"
#include "core/error.h"
#include "core/invariant.h"

enum { SENSOR_BITS = 10, POLL_US = 100, SIDE_MAX = 32767 };

struct slot {
    uint16_t *data;
    volatile bool used;
};

static struct port {
    struct slot slots[BF537_FRAMES];
    uint8_t *memory;
    size_t bytes;
    struct hal_camera_format format;
    struct hal_camera_counts counts;
    uint32_t sequence;
    bool started;
    struct slot *filling;  // of the transfer that runs, or NULL
    uint64_t since_us;     // its start
} port;

static void stop_transfer(void) {
    PPI_CONTROL = 0;
    DMA0_CONFIG = 0;
    DMA0_IRQ_STATUS = DMA_DONE | DMA_ERROR;  // which else would end every sleep
    ssync();
    port.filling = NULL;
}

static int start(void *self, const struct hal_camera_format *format) {
    (void)self;
    const size_t frame = (size_t)format->width_px * format->height_px * sizeof(uint16_t);
    if (frame == 0 || format->width_px > SIDE_MAX || format->height_px > SIDE_MAX ||
        2 * frame > port.bytes) {
        return ERROR_UNSUPPORTED;
    }
    stop_transfer();
    port.format = *format;
    port.started = true;
    return ERROR_OK;
}

static int stop(void *self) {
    (void)self;
    port.started = false;
    stop_transfer();
    return ERROR_OK;
}

static void release(void *owner) {
    struct slot *slot = owner;
    slot->used = false;
}

/// A slot for a frame of the present size, of those that do not overlap used ones.
static struct slot *free_slot(void) {
    const size_t values = (size_t)port.format.width_px * port.format.height_px;
    bool used = false;
    for (int i = 0; i < BF537_FRAMES; i++) {
        used |= port.slots[i].used;
    }
    // The layout changes with the size of frames, once none is used.
    for (int i = 0; !used && i < BF537_FRAMES; i++) {
        const bool fits = (size_t)(i + 1) * values * sizeof(uint16_t) <= port.bytes;
        uint8_t *at = port.memory + (size_t)i * values * sizeof(uint16_t);
        port.slots[i].data = fits ? (uint16_t *)(void *)at : NULL;
    }
    for (int i = 0; i < BF537_FRAMES; i++) {
        struct slot *slot = &port.slots[i];
        const struct slot *next = i + 1 < BF537_FRAMES ? slot + 1 : NULL;
        const uint8_t *end = next != NULL && next->data != NULL ? (const uint8_t *)next->data
                                                                : port.memory + port.bytes;
        if (!slot->used && slot->data != NULL &&
            values * sizeof(uint16_t) <= (size_t)(end - (const uint8_t *)slot->data)) {
            return slot;
        }
    }
    return NULL;
}

static void begin_transfer(struct slot *slot) {
    stop_transfer();
    PPI_STATUS = 0xFFFF;
    PPI_COUNT = (uint16_t)(port.format.width_px - 1);
    PPI_FRAME = port.format.height_px;
    DMA0_START_ADDR = (uint32_t)(uintptr_t)slot->data;
    DMA0_X_COUNT = port.format.width_px;
    DMA0_X_MODIFY = sizeof(uint16_t);
    DMA0_Y_COUNT = port.format.height_px;
    DMA0_Y_MODIFY = sizeof(uint16_t);
    // DMA_DONE is the channel's request of an interrupt, which stays masked.
    DMA0_CONFIG = DMA_ENABLE | DMA_TO_MEMORY | DMA_16_BITS | DMA_2D | DMA_INTERRUPT;
    PPI_CONTROL = PPI_ENABLE | PPI_NO_ITU | PPI_TWO_SYNCS | PPI_10_BITS;
    ssync();
    port.filling = slot;
    port.since_us = bf537_now_us();
}

static uint32_t faults_of(uint16_t status) {
    return ((status & PPI_LINE_ERROR) != 0 ? HAL_CAMERA_SHORT_LINE : 0u) |
           ((status & PPI_FRAME_ERROR) != 0 ? HAL_CAMERA_SHORT : 0u) |
           ((status & PPI_OVERFLOW) != 0 ? HAL_CAMERA_DAMAGED : 0u);
}

/// Waits for the frame of the transfer that runs. It goes on after ERROR_TIMEOUT: the caller waits
/// in steps that may be shorter than a frame.
static int receive(uint64_t deadline_us, uint32_t *faults) {
    for (;;) {
        const uint16_t status = DMA0_IRQ_STATUS;
        const uint64_t now_us = bf537_now_us();
        if ((status & (DMA_DONE | DMA_ERROR)) != 0) {
            *faults = faults_of(PPI_STATUS);
            stop_transfer();
            return (status & DMA_ERROR) != 0 ? ERROR_IO : ERROR_OK;
        }
        if (now_us >= deadline_us) {
            return ERROR_TIMEOUT;
        }
        bf537_sleep_until_us(now_us + POLL_US < deadline_us ? now_us + POLL_US : deadline_us);
    }
}

/// Starts a transfer at `not_before_us`, unless one runs that was started then or later.
static int begin(uint64_t not_before_us, uint64_t deadline_us) {
    if (port.filling != NULL && port.since_us >= not_before_us) {
        return ERROR_OK;
    }
    stop_transfer();
    struct slot *slot = free_slot();
    if (slot == NULL) {
        return ERROR_MEMORY;
    }
    while (bf537_now_us() < not_before_us) {
        if (bf537_now_us() >= deadline_us) {
            return ERROR_TIMEOUT;
        }
        bf537_sleep_until_us(not_before_us < deadline_us ? not_before_us : deadline_us);
    }
    begin_transfer(slot);
    return ERROR_OK;
}

static int take(void *self, uint64_t not_before_us, uint64_t deadline_us,
                struct hal_camera_frame *frame) {
    (void)self;
    if (!port.started) {
        return ERROR_UNSUPPORTED;
    }
    int error = begin(not_before_us, deadline_us);
    if (error != ERROR_OK) {
        return error;
    }
    struct slot *slot = port.filling;
    struct hal_camera_frame got = {.begin_us = port.since_us,
                                   .image = {.data = slot->data,
                                             .width_px = port.format.width_px,
                                             .height_px = port.format.height_px,
                                             .stride = port.format.width_px,
                                             .bits = SENSOR_BITS,
                                             .layout = RAW_BAYER_GRBG,
                                             .release = release,
                                             .owner = slot}};
    error = receive(deadline_us, &got.faults);
    port.counts.timeouts += error == ERROR_TIMEOUT;
    if (error != ERROR_OK) {
        return error;
    }
    slot->used = true;
    got.end_us = bf537_now_us();
    got.sequence = port.sequence++;
    port.counts.frames++;
    port.counts.faulty += got.faults != 0;
    *frame = got;
    return ERROR_OK;
}

static void counts(void *self, struct hal_camera_counts *out) {
    (void)self;
    *out = port.counts;
}

const struct hal_camera *bf537_ppi_open(void *memory, size_t bytes) {
    static const struct hal_camera_operations operations = {start, stop, take, NULL, counts};
    static const struct hal_camera camera = {&operations, NULL};
    INVARIANT(memory != NULL && (uintptr_t)memory % sizeof(uint32_t) == 0);
    port = (struct port){.memory = memory, .bytes = bytes};
    return &camera;
}
