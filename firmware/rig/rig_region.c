// SPDX-License-Identifier: Apache-2.0
#include "rig/rig_region.h"

#include "core/error.h"
#include "core/invariant.h"
#include "rig/base/health.h"
#include "rig/base/poll.h"
#include "rig/base/rig_clock.h"
#include "rig/base/rig_error.h"
#include "rig/rig_camera.h"
#include "rig/safe.h"
#include "rig/trigger.h"

enum {
    FRAME_ATTEMPTS = 2,
    // At gain 1: full well 8500 electrons in 981 values of 10 bits, read noise 8 electrons, and
    // that of rounding.
    SENSOR_BITS = 10,
    SHOT_Q16 = 7563,
    READ_Q8 = 240,
};

// Nothing has moved here, so a bad frame does not make the rig safe.
static int end_call(struct rig *self, int error) {
    const bool harmless = error == ERROR_OK || error == ERROR_CANCELLED || error == ERROR_FRAME ||
                          error == ERROR_MEMORY;
    return harmless ? rig_end(self, error) : rig_fail_safe(self, error);
}

static int reject(struct rig *self, unsigned side, const struct rig_rectangle *where_px,
                  uint16_t width_px, uint16_t height_px, unsigned skip) {
    const int32_t numbers[] = {
        where_px->width_px, where_px->height_px, where_px->column_px, where_px->row_px,
        width_px,           height_px,           (int32_t)(2u * skip)};
    return rig_reject(self, rig_part_of(RIG_PART_LEFT_CAMERA, side), ERROR_RANGE,
                      "region # x # at #, # is not within # x # px in steps of #", numbers);
}

static int set_expected(struct rig *self, uint16_t width_px, uint16_t height_px) {
    const int error =
        rig_bridge_used(self, fpga_bridge_camera_expect(&self->bridge, width_px, height_px));
    return error == ERROR_OK ? ERROR_OK : rig_fail_safe(self, error);
}

static int set_port(struct rig *self, const struct hal_camera_format *format) {
    int error = rig_camera_stop(self);
    if (error == ERROR_OK) {
        error = rig_camera_start(self, format);
    }
    return error == ERROR_OK ? ERROR_OK : rig_fail_safe(self, error);
}

static int read_black(struct rig *self, struct rig_region *region) {
    const enum rig_part part = rig_part_of(RIG_PART_LEFT_SENSOR, region->side);
    const int error = rig_part_used(
        self, part, mt9t001_black(&self->camera[region->side].sensor, &region->black));
    return error == ERROR_OK ? ERROR_OK : rig_fail_safe(self, rig_bus_failed(self, part, error));
}

// Passes this camera's frames.
static int choose(struct rig *self, struct rig_region *region) {
    const unsigned side = region->side;
    int error = rig_camera_choose(self, side);
    if (error == ERROR_OK) {
        // The first frame of another size counts as a wrong one.
        error = rig_wait_until(self, self->camera[side].settled_at_us);
    }
    if (error == ERROR_OK) {
        error =
            rig_bridge_used(self, fpga_bridge_camera_read(&self->bridge, side, &region->counted));
    }
    // The port may still hold a frame of the other camera.
    region->counted_us = rig_now_us(self);
    return end_call(self, error);
}

// The bridge compares each camera's frames with its previous ones meanwhile, since the two cameras
// have different sizes.
static int begin_sensor(struct rig *self, struct rig_region *region,
                        const struct mt9t001_window *window) {
    const unsigned side = region->side;
    struct mt9t001 *sensor = &self->camera[side].sensor;
    const struct hal_camera_format format = {(uint16_t)(window->width_px / window->skip),
                                             (uint16_t)(window->height_px / window->skip)};
    const uint64_t before_us = rig_camera_frame_us(self, side);
    int error = read_black(self, region);
    if (error == ERROR_OK) {
        error = set_expected(self, 0, 0);
    }
    if (error != ERROR_OK) {
        return error;
    }
    error = mt9t001_set_window(sensor, window);
    rig_camera_note_exposure(self, side);
    error = rig_camera_sensor_was_set(self, side, before_us, error);
    if (error == ERROR_OK) {
        error = set_port(self, &format);
    }
    if (error != ERROR_OK) {
        return error;
    }
    return choose(self, region);
}

static struct mt9t001_window window_of(const struct rig_rectangle *where_px, uint8_t skip) {
    return (struct mt9t001_window){
        .column_px = where_px->column_px,
        .row_px = where_px->row_px,
        .width_px = where_px->width_px,
        .height_px = where_px->height_px,
        .skip = skip,
        .bin = 1,
        .hblank_clocks = MT9T001_HBLANK_CLOCKS_MIN,
        .vblank_rows = MT9T001_VBLANK_ROWS_MIN,
    };
}

