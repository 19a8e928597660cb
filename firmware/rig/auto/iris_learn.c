// SPDX-License-Identifier: Apache-2.0
#include "rig/auto/iris_learn.h"

#include <math.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "device/mt9t001.h"
#include "focus/exposure_measure.h"
#include "rig/base/poll.h"
#include "rig/base/rig_clock.h"
#include "rig/base/rig_error.h"
#include "rig/lens_read.h"
#include "rig/rig_optics.h"
#include "rig/rig_region.h"

enum {
    FRAMES = 4,
    FLICKER_US = 10000,
    // Of shorter exposures more frames are averaged, at different phases of the flicker.
    FRAMES_SHORT = 16,
    PERCENT = 100,
};

// As parts of full scale: darker frames get a longer exposure, the longest ones may be this dark.
static const double dark = 0.2, darkest = 0.008, bright = 0.75;
// The light may change by this, and a reading of it is wrong by this.
static const double light_change = 0.05, light_error = 0.01;

static const uint32_t exposures_us[] = {100,   200,   500,    1000,   2000,   5000,   10000,
                                        20000, 50000, 100000, 200000, 500000, 1000000};

enum { EXPOSURES = sizeof exposures_us / sizeof exposures_us[0], EXPOSURE_FIRST = 6 };

struct learner {
    struct rig *rig;
    unsigned side;
    struct rig_region region;
    unsigned exposure;  // index
    uint32_t applied_us;
};

static enum rig_part part_of(const struct learner *self) {
    return rig_part_of(self->rig->profile.bridge ? RIG_PART_LEFT_SENSOR : RIG_PART_LEFT_CAMERA,
                       self->side);
}

// ---- light

static int expose(struct learner *self, unsigned exposure) {
    INVARIANT(exposure < EXPOSURES);
    self->exposure = exposure;
    return rig_region_exposure(self->rig, &self->region, exposures_us[exposure], &self->applied_us);
}

// Mean of some frames from now on.
static int measure(struct learner *self, struct exposure_measure *measured) {
    struct exposure_histogram histogram;
    const unsigned frames = exposures_us[self->exposure] < FLICKER_US ? FRAMES_SHORT : FRAMES;
    uint64_t since_us = rig_now_us(self->rig);
    for (unsigned i = 0; i < frames; i++) {
        struct rig_region_frame frame;
        const int error = rig_region_take(self->rig, &self->region, since_us, &frame);
        if (error != ERROR_OK) {
            return error;
        }
        const struct raw_image *image = &frame.image;
        if (i == 0) {
            exposure_histogram_begin(&histogram, image->layout, (int)image->bits, frame.black);
        }
        for (int y = 0; y < (int)image->height_px; y++) {
            exposure_histogram_row(&histogram, image->data + (size_t)y * (size_t)image->stride,
                                   (int)image->width_px, y);
        }
        raw_image_release(&frame.image);
        // Phases of the flicker a third of a period apart.
        since_us += frames == FRAMES_SHORT ? FLICKER_US / 3 : 0;
    }
    *measured = exposure_histogram_end(&histogram);
    return ERROR_OK;
}

static bool is_too_bright(const struct exposure_measure *measured) {
    return measured->saturated > EXPOSURE_SATURATED_MAX || measured->mean > bright;
}

// The longest exposure that is not too bright, for a reading that is too dark.
static unsigned longer(const struct learner *self, double mean) {
    unsigned next = self->exposure;
    while (next + 1 < EXPOSURES &&
           mean * exposures_us[next + 1] < bright * exposures_us[self->exposure] / 2) {
        next++;
    }
    return next;
}

// Light of one microsecond at the present iris.
static int read_light(struct learner *self, double *light) {
    struct exposure_measure measured;
    int error = measure(self, &measured);
    while (error == ERROR_OK && is_too_bright(&measured)) {
        if (self->exposure == 0) {
            return rig_reject(self->rig, part_of(self), ERROR_RANGE,
                              "too bright to learn the iris, even with the shortest exposure (dim "
                              "the light, or aim at something darker)",
                              NULL);
        }
        error = expose(self, self->exposure - 1);
        error = error == ERROR_OK ? measure(self, &measured) : error;
    }
    if (error == ERROR_OK && measured.mean < dark) {
        const unsigned next = longer(self, measured.mean);
        if (next != self->exposure) {
            error = expose(self, next);
            error = error == ERROR_OK ? measure(self, &measured) : error;
        }
    }
    if (error == ERROR_OK && measured.mean < darkest) {
        error =
            rig_reject(self->rig, part_of(self), ERROR_RANGE,
                       "too dark to learn the iris, even with an exposure of 1 s (add light, or "
                       "aim at something bright)",
                       NULL);
    }
    if (error == ERROR_OK) {
        *light = measured.mean / self->applied_us;
    }
    return error;
}

// ---- the iris

static void report(const struct learner *self, unsigned done) {
    const struct rig_observer *observer = &self->rig->observer;
    if (observer->progress != NULL) {
        observer->progress(observer->self, "learning the iris", done, RIG_IRIS_LEARN_POINTS + 1);
    }
}

