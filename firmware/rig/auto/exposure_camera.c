// SPDX-License-Identifier: Apache-2.0
#include "rig/auto/exposure_camera.h"

#include "core/error.h"
#include "core/invariant.h"
#include "rig/base/poll.h"
#include "rig/base/rig_clock.h"
#include "rig/lens_move.h"
#include "rig/rig_camera.h"

enum {
    NS_PER_US = 1000,
    NS_PER_S = 1000000000,
    // A field is thinned as long as it has this many pixels.
    FIELD_WIDTH_PX = 96,
    FIELD_HEIGHT_PX = 72,
    SHARED_SCALE = 3,    // the shared field has so many times more
    SHARED_PERIODS = 2,  // mains periods that a measurement of the shared field covers
    SKIP_MAX = 8,
    // More gain is digital: it only loses range.
    GAIN_MAX_Q3 = 64,
    FRAMES_MAX = 32,  // largest number of frames in one measurement
    SPREAD_FRAMES = 4,
    // A pair behind the bridge is taken within four frame periods and this time; see rig/pair.h.
    PAIR_FRAMES = 4,
    PAIR_US = 20000,
    EXPOSURE_MAX_US = 1000000,
    UVC_STEP_US = 100,
};

static double gain_of(uint16_t gain_q3) {
    return (double)gain_q3 / MT9T001_GAIN_Q3_MIN;
}

double exposure_product(const struct exposure_setting *setting) {
    return setting->exposure_us * gain_of(setting->gain_q3);
}

// ---- limits

// The longest exposure with which pairs are within their skew limit.
static uint32_t longest_us(const struct rig *rig, const struct mt9t001_timing *full) {
    const struct rig_profile *profile = &rig->profile;
    uint32_t us = profile->trigger ? profile->frame_us : profile->skew_limit_us;
    if (profile->bridge) {
        const uint32_t frame_us = us > PAIR_US ? (us - PAIR_US) / PAIR_FRAMES : 0;
        us = frame_us > full->frame_us ? frame_us : (uint32_t)full->frame_us;
        // A frame has one row more than its exposure.
        us -= 2 * (uint32_t)(full->row_ns / NS_PER_US);
    }
    us = us > EXPOSURE_MAX_US ? EXPOSURE_MAX_US : us;
    const uint32_t half_us = rig_mains_half_us(profile);
    return half_us != 0 && us >= half_us ? us / half_us * half_us : us;
}

// A camera with its own port may have no gain control, or one that cannot be read.
static bool has_gain(const struct rig *rig, unsigned side) {
    return rig->profile.bridge || rig_camera_gain_q3(rig, side) != 0;
}

// Exposures are those of the present window, in which pairs are taken.
struct exposure_limits exposure_camera_limits(const struct rig *rig, unsigned side) {
    const struct rig_profile *profile = &rig->profile;
    struct mt9t001_timing full = {.row_ns = UVC_STEP_US * NS_PER_US};
    struct exposure_limits limits = {
        .row_ns = UVC_STEP_US * NS_PER_US,
        .min_us = UVC_STEP_US,
        .gain_min_q3 = MT9T001_GAIN_Q3_MIN,
        .gain_max_q3 = profile->bridge ? GAIN_MAX_Q3 : MT9T001_GAIN_Q3_MAX,
        .mains_half_us = rig_mains_half_us(profile),
        .linear = profile->bridge,
    };
    if (!has_gain(rig, side)) {
        limits.gain_max_q3 = limits.gain_min_q3;
    }
    if (profile->bridge) {
        const struct mt9t001 *sensor = &rig->camera[side].sensor;
        const int error = mt9t001_timing_of(&sensor->window, 1, sensor->clock_hz, &full);
        INVARIANT(error == ERROR_OK);
        limits.row_ns = (uint32_t)full.row_ns;
        limits.overhead_ns = (uint32_t)((uint64_t)full.overhead_clocks * NS_PER_S / full.clock_hz);
        limits.min_us = (uint32_t)mt9t001_exposure_us(&full, 1);
    }
    limits.max_us = longest_us(rig, &full);
    limits.max_us = limits.max_us > limits.min_us ? limits.max_us : limits.min_us;
    return limits;
}

bool exposure_has_iris(const struct exposure_job *job, unsigned side) {
    return rig_has_axis(&job->rig->profile, side, LENS_IRIS);
}

// ---- settings

int exposure_move_iris(struct exposure_job *job, unsigned sides, int32_t position) {
    struct rig *rig = job->rig;
    struct rig_lens_move move;
    int error = rig_lens_move_begin(rig, &move, sides, LENS_IRIS, position, LENS_MOVE_IF_NEEDED);
    job->iris_moved = job->iris_moved || error == ERROR_OK;
    while (error == ERROR_OK && !rig_lens_move_done(&move)) {
        error = rig_lens_move_step(rig, &move, rig_now_us(rig) + RIG_POLL_US);
    }
    job->iris = error == ERROR_OK ? position : job->iris;
    return error;
}

