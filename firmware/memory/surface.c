// SPDX-License-Identifier: Apache-2.0
#include "memory/surface.h"

#include <math.h>
#include <string.h>

#include "console/pair/calibration_fit.h"
#include "console/pair/capture.h"
#include "core/error.h"
#include "core/invariant.h"
#include "memory/calibration.h"
#include "memory/files.h"
#include "memory/pair.h"
#include "rig/base/rig_clock.h"
#include "stereo/reconstruct.h"
#include "surface/compact_writer.h"

enum { NEAR, FAR, DISPARITY, SCALE, PRESET, ACCEPT, ARGUMENTS };
enum { NAME_BYTES = 32, SCALE_STEPS = 20, HEAD_BYTES = 16384 };

static const double us_per_s = 1e6, bytes_per_mb = 1e6, percent = 100;

/// What surface.compact states, as struct compact of daemon/surface/result.
struct record {
    struct {
        const char *version, *build_id, *left_path, *right_path;
        struct raw_image left, right;
        int shrink;
        struct picture_stats picture[2];
        const char *calibration_path, *calibration_format;
        bool metric, axes_compared, self_calibrated, with_pair_used;
        struct message mismatch;
        struct adjust_report self_calibration, without_target;
        uint32_t with_pair;
        struct wide_pair_report wide_pair;
        int target_points;
        double depth_sigma_common_mm;
        const char *decisions;
        int threads;
        uint64_t read_us, total_us;
        size_t arena_bytes, rss_peak_bytes;
    } context;
    struct reconstruct_options options;
    struct reconstruct_result result;
};

