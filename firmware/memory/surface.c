// SPDX-License-Identifier: Apache-2.0
#include "memory/surface.h"

#include <math.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "memory/files.h"
#include "memory/host.h"
#include "memory/pair.h"
#include "memory/surface_calibration.h"
#include "rig/base/rig_clock.h"
#include "stereo/reconstruct.h"
#include "surface/compact_writer.h"

enum { SCALE_STEPS = 20, HEAD_BYTES = 16384 };

static const double us_per_s = 1e6, bytes_per_mb = 1e6;

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

/// One call. The result stays for the file, of which only a part is in memory: it is made again
/// where it is read.
static struct {
    struct command_call call;  // after the command only its rig is there
    const struct memory_surface_request *request;
    const struct pair *pair;
    struct arena *arena;
    struct surface_calibration calibration;
    struct surface_figures_spread spread;
    struct record record;
    struct compact_writer writer;
    char name[MEMORY_FILE_NAME_BYTES];  // of the file's directory
    uint8_t *band, *part;               // the file's head or a band of its rows
    size_t begin, bytes;                // of the part within the file
} self;

static int refuse(int error, const char *why) {
    return command_refuse(&self.call, error, "%s: %s", self.request->command, why);
}

static bool should_stop(void) {
    return memory_host_should_stop(&self.call);
}

// ---- before the work

static void serve(void *cookie) {
    (void)cookie;
    (void)should_stop();
}

static int make_calibration(void) {
    const struct surface_calibration_request request = {
        .rig = self.call.rig,
        .pair = self.pair,
        .with_pair = self.request->with_pair,
        .accept_mismatch = self.request->accept_mismatch,
        .adjust = self.request->adjust,
        .near_mm = self.record.options.rectify.depth_near_mm,
        .watch = {serve, NULL},
    };
    struct message message;
    const int error = surface_calibration_make(&request, self.arena, &self.calibration, &message);
    if (error != ERROR_OK) {
        return refuse(error, message.text);
    }
    return should_stop() ? ERROR_CANCELLED : ERROR_OK;
}

static size_t packed_bytes(int width) {
    return compact_band_pixels(width) + COMPACT_STORED_MORE_BYTES;
}

/// The most that is in memory of the file: a band of its rows, or its head.
static size_t part_bytes(const struct rectify_plan *plan) {
    const int band_rows = (int)(compact_band_pixels(plan->width_px) / (size_t)plan->width_px);
    const int rows = band_rows < plan->height_px ? band_rows : plan->height_px;
    const size_t bytes = compact_stored_rows_bytes(plan->width_px, rows);
    return bytes > HEAD_BYTES ? bytes : HEAD_BYTES;
}

/// What the work takes, or its result with a part of the file, whichever is more.
static size_t need_bytes(const struct rectify_plan *plan) {
    const struct pair_frame *frame = self.pair->frame;
    const struct reconstruct_need need = reconstruct_needs(
        &frame[RIG_LEFT].image, &frame[RIG_RIGHT].image, &self.calibration.calibration, plan,
        &self.record.options, parallel_serial.threads);
    const int width = plan->width_px;
    const size_t file = arena_need_bytes(compact_band_bytes(width) + packed_bytes(width), 1) +
                        arena_need_bytes(part_bytes(plan), 1);
    return need.bytes > need.result_bytes + file ? need.bytes : need.result_bytes + file;
}

/// The largest scale that fits, in steps of 1/SCALE_STEPS; 0: none.
static double fitting_scale(size_t need, size_t there) {
    // Memory grows with the number of pixels at most.
    const double most = self.record.options.rectify.scale * sqrt((double)there / (double)need);
    struct rectify_options options = self.record.options.rectify;
    for (int step = (int)(most * SCALE_STEPS); step > 0 && !should_stop(); step--) {
        struct rectify_plan plan;
        options.scale = (double)step / SCALE_STEPS;
        if (rectify_plan_make(&self.calibration.calibration, &options, &plan) == ERROR_OK &&
            need_bytes(&plan) <= there) {
            return options.scale;
        }
    }
    return 0;
}

