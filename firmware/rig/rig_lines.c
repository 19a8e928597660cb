// SPDX-License-Identifier: Apache-2.0
#include "core/error.h"
#include "core/invariant.h"
#include "rig/base/health.h"
#include "rig/base/rig_clock.h"
#include "rig/base/rig_error.h"
#include "rig/rig_camera.h"
#include "rig/trigger.h"

enum {
    WIDTH_PX = 64,
    HEIGHT_PX = 48,
    EXPOSURE_ROWS = 1,
    BITS = 10,
    ALL = (1 << BITS) - 1,
    EVEN = 0x155,
    ODD = 0x2AA,
    ATTEMPTS = 3,
};

// Bits that were 0 where a 1 was sent, or vice versa.
struct wrong {
    uint16_t low, high;
};

static int of_sensor(struct rig *self, unsigned side, int error) {
    const enum rig_part part = rig_part_of(RIG_PART_LEFT_SENSOR, side);
    rig_part_used(self, part, error);
    return error == ERROR_OK ? ERROR_OK : rig_bus_failed(self, part, error);
}

static int set_small_window(struct rig *self, unsigned side) {
    struct mt9t001 *sensor = &self->camera[side].sensor;
    struct mt9t001_window window;
    const uint64_t before_us = rig_camera_frame_us(self, side);
    int error = mt9t001_centred_window(WIDTH_PX, HEIGHT_PX, 1, 1, &window);
    INVARIANT(error == ERROR_OK);
    error = of_sensor(self, side, mt9t001_set_window(sensor, &window));
    if (error == ERROR_OK) {
        error = of_sensor(self, side, mt9t001_set_shutter(sensor, EXPOSURE_ROWS));
    }
    // In the new window a frame with the old exposure may take as long as before.
    rig_camera_unsettle(self, side, 2 * before_us);
    if (error != ERROR_OK) {
        return error;
    }
    error = rig_part_used(self, RIG_PART_BRIDGE,
                          fpga_bridge_camera_expect(&self->bridge, WIDTH_PX, HEIGHT_PX));
    if (error == ERROR_OK) {
        error =
            rig_part_used(self, RIG_PART_BRIDGE, fpga_bridge_camera_stream(&self->bridge, true));
    }
    return error == ERROR_OK ? ERROR_OK : rig_bus_failed(self, RIG_PART_BRIDGE, error);
}

static bool is_whole(const struct hal_camera_frame *frame) {
    return frame->faults == 0 && frame->image.width_px == WIDTH_PX &&
           frame->image.height_px == HEIGHT_PX;
}

static void compare(const struct hal_camera_frame *frame, uint16_t sent, struct wrong *wrong) {
    INVARIANT(is_whole(frame));
    for (int row = 0; row < HEIGHT_PX; row++) {
        const uint16_t *values = raw_image_row(&frame->image, row);
        for (unsigned column = 0; column < WIDTH_PX; column++) {
            wrong->low |= (uint16_t)(sent & ~values[column]);
            wrong->high |= (uint16_t)(~sent & values[column] & ALL);
        }
    }
}

// Takes a complete frame with this value.
static int send(struct rig *self, unsigned side, uint16_t value, struct wrong *wrong) {
    int error = of_sensor(self, side, mt9t001_set_test_data(&self->camera[side].sensor, value));
    rig_camera_unsettle(self, side, rig_camera_frame_us(self, side));
    for (int attempt = 0; attempt < ATTEMPTS && error == ERROR_OK; attempt++) {
        struct hal_camera_frame frame;
        error = rig_camera_take(self, side, rig_now_us(self), &frame);
        if (error != ERROR_OK) {
            return error;
        }
        const bool whole = is_whole(&frame);
        if (whole) {
            compare(&frame, value, wrong);
        }
        raw_image_release(&frame.image);
        if (whole) {
            return ERROR_OK;
        }
    }
    if (error != ERROR_OK) {
        return error;
    }
    const enum rig_part part = rig_part_of(RIG_PART_LEFT_CAMERA, side);
    rig_part_used(self, part, ERROR_FRAME);
    return rig_part_error(
        self, part, ERROR_FRAME,
        "its frames are damaged (check its cable: PIXCLK, LINE_VALID, FRAME_VALID)", NULL);
}

static int lowest_bit(uint16_t bits) {
    int bit = 0;
    INVARIANT(bits != 0);
    while ((bits >> bit & 1) == 0) {
        bit++;
    }
    return bit;
}

static const char *describe(const struct wrong *wrong) {
    if ((wrong->low & wrong->high) != 0) {
        return "data line # is unstable (check its cable)";
    }
    if (wrong->low != 0) {
        return "data line # always reads 0 (check its cable)";
    }
    return "data line # always reads 1 (check its cable)";
}

static int report(struct rig *self, unsigned side, const struct wrong *wrong) {
    const enum rig_part part = rig_part_of(RIG_PART_LEFT_CAMERA, side);
    const uint16_t all = wrong->low | wrong->high;
    const int32_t number = lowest_bit(all);
    rig_part_used(self, part, ERROR_VERIFY);
    return rig_part_error(self, part, ERROR_VERIFY, describe(wrong), &number);
}

int rig_lines_check(struct rig *self, unsigned side) {
    const struct hal_camera_format format = {WIDTH_PX, HEIGHT_PX};
    struct wrong wrong = {0, 0};
    int error = set_small_window(self, side);
    if (error == ERROR_OK && !self->camera[RIG_LEFT].streaming) {
        error = rig_camera_start(self, &format);
    }
    if (error == ERROR_OK) {
        error = send(self, side, EVEN, &wrong);
    }
    if (error == ERROR_OK) {
        error = send(self, side, ODD, &wrong);
    }
    if (error != ERROR_OK) {
        return error;
    }
    return (wrong.low | wrong.high) != 0 ? report(self, side, &wrong) : ERROR_OK;
}