#define FIELD(name, kind, count, range, member) \
    {name, COMPACT_##kind, count, range, offsetof(struct record, member)},
static const struct compact_field fields[] = {COMPACT_FIELDS(FIELD)};
#undef FIELD

/// One call. The result stays for the file.
static struct {
    const struct command_call *call;
    struct arena *arena;
    struct calibration calibration;
    struct record record;
    struct compact_writer writer;
    char name[NAME_BYTES];  // of the file's directory
    uint8_t *file;
    size_t bytes, capacity;
} self;

static int refuse(int error, const char *why) {
    struct command_text sentence = command_text_begin(self.call->message, self.call->message_bytes);
    command_text_join(&sentence, "reconstruct: ", why);
    return error;
}

static bool should_stop(void) {
    const struct rig_observer *observer = &self.call->rig->observer;
    return observer->should_stop(observer->self);
}

// ---- before the work

/// The calibration of the pair's state, unless the pair was taken with another one.
static int choose_calibration(const struct pair *pair) {
    const struct rig_profile *profile = &self.call->rig->profile;
    const struct pair_instrument instrument = calibration_match_instrument(profile);
    struct message *message = &self.record.context.mismatch;
    struct calibration_match_state state;
    calibration_match_pair(profile->name, &instrument, pair, &state);
    const int error = memory_calibration_for(&state, &self.calibration, message);
    const struct calibration_origin *origin = &state.origin;
    if (error == ERROR_OK) {
        self.record.context.axes_compared =
            !calibration_match_is_partial(&self.calibration, origin);
        message->text[0] = '\0';
    }
    const bool accepted = error == ERROR_MISMATCH && command_is_set(&self.call->values[ACCEPT]);
    return error == ERROR_OK || accepted ? ERROR_OK : refuse(error, message->text);
}

static int fit_calibration(const struct pair *pair) {
    bool cut = false;
    for (int side = 0; side < RIG_SIDES; side++) {
        const enum calibration_fit fit =
            calibration_fit_side(&self.calibration, side, &pair->frame[side]);
        if (fit == CALIBRATION_OTHER) {
            return refuse(ERROR_SIZE_MISMATCH,
                          "the calibration is for images of another size (set \"window\" to it)");
        }
        cut |= fit == CALIBRATION_CUT;
    }
    const int error = cut ? calibration_round(&self.calibration) : ERROR_OK;
    return error == ERROR_OK && calibration_validate(&self.calibration, NULL) == ERROR_OK
               ? ERROR_OK
               : refuse(ERROR_SIZE_MISMATCH,
                        "the calibration cannot be cut to the frames' part of the sensor (choose a "
                        "larger window)");
}

/// What is wrong with the search; NULL: nothing.
static const char *search_fault(const struct command_value *values) {
    const bool near = values[NEAR].given, far = values[FAR].given;
    if (far && !(near && values[NEAR].number < values[FAR].number)) {
        return "far requires a near that is less";
    }
    return !values[DISPARITY].given               ? NULL
           : near                                 ? "near cannot be combined with disparity"
           : !(values[DISPARITY].numbers[1] >= 1) ? "disparity MIN:COUNT is empty"
                                                  : NULL;
}

static int choose_options(void) {
    const struct command_value *values = self.call->values;
    struct reconstruct_options *options = &self.record.options;
    *options = reconstruct_default_options();
    options->preset = MATCH_PRESET_BOARD;
    options->recompute_surface = options->remake_pictures = true;
    if (values[NEAR].given) {
        options->rectify.depth_near_mm = values[NEAR].number;
        options->rectify.depth_far_mm = values[FAR].given ? values[FAR].number : (double)INFINITY;
    }
    if (values[DISPARITY].given) {
        options->rectify.disparity_min = (int)values[DISPARITY].numbers[0];
        options->rectify.disparity_count = (int)values[DISPARITY].numbers[1];
    }
    options->rectify.scale = values[SCALE].given ? values[SCALE].number : options->rectify.scale;
    if (values[PRESET].given) {
        options->preset = (enum match_preset)values[PRESET].choice;
    }
    const char *fault = search_fault(values);
    return fault == NULL ? ERROR_OK : refuse(ERROR_ARGUMENT, fault);
}

static size_t packed_bytes(int width) {
    return compact_band_pixels(width) + COMPACT_STORED_MORE_BYTES;
}

/// What the work takes, or its result with the file, whichever is more.
static size_t need_bytes(const struct pair *pair, const struct rectify_plan *plan) {
    const struct reconstruct_need need =
        reconstruct_needs(&pair->frame[RIG_LEFT].image, &pair->frame[RIG_RIGHT].image,
                          &self.calibration, plan, &self.record.options, parallel_serial.threads);
    const int width = plan->width_px;
    const size_t file =
        arena_need_bytes(compact_band_bytes(width) + packed_bytes(width), 1) +
        arena_need_bytes(HEAD_BYTES + compact_stored_rows_bytes(width, plan->height_px), 1);
    return need.bytes > need.result_bytes + file ? need.bytes : need.result_bytes + file;
}

/// The largest scale that fits, in steps of 1/SCALE_STEPS; 0: none.
static double fitting_scale(const struct pair *pair, size_t need, size_t there) {
    // Memory grows with the number of pixels at most.
    const double most = self.record.options.rectify.scale * sqrt((double)there / (double)need);
    struct rectify_options options = self.record.options.rectify;
    for (int step = (int)(most * SCALE_STEPS); step > 0 && !should_stop(); step--) {
        struct rectify_plan plan;
        options.scale = (double)step / SCALE_STEPS;
        if (rectify_plan_make(&self.calibration, &options, &plan) == ERROR_OK &&
            need_bytes(pair, &plan) <= there) {
            return options.scale;
        }
    }
    return 0;
}

static int refuse_size(const struct pair *pair, size_t need, size_t there) {
    const double scale = fitting_scale(pair, need, there);
    if (should_stop()) {
        return ERROR_CANCELLED;
    }
    struct command_text sentence = command_text_begin(self.call->message, self.call->message_bytes);
    command_text_add(&sentence, "reconstruct: ");
    command_text_add_number(&sentence, (double)need / bytes_per_mb, 1);
    command_text_add(&sentence, " MB are required, ");
    command_text_add_number(&sentence, (double)there / bytes_per_mb, 1);
    command_text_add(&sentence, " MB are there (");
    if (scale > 0) {
        command_text_add(&sentence, "scale=");
        command_text_add_number(&sentence, scale, 2);
        command_text_add(&sentence, " fits)");
    } else {
        command_text_add(&sentence, "no scale fits: capture a smaller window, or a single pair)");
    }
    return ERROR_MEMORY;
}

static int make_plan(const struct pair *pair, struct rectify_plan *plan) {
    int error = rectify_plan_make(&self.calibration, &self.record.options.rectify, plan);
    if (error != ERROR_OK) {
        return refuse(error, error_text(error));
    }
    const size_t need = need_bytes(pair, plan),
                 there = self.arena->size_bytes - self.arena->used_bytes;
    return need <= there ? ERROR_OK : refuse_size(pair, need, there);
}

// ---- the work

static uint64_t now_us(void *cookie) {
    (void)cookie;
    return rig_now_us(self.call->rig);
}

static bool show_progress(void *cookie, enum reconstruct_stage stage, int done, int total) {
    const struct rig_observer *observer = &self.call->rig->observer;
    (void)cookie;
    observer->progress(observer->self, reconstruct_stage_text(stage), (uint32_t)done,
                       (uint32_t)total);
    return !should_stop();
}

static int compute(const struct pair *pair, const struct rectify_plan *plan) {
    const struct reconstruct_environment environment = {
        .parallel = &parallel_serial, .now_us = now_us, .progress = show_progress};
    const struct raw_image *left = &pair->frame[RIG_LEFT].image;
    const struct raw_image *right = &pair->frame[RIG_RIGHT].image;
    const int error = reconstruct_run(left, right, &self.calibration, plan, &self.record.options,
                                      &environment, self.arena, &self.record.result);
    return error == ERROR_OK || error == ERROR_CANCELLED ? error : refuse(error, error_text(error));
}

// ---- the file

static void append(void *cookie, const void *bytes, size_t length) {
    (void)cookie;
    INVARIANT(length <= self.capacity - self.bytes);  // need_bytes
    memcpy(self.file + self.bytes, bytes, length);
    self.bytes += length;
}

static bool end_band(void *cookie, int rows) {
    (void)cookie;
    show_progress(NULL, RECONSTRUCT_MESH, rows, self.record.result.plan.height_px);
    return !should_stop();
}

static void describe(const struct pair *pair, uint64_t total_us) {
    const struct pair_frame *frame = pair->frame;
    self.record.context.version = VERGENCE_VERSION;
    self.record.context.build_id = "unknown";
    self.record.context.left_path = "left.pgm";
    self.record.context.right_path = "right.pgm";
    self.record.context.left = frame[RIG_LEFT].image;
    self.record.context.right = frame[RIG_RIGHT].image;
    self.record.context.shrink = 1;
    self.record.context.picture[RIG_LEFT] = frame[RIG_LEFT].picture;
    self.record.context.picture[RIG_RIGHT] = frame[RIG_RIGHT].picture;
    self.record.context.calibration_path = "the calibration in force";
    self.record.context.calibration_format = "vergence";
    self.record.context.metric = true;
    self.record.context.depth_sigma_common_mm = -1;
    self.record.context.threads = 1;
    self.record.context.total_us = total_us;
    self.record.context.arena_bytes = self.arena->size_bytes;
}

static void read_file(const void *source, size_t offset, void *to, size_t bytes) {
    memcpy(to, (const uint8_t *)source + offset, bytes);
}

/// Writes the file into the rest of the arena.
static int write_file(void) {
    static const struct compact_output output = {compact_stored, append, end_band, NULL};
    const int width = self.record.result.plan.width_px;
    uint8_t *band = arena_take(self.arena, compact_band_bytes(width) + packed_bytes(width), 1);
    INVARIANT(band != NULL);  // need_bytes
    self.bytes = 0;
    self.capacity = self.arena->size_bytes - self.arena->used_bytes;
    self.file = self.arena->base + self.arena->used_bytes;
    compact_writer_begin(&self.writer, &output);
    compact_writer_fields(&self.writer, fields, sizeof fields / sizeof fields[0], &self.record);
    const int error = compact_writer_calibration(&self.writer, &self.calibration);
    if (error != ERROR_OK) {
        return refuse(error, error_text(error));
    }
    compact_writer_rows(&self.writer, &self.record.result, band, band + compact_band_bytes(width));
    memory_files_put(MEMORY_FILE_SURFACE, self.name, "surface.compact", read_file, self.file,
                     self.bytes);
    return should_stop() ? ERROR_CANCELLED : ERROR_OK;
}

static void reply(const struct pair *pair, const char *pair_name) {
    const struct command_call *call = self.call;
    const struct reconstruct_result *result = &self.record.result;
    const double pixels = (double)result->plan.width_px * result->plan.height_px;
    reply_text(call, "session", pair_name);
    reply_number(call, "pair", pair->number, 0, NULL);
    reply_number(call, "skew", (double)pair->skew_us, 0, "us");
    reply_text(call, "result", self.name);
    reply_text(call, "calibration", self.calibration.id);
    reply_number(call, "width", result->plan.width_px, 0, "px");
    reply_number(call, "height", result->plan.height_px, 0, "px");
    reply_number(call, "disparities", result->plan.disparity_count, 0, NULL);
    reply_number(call, "points", result->vertex_count, 0, NULL);
    reply_number(call, "triangles", result->triangle_count, 0, NULL);
    reply_number(call, "density", percent * result->vertex_count / pixels, 1, "%");
    if (result->vertical.samples > 0) {
        reply_number(call, "rows_apart", result->vertical.median_px, 3, "px");
    }
    reply_number(call, "memory", (double)result->arena_peak_bytes, 0, "bytes");
    reply_number(call, "time", (double)self.record.context.total_us / us_per_s, 2, "s");
}

static int run_reconstruct(const struct command_call *call) {
    const uint64_t begin_us = rig_now_us(call->rig);
    const char *pair_name = NULL;
    const struct pair *pair = memory_pair_last(&pair_name);
    struct rectify_plan plan;
    memset(&self.record, 0, sizeof self.record);
    self.call = call;
    if (pair == NULL) {
        return refuse(ERROR_MISSING, "no pair (\"capture\" takes one)");
    }
    self.arena = memory_pair_arena();
    struct command_text name = command_text_begin(self.name, sizeof self.name);
    command_text_join(&name, "surface-", pair_name);
    int error = choose_calibration(pair);
    error = error == ERROR_OK ? fit_calibration(pair) : error;
    error = error == ERROR_OK ? choose_options() : error;
    error = error == ERROR_OK ? make_plan(pair, &plan) : error;
    error = error == ERROR_OK ? compute(pair, &plan) : error;
    if (error != ERROR_OK) {
        return error;
    }
    describe(pair, rig_now_us(self.call->rig) - begin_us);
    error = write_file();
    if (error == ERROR_OK) {
        reply(pair, pair_name);
    }
    return error;
}

const struct command *memory_surface_table(size_t *count) {
    static const struct command_argument arguments[ARGUMENTS] = {
        [NEAR] = {.name = "near",
                  .kind = COMMAND_NUMBER,
                  .unit = "mm",
                  .min = 1e-3,
                  .max = 1e6,
                  .help = "minimum depth to search; default: the calibration's range"},
        [FAR] = {.name = "far",
                 .kind = COMMAND_NUMBER,
                 .unit = "mm",
                 .min = 1e-3,
                 .max = INFINITY,
                 .help = "maximum depth to search; default with near: inf"},
        [DISPARITY] = {.name = "disparity",
                       .kind = COMMAND_INTEGER,
                       .value_name = "MIN:COUNT",
                       .min = -MATCH_DISPARITY_LIMIT,
                       .max = MATCH_DISPARITY_LIMIT,
                       .count = 2,
                       .separator = ':',
                       .help = "disparities to search instead of depths"},
        [SCALE] = {.name = "scale",
                   .kind = COMMAND_NUMBER,
                   .min = 0.01,
                   .max = 4,
                   .help = "size of the rectified images relative to the frames; default: 1"},
        [PRESET] = {.name = "preset",
                    .kind = COMMAND_CHOICE,
                    .choices = "fast standard best board paper",
                    .help = "matcher; default: board"},
        [ACCEPT] = {.name = CAPTURE_ACCEPT_NAME,
                    .kind = COMMAND_FLAG,
                    .help = "accept a calibration made with other axes, cameras or windows"},
    };
    static const struct command commands[] = {
        {.name = "reconstruct",
         .summary = "measure a surface from the last pair",
         .help = "Leaves surface.compact in memory until the next capture or reconstruct; "
                 "\"vergence --connect\" fetches it and makes all other files of it.",
         .arguments = arguments,
         .argument_count = ARGUMENTS,
         .flags = COMMAND_LONG | COMMAND_GROUP_MEASURE | COMMAND_DAILY,
         .run = run_reconstruct},
    };
    *count = 1;
    return commands;
}