static int refuse_size(size_t need, size_t there) {
    const double scale = fitting_scale(need, there);
    if (should_stop()) {
        return ERROR_CANCELLED;
    }
    struct command_text sentence = command_text_begin(self.call.message, self.call.message_bytes);
    command_text_join(&sentence, self.request->command, ": ");
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

static int make_plan(struct rectify_plan *plan) {
    int error =
        rectify_plan_make(&self.calibration.calibration, &self.record.options.rectify, plan);
    if (error != ERROR_OK) {
        return refuse(error, error_text(error));
    }
    const size_t need = need_bytes(plan), there = self.arena->size_bytes - self.arena->used_bytes;
    return need <= there ? ERROR_OK : refuse_size(need, there);
}

// ---- the work

static uint64_t now_us(void *cookie) {
    (void)cookie;
    return rig_now_us(self.call.rig);
}

static bool show_progress(void *cookie, enum reconstruct_stage stage, int done, int total) {
    const struct rig_observer *observer = &self.call.rig->observer;
    (void)cookie;
    observer->progress(observer->self, reconstruct_stage_text(stage), (uint32_t)done,
                       (uint32_t)total);
    return !should_stop();
}

/// A part of the work after the other, and between them a look after the rig.
static void run_parts(void *cookie, void (*part)(void *context, int index), void *context,
                      int count) {
    for (int index = 0; index < count; index++) {
        serve(cookie);
        parallel_call(part, context, index);
    }
}

static int compute(const struct rectify_plan *plan) {
    static const struct parallel parts = {.run = run_parts, .threads = 1};
    const struct reconstruct_environment environment = {
        .parallel = &parts, .now_us = now_us, .progress = show_progress, .watch = {serve, NULL}};
    const struct raw_image *left = &self.pair->frame[RIG_LEFT].image;
    const struct raw_image *right = &self.pair->frame[RIG_RIGHT].image;
    const int error =
        reconstruct_run(left, right, &self.calibration.calibration, plan, &self.record.options,
                        &environment, self.arena, &self.record.result);
    return error == ERROR_OK || error == ERROR_CANCELLED ? error : refuse(error, error_text(error));
}

// ---- the file

static void append(void *cookie, const void *bytes, size_t length) {
    (void)cookie;
    INVARIANT(length <= part_bytes(&self.record.result.plan) - self.bytes);  // need_bytes
    memcpy(self.part + self.bytes, bytes, length);
    self.bytes += length;
}

/// The spread of the depths, and the error that they share; negative: not known.
static double common_mm(void) {
    const struct reconstruct_result *result = &self.record.result;
    const struct pair_instrument instrument = calibration_match_instrument(&self.call.rig->profile);
    const uint32_t points = surface_figures_measured_count(result);
    return points > 0 && surface_figures_find_spread(result, NULL, points, self.arena, &self.spread)
               ? calibration_match_sigma_mm(&self.calibration.calibration, &instrument,
                                            &self.calibration.state.origin, self.spread.depth_mm[1])
               : -1;
}

static void describe(uint64_t total_us) {
    const struct pair_frame *frame = self.pair->frame;
    const struct pair_adjust_report *report = &self.calibration.report;
    self.record.context.mismatch = self.calibration.mismatch;
    self.record.context.axes_compared = self.calibration.axes_compared;
    self.record.context.self_calibrated = self.calibration.adjusted;
    self.record.context.self_calibration = report->self_calibration;
    self.record.context.with_pair = report->with_pair;
    self.record.context.with_pair_used = report->with_pair_used;
    self.record.context.wide_pair = report->wide_pair;
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
    self.record.context.depth_sigma_common_mm = common_mm();
    self.record.context.threads = 1;
    self.record.context.total_us = total_us;
    self.record.context.arena_bytes = self.arena->size_bytes;
}

/// The file's head becomes the part in memory.
static int begin_file(void) {
    static const struct compact_output output = {compact_stored, append, NULL};
    const struct reconstruct_result *result = &self.record.result;
    self.begin = self.bytes = 0;
    compact_writer_begin(&self.writer, &output);
    compact_writer_fields(&self.writer, fields, sizeof fields / sizeof fields[0], &self.record);
    const int error = compact_writer_calibration(&self.writer, &self.calibration.calibration);
    compact_writer_rows(&self.writer, result, self.band,
                        self.band + compact_band_bytes(result->plan.width_px));
    return error;
}

/// The next band becomes it. Returns the number of rows up to its end.
static int advance_file(void) {
    self.begin += self.bytes;
    self.bytes = 0;
    return compact_writer_band(&self.writer);
}

static void read_file(const void *source, size_t offset, void *to, size_t bytes) {
    (void)source;
    if (offset < self.begin) {
        const int error = begin_file();
        INVARIANT(error == ERROR_OK);  // as when it was made
    }
    for (uint8_t *out = to; bytes > 0;) {
        const size_t at = offset - self.begin;
        if (at >= self.bytes) {
            (void)advance_file();
            continue;
        }
        const size_t here = bytes < self.bytes - at ? bytes : self.bytes - at;
        memcpy(out, self.part + at, here);
        out += here;
        offset += here;
        bytes -= here;
    }
}

/// Makes the file once, to know its length.
static int make_file(void) {
    const int width = self.record.result.plan.width_px, height = self.record.result.plan.height_px;
    self.band = arena_take(self.arena, compact_band_bytes(width) + packed_bytes(width), 1);
    self.part = arena_take(self.arena, part_bytes(&self.record.result.plan), 1);
    INVARIANT(self.band != NULL && self.part != NULL);  // need_bytes
    const int error = begin_file();
    if (error != ERROR_OK) {
        return refuse(error, error_text(error));
    }
    for (int rows = 0; rows < height;) {
        rows = advance_file();
        if (!show_progress(NULL, RECONSTRUCT_MESH, rows, height)) {
            return ERROR_CANCELLED;
        }
    }
    memory_files_put(MEMORY_FILE_SURFACE, self.name, "surface.compact", read_file, NULL,
                     self.begin + self.bytes);
    return ERROR_OK;
}

struct reconstruct_options memory_surface_options(void) {
    struct reconstruct_options options = reconstruct_default_options();
    options.recompute_surface = options.remake_pictures = true;
    return options;
}

int memory_surface_make(const struct command_call *call,
                        const struct memory_surface_request *request, const struct pair *pair,
                        struct measure_surface *surface) {
    const uint64_t begin_us = rig_now_us(call->rig);
    struct rectify_plan plan;
    memset(&self.record, 0, sizeof self.record);
    self.call = *call;
    self.request = request;
    self.pair = pair;
    self.arena = memory_pair_arena();
    self.arena->peak_bytes = self.arena->used_bytes;  // its own is what it reports
    self.record.options = request->options;
    int error = make_calibration();
    error = error == ERROR_OK ? make_plan(&plan) : error;
    error = error == ERROR_OK ? compute(&plan) : error;
    if (error == ERROR_OK) {
        describe(rig_now_us(call->rig) - begin_us);
    }
    if (error == ERROR_OK && request->directory != NULL) {
        struct command_text name = command_text_begin(self.name, sizeof self.name);
        command_text_add(&name, request->directory);
        error = make_file();
    }
    const struct pair_adjust_report *report = &self.calibration.report;
    *surface = (struct measure_surface){
        .result = &self.record.result,
        .calibration = &self.calibration.calibration,
        .shrink = 1,
        .frames = pair->frame,
        .spread = self.spread,
        .common_mm = self.record.context.depth_sigma_common_mm,
        .with_used = report->with_pair_used,
        .misfit = report->self_calibration.health == ADJUST_CALIBRATE,
        .seconds = (double)(rig_now_us(call->rig) - begin_us) / us_per_s,
    };
    return error;
}