static int move_iris(struct learner *self, int32_t position) {
    return rig_lens_move_to(self->rig, 1u << self->side, LENS_IRIS, position);
}

// Whether the light at the open end is still the same.
static int check_light(struct learner *self, int32_t position, double before) {
    double light = 0;
    int error = move_iris(self, position);
    error = error == ERROR_OK ? expose(self, EXPOSURE_FIRST) : error;
    error = error == ERROR_OK ? read_light(self, &light) : error;
    if (error == ERROR_OK && fabs(light / before - 1) > light_change) {
        const int32_t percent = (int32_t)(fabs(light / before - 1) * PERCENT + 0.5);
        error = rig_reject(self->rig, part_of(self), ERROR_MOVED,
                           "the light has changed by # % meanwhile (run iris learn again with "
                           "constant light)",
                           &percent);
    }
    return error;
}

// Reads the light at each step, from open to closed.
static int learn(struct learner *self, struct lens_table *table) {
    const struct lens_axis_settings *axis = &self->rig->profile.lens.axis[LENS_IRIS];
    double open = 0, ratio = 1;
    for (int i = 0; i < RIG_IRIS_LEARN_POINTS; i++) {
        const int32_t position =
            axis->max - (axis->max - axis->min) * i / (RIG_IRIS_LEARN_POINTS - 1);
        double light = 0;
        report(self, (unsigned)i);
        int error = move_iris(self, position);
        if (error != ERROR_OK) {
            return error;
        }
        error = read_light(self, &light);
        if (error != ERROR_OK) {
            return error;
        }
        open = i == 0 ? light : open;
        // It only closes: the rest is noise.
        ratio = math_max(ratio, sqrt(open / light));
        const struct lens_point point = {
            .at = position,
            .value = (int32_t)(math_min(ratio, LENS_RATIO_ONE) * LENS_RATIO_ONE + 0.5),
            .sigma =
                (uint16_t)(math_min(ratio, LENS_RATIO_ONE / 20) * LENS_RATIO_ONE * light_error),
            .count = 1};
        lens_table_put(table, &point);
    }
    report(self, RIG_IRIS_LEARN_POINTS);
    return check_light(self, axis->max, open);
}

static struct rig_rectangle middle_of(const struct rig *self) {
    const bool bridge = self->profile.bridge;
    const int size_px = RIG_IRIS_LEARN_REGION_PX;
    const int width_px = bridge ? MT9T001_WIDTH_PX : self->format.width_px;
    const int height_px = bridge ? MT9T001_HEIGHT_PX : self->format.height_px;
    const int wide = width_px < size_px ? width_px / 2 * 2 : size_px;
    const int high = height_px < size_px ? height_px / 2 * 2 : size_px;
    return (struct rig_rectangle){.column_px = (uint16_t)((width_px - wide) / 4 * 2),
                                  .row_px = (uint16_t)((height_px - high) / 4 * 2),
                                  .width_px = (uint16_t)wide,
                                  .height_px = (uint16_t)high};
}

static int learn_in_region(struct learner *self, struct lens_table *table) {
    const struct rig_rectangle region_px = middle_of(self->rig);
    uint16_t applied_q3 = 0;
    int error = rig_region_begin(self->rig, &self->region, self->side, &region_px, 1);
    if (error != ERROR_OK) {
        return error;
    }
    error = rig_region_gain(self->rig, &self->region, MT9T001_GAIN_Q3_MIN, &applied_q3);
    error = error == ERROR_OK ? expose(self, EXPOSURE_FIRST) : error;
    error = error == ERROR_OK ? learn(self, table) : error;
    const int ended = rig_region_end(self->rig, &self->region, false);
    return error == ERROR_OK ? ended : error;
}

// Brings the iris back, also from a scene that cannot be measured; `error`: of the measurement.
static int go_back(struct learner *self, int32_t position, int error) {
    const struct rig_error rejected = self->rig->rejected;
    if (error != ERROR_OK && error != ERROR_RANGE && error != ERROR_MOVED) {
        return error;
    }
    const int back = move_iris(self, position);
    self->rig->rejected = rejected;
    return error == ERROR_OK ? back : error;
}

int rig_iris_learn(struct rig *self, unsigned side) {
    struct learner learner = {.rig = self, .side = side};
    struct lens_table table = {.count = 0};
    int32_t positions[LENS_AXES], before = 0;
    int error = lens_read_ready(self, side < RIG_SIDES ? 1u << side : 0, LENS_IRIS);
    if (error != ERROR_OK) {
        return error;
    }
    error = rig_lens_read(self, side, positions);
    if (error != ERROR_OK) {
        return error;
    }
    error = rig_optics_position(self, side, LENS_IRIS, &before);
    if (error != ERROR_OK) {
        return error;
    }
    error = go_back(&learner, before, learn_in_region(&learner, &table));
    if (error == ERROR_OK) {
        self->camera[side].lens.learned.iris = table;
    }
    return error;
}