static bool is_in_frame(const struct rig_rectangle *where_px,
                        const struct hal_camera_format *format) {
    const unsigned odd =
        where_px->column_px | where_px->row_px | where_px->width_px | where_px->height_px;
    return odd % 2 == 0 && where_px->width_px > 0 && where_px->height_px > 0 &&
           where_px->column_px + where_px->width_px <= format->width_px &&
           where_px->row_px + where_px->height_px <= format->height_px;
}

int rig_region_begin(struct rig *self, struct rig_region *region, unsigned side,
                     const struct rig_rectangle *where_px, uint8_t skip) {
    INVARIANT(side < RIG_SIDES && region != NULL);
    *region = (struct rig_region){.running = false};
    if (self->state != RIG_READY) {
        return ERROR_NOT_READY;
    }
    const struct rig_camera *camera = &self->camera[side];
    const bool bridge = self->profile.bridge;
    const struct mt9t001_window window = window_of(where_px, bridge ? skip : 1);
    struct mt9t001_timing timing;
    if (bridge && mt9t001_timing_of(&window, 1, camera->sensor.clock_hz, &timing) != ERROR_OK) {
        return reject(self, side, where_px, MT9T001_WIDTH_PX, MT9T001_HEIGHT_PX, skip);
    }
    if (!bridge && !is_in_frame(where_px, &self->format)) {
        return reject(self, side, where_px, self->format.width_px, self->format.height_px, 1);
    }
    *region = (struct rig_region){
        .running = true,
        .side = side,
        .where_px = *where_px,
        .skip = window.skip,
        .sensor = camera->sensor,
        .format = self->format,
        .exposure_us = camera->exposure_us,
        .initial_exposure_us = camera->initial_exposure_us,
        .gain_q3 = camera->gain_q3,
        .initial_gain_q3 = camera->initial_gain_q3,
    };
    const int error = bridge ? begin_sensor(self, region, &window) : ERROR_OK;
    if (error != ERROR_OK) {
        (void)rig_region_end(self, region, false);
    }
    return error;
}

int rig_region_choose(struct rig *self, struct rig_region *region) {
    INVARIANT(region->running);
    if (self->state != RIG_READY) {
        return ERROR_NOT_READY;
    }
    return self->profile.bridge ? choose(self, region) : ERROR_OK;
}

// Takes one frame, with its faults.
static int take_one(struct rig *self, struct rig_region *region, uint64_t begin_us,
                    struct hal_camera_frame *frame) {
    const unsigned side = region->side;
    if (!self->profile.bridge) {
        return rig_camera_take(self, side, begin_us, frame);
    }
    int error = rig_camera_wait(
        self, side, begin_us > region->counted_us ? begin_us : region->counted_us, frame);
    if (error != ERROR_OK) {
        return error;
    }
    const struct fpga_bridge_camera before = region->counted;
    error = rig_bridge_used(self, fpga_bridge_camera_read(&self->bridge, side, &region->counted));
    if (error != ERROR_OK) {
        raw_image_release(&frame->image);
        return error;
    }
    frame->faults |= rig_camera_counted(&before, &region->counted);
    if (frame->faults != 0) {
        // What was counted may be of the next frame, which is then under way.
        region->counted_us = rig_now_us(self);
    }
    return ERROR_OK;
}

// A part of a frame has the pixels of the frame.
static struct raw_image part_of(const struct raw_image *image,
                                const struct rig_rectangle *where_px) {
    struct raw_image part = *image;
    const size_t values = raw_image_row_values(image) / (size_t)image->width_px;
    INVARIANT(where_px->column_px + where_px->width_px <= image->width_px);
    INVARIANT(where_px->row_px + where_px->height_px <= image->height_px);
    part.data = raw_image_row(image, where_px->row_px) + values * where_px->column_px;
    part.width_px = where_px->width_px;
    part.height_px = where_px->height_px;
    return part;
}