// Both irises move together.
static int set_iris(struct exposure_job *job, int32_t position) {
    unsigned sides = 0;
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        sides |= exposure_has_iris(job, side) ? job->sides & 1u << side : 0;
    }
    return position == job->iris || sides == 0 ? ERROR_OK
                                               : exposure_move_iris(job, sides, position);
}

static int set_exposure(struct exposure_job *job, struct rig_region *region,
                        struct exposure_setting *setting, struct exposure_search *search) {
    uint32_t applied_us = 0;
    int error = rig_region_exposure(job->rig, region, setting->exposure_us, &applied_us);
    const bool is_limit = error == ERROR_RANGE && applied_us != 0;
    if (is_limit) {
        error = rig_region_exposure(job->rig, region, applied_us, &applied_us);
    }
    if (error != ERROR_OK || job->rig->profile.bridge || applied_us == 0 ||
        applied_us == setting->exposure_us) {
        return error;
    }
    setting->exposure_us = applied_us;
    if (search != NULL) {
        exposure_search_adapt(search, applied_us, is_limit);
    }
    return ERROR_OK;
}

// Sets the nearest gain that is not smaller, as gains of a camera with its own port have steps of
// its own, and shortens the exposure by as much.
static int set_gain(struct exposure_job *job, struct rig_region *region,
                    struct exposure_setting *setting, struct exposure_search *search) {
    const uint16_t wanted_q3 = setting->gain_q3;
    uint16_t applied_q3 = 0;
    int error = rig_region_gain(job->rig, region, wanted_q3, &applied_q3);
    for (unsigned more = 1;
         error == ERROR_OK && applied_q3 < wanted_q3 && wanted_q3 + more <= MT9T001_GAIN_Q3_MAX;
         more *= 2) {
        error = rig_region_gain(job->rig, region, (uint16_t)(wanted_q3 + more), &applied_q3);
    }
    if (error != ERROR_OK || applied_q3 == wanted_q3 || applied_q3 == 0) {
        return error;
    }
    setting->gain_q3 = applied_q3;
    setting->exposure_us = (uint32_t)((uint64_t)setting->exposure_us * wanted_q3 / applied_q3);
    setting->exposure_us += setting->exposure_us == 0;
    if (search != NULL) {
        exposure_search_adapt_gain(search, applied_q3);
        exposure_search_adapt(search, setting->exposure_us, false);
    }
    return ERROR_OK;
}

int exposure_region_set(struct exposure_job *job, struct rig_region *region,
                        struct exposure_setting *setting, struct exposure_search *search) {
    const struct rig_camera *camera = &job->rig->camera[region->side];
    int error = set_iris(job, setting->iris);
    if (error == ERROR_OK && has_gain(job->rig, region->side) &&
        camera->gain_q3 != setting->gain_q3) {
        error = set_gain(job, region, setting, search);
    }
    if (error == ERROR_OK && camera->exposure_us != setting->exposure_us) {
        error = set_exposure(job, region, setting, search);
    }
    return error;
}

int exposure_camera_set(struct exposure_job *job, unsigned side,
                        const struct exposure_setting *setting) {
    const struct rig_camera *camera = &job->rig->camera[side];
    uint32_t applied_us = 0;
    uint16_t applied_q3 = 0;
    int error = ERROR_OK;
    if (setting->exposure_us != 0 && camera->exposure_us != setting->exposure_us) {
        error = rig_exposure(job->rig, 1u << side, setting->exposure_us, &applied_us);
    }
    if (error == ERROR_OK && setting->gain_q3 != 0 && has_gain(job->rig, side) &&
        camera->gain_q3 != setting->gain_q3) {
        error = rig_gain(job->rig, 1u << side, setting->gain_q3, &applied_q3);
    }
    return error;
}

int exposure_region_end(struct exposure_job *job, struct rig_region *region,
                        const struct exposure_setting *setting) {
    const int error = rig_region_end(job->rig, region, true);
    return error == ERROR_OK ? exposure_camera_set(job, region->side, setting) : error;
}

// ---- measurements

// The whole window of a camera, or all of its frames.
static struct rig_rectangle window_of(const struct rig *rig, unsigned side) {
    const struct mt9t001_window *window = &rig->camera[side].sensor.window;
    if (!rig->profile.bridge) {
        return (struct rig_rectangle){0, 0, rig->format.width_px, rig->format.height_px};
    }
    return (struct rig_rectangle){window->column_px, window->row_px, window->width_px,
                                  window->height_px};
}

// The region to be measured, and how much it is thinned.
static struct rig_rectangle field_of(const struct exposure_job *job, unsigned side,
                                     enum exposure_field which, uint8_t *skip) {
    struct rig_rectangle field = job->region_px;
    if (field.width_px == 0) {
        field = window_of(job->rig, side);
        if (which == EXPOSURE_SHARED_FIELD) {
            field.column_px = (uint16_t)(field.column_px + field.width_px / 8 * 2);
            field.row_px = (uint16_t)(field.row_px + field.height_px / 8 * 2);
            field.width_px /= 2;
            field.height_px /= 2;
        }
    }
    const int scale = which == EXPOSURE_SHARED_FIELD ? SHARED_SCALE : 1;
    *skip = 1;
    while (job->rig->profile.bridge && *skip < SKIP_MAX &&
           field.width_px / (*skip + 1) >= scale * FIELD_WIDTH_PX &&
           field.height_px / (*skip + 1) >= scale * FIELD_HEIGHT_PX) {
        (*skip)++;
    }
    field.width_px = (uint16_t)(field.width_px - field.width_px % (2 * *skip));
    field.height_px = (uint16_t)(field.height_px - field.height_px % (2 * *skip));
    return field;
}