int rig_region_take(struct rig *self, struct rig_region *region, uint64_t not_before_us,
                    struct rig_region_frame *frame) {
    INVARIANT(region->running);
    if (self->state != RIG_READY) {
        return ERROR_NOT_READY;
    }
    const unsigned side = region->side;
    const uint32_t exposure_us = rig_camera_exposure_us(self, side);
    struct hal_camera_frame taken = {.faults = 0};
    for (int attempt = 0; attempt < FRAME_ATTEMPTS; attempt++) {
        int error = take_one(self, region, not_before_us + exposure_us, &taken);
        if (error != ERROR_OK) {
            return end_call(self, error);
        }
        error = rig_camera_check_size(self, side, &taken.image);
        if (error != ERROR_OK || taken.faults != 0) {
            raw_image_release(&taken.image);
        }
        if (error != ERROR_OK) {
            return end_call(self, error);
        }
        if (taken.faults != 0) {
            continue;
        }
        // A row is read out at the end of its exposure.
        const uint64_t read_us = taken.begin_us + (taken.end_us - taken.begin_us) / 2;
        INVARIANT(taken.end_us >= taken.begin_us);
        *frame = (struct rig_region_frame){
            .image = self->profile.bridge ? taken.image : part_of(&taken.image, &region->where_px),
            .exposed_us = read_us - exposure_us / 2,
            .exposure_us = exposure_us,
            .gain_q3 = rig_camera_gain_q3(self, side),
            .black = region->black,
        };
        return ERROR_OK;
    }
    return end_call(self, rig_camera_torn(self, side, taken.faults));
}

int rig_region_exposure(struct rig *self, struct rig_region *region, uint32_t exposure_us,
                        uint32_t *applied_us) {
    INVARIANT(region->running);
    return rig_exposure(self, 1u << region->side, exposure_us, applied_us);
}

int rig_region_gain(struct rig *self, struct rig_region *region, uint16_t gain_q3,
                    uint16_t *applied_q3) {
    INVARIANT(region->running);
    return rig_gain(self, 1u << region->side, gain_q3, applied_q3);
}

static int end_sensor(struct rig *self, const struct rig_region *region, bool keep_settings) {
    const unsigned side = region->side;
    struct mt9t001 *sensor = &self->camera[side].sensor;
    const uint64_t before_us = rig_camera_frame_us(self, side);
    int error = keep_settings ? mt9t001_set_window(sensor, &region->sensor.window)
                              : mt9t001_set_like(sensor, &region->sensor);
    rig_camera_note_exposure(self, side);
    self->camera[side].gain_q3 = sensor->gain_q3;
    error = rig_camera_sensor_was_set(self, side, before_us, error);
    if (error == ERROR_OK) {
        error = set_expected(self, region->format.width_px, region->format.height_px);
    }
    return error == ERROR_OK ? set_port(self, &region->format) : error;
}

// The camera keeps its settings over a bring-up, so they are put back in the safe state too. One
// that was not known before stays.
static int end_own_port(struct rig *self, const struct rig_region *region) {
    const unsigned side = region->side;
    struct rig_camera *camera = &self->camera[side];
    const uint32_t exposure_us =
        region->exposure_us != 0 ? region->exposure_us : region->initial_exposure_us;
    const uint16_t gain_q3 = region->gain_q3 != 0 ? region->gain_q3 : region->initial_gain_q3;
    const struct rig_error last_error = self->last_error;
    const bool safe = self->state != RIG_READY;
    int error = ERROR_OK;
    if (exposure_us != 0 && exposure_us != rig_camera_exposure_us(self, side)) {
        uint32_t applied_us = 0;
        error = rig_camera_set_exposure(self, side, exposure_us, &applied_us);
    }
    if (error == ERROR_OK) {
        camera->exposure_us = region->exposure_us;
        camera->initial_exposure_us = region->initial_exposure_us;
    }
    if (error == ERROR_OK && gain_q3 != 0 && gain_q3 != rig_camera_gain_q3(self, side)) {
        error = rig_camera_set_gain(self, side, gain_q3);
    }
    if (error == ERROR_OK) {
        camera->gain_q3 = region->gain_q3;
        camera->initial_gain_q3 = region->initial_gain_q3;
    }
    if (safe) {
        self->last_error = last_error;  // why it is safe
    }
    return safe ? ERROR_OK : error;
}

int rig_region_end(struct rig *self, struct rig_region *region, bool keep_settings) {
    if (!region->running) {
        return ERROR_OK;
    }
    region->running = false;
    if (!self->profile.bridge) {
        return keep_settings ? ERROR_OK : end_own_port(self, region);
    }
    return self->state == RIG_READY ? end_sensor(self, region, keep_settings) : ERROR_OK;
}

struct focus_noise rig_region_noise(const struct rig_region_frame *frame, bool gain_is_factor) {
    const int bits = frame->image.bits;
    const int fewer_bits = bits < SENSOR_BITS ? SENSOR_BITS - bits : 0;
    const bool known = gain_is_factor && frame->gain_q3 > 0;
    const struct focus_noise unity = {frame->black, READ_Q8 >> 2 * fewer_bits,
                                      SHOT_Q16 >> fewer_bits};
    return focus_noise_at(&unity, known ? frame->gain_q3 : MT9T001_GAIN_Q3_MIN);
}