int exposure_region_begin(struct exposure_job *job, struct rig_region *region, unsigned side,
                          enum exposure_field which) {
    uint8_t skip = 1;
    const struct rig_rectangle field = field_of(job, side, which, &skip);
    job->field = which;
    return rig_region_begin(job->rig, region, side, &field, skip);
}

// Adds the whole image, and what both cameras see of it.
static void add(struct exposure_job *job, const struct raw_image *image) {
    const bool whole = job->region_px.width_px != 0;
    const int left = whole ? 0 : image->width_px / 8 * 2,
              top = whole ? 0 : image->height_px / 8 * 2;
    const int values = image->layout == RAW_RGB ? 3 : 1;
    for (int y = 0; y < image->height_px; y++) {
        exposure_histogram_row(&job->all, raw_image_row(image, y), image->width_px, y);
    }
    for (int y = top; y < image->height_px - top; y++) {
        exposure_histogram_row(&job->shared, raw_image_row(image, y) + (ptrdiff_t)values * left,
                               image->width_px - 2 * left, y);
    }
}

void exposure_report(const struct exposure_job *job) {
    const struct rig_observer *observer = &job->rig->observer;
    if (observer->progress != NULL) {
        const uint32_t sides = job->sides == EXPOSURE_BOTH_SIDES ? RIG_SIDES : 1;
        observer->progress(observer->self, "measurements", job->measured,
                           sides * EXPOSURE_STEPS_MAX);
    }
}

// The least and the largest mean of a frame in a measurement.
struct spread {
    double least, most;
    uint64_t greens, sum;  // number and sum of the green values in the frames so far
    int frames;
};

static void add_to_spread(const struct exposure_histogram *all, struct spread *spread) {
    const uint64_t greens = all->greens - spread->greens, sum = all->green_sum - spread->sum;
    const double mean = (double)sum / (double)greens - all->black;
    spread->least = spread->greens == 0 || mean < spread->least ? mean : spread->least;
    spread->most = spread->greens == 0 || mean > spread->most ? mean : spread->most;
    spread->greens = all->greens;
    spread->sum = all->green_sum;
    spread->frames++;
}

static double part_of_spread(const struct spread *spread) {
    const bool shows = spread->frames >= SPREAD_FRAMES && spread->least > 0;
    return shows ? (spread->most - spread->least) / spread->least : 0;
}

int exposure_region_measure(struct exposure_job *job, struct rig_region *region,
                            const struct exposure_setting *setting, struct exposure_light *light) {
    const uint32_t half_us = rig_mains_half_us(&job->rig->profile);
    const uint32_t periods = job->field == EXPOSURE_SHARED_FIELD ? SHARED_PERIODS : 1;
    const uint64_t whole_us = 2 * (uint64_t)half_us * periods;
    uint64_t first_us = 0, last_us = 0;
    const int frames_min = job->field == EXPOSURE_SHARED_FIELD ? SPREAD_FRAMES : 1;
    struct spread spread = {.greens = 0};
    bool again = true;
    for (int i = 0; again && i < FRAMES_MAX; i++) {
        struct rig_region_frame frame;
        const int error = rig_region_take(job->rig, region, 0, &frame);
        if (error != ERROR_OK) {
            return error;
        }
        const uint32_t exposure_us =
            frame.exposure_us != 0 ? frame.exposure_us : setting->exposure_us;
        if (i == 0) {
            first_us = frame.exposed_us;
            exposure_histogram_begin(&job->all, frame.image.layout, frame.image.bits, frame.black);
            job->shared = job->all;
            light->exposure_us = exposure_us;
            light->real_us = exposure_us * gain_of(setting->gain_q3);
        }
        add(job, &frame.image);
        add_to_spread(&job->all, &spread);
        raw_image_release(&frame.image);
        // Shorter exposures see lamps on the mains at one moment: whole periods are averaged,
        // without the frame that begins the next one.
        const uint64_t step_us = i > 0 ? frame.exposed_us - last_us : 0;
        last_us = frame.exposed_us;
        again = exposure_us + exposure_us / 8 < half_us &&
                last_us - first_us + step_us + step_us / 2 < whole_us;
        again = again || spread.frames < frames_min;
    }
    light->spread = part_of_spread(&spread);
    light->measure = exposure_histogram_end(&job->all);
    light->shared = exposure_histogram_end(&job->shared).mean;
    job->measured++;
    exposure_report(job);
    return ERROR_OK;
}
