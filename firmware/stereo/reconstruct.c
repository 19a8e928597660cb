// SPDX-License-Identifier: Apache-2.0
#include "stereo/reconstruct.h"

#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "stereo/develop.h"
#include "stereo/fill.h"
#include "stereo/match/match.h"
#include "stereo/mesh.h"
#include "stereo/row_residual.h"
#include "stereo/surface.h"

enum {
    // Used where the fit gives no prediction of its own: the accuracy of the winner's parabola.
    UNREFINED_SIGMA_Q8 = 64,
    // Fewer valid pixels than this share are chance. Swapped images, or images of different scenes,
    // leave up to 7 % (measured); matching pairs more than 85 %.
    SURFACE_SHARE = 10,
    // Raw rows that are developed at a time.
    STRIP_ROWS = 128,
};

const char *reconstruct_stage_text(enum reconstruct_stage stage) {
    static const char *const texts[] = {
#define RECONSTRUCT_STAGE_NAME(name, text) text,
        RECONSTRUCT_STAGE_LIST(RECONSTRUCT_STAGE_NAME)
#undef RECONSTRUCT_STAGE_NAME
    };
    INVARIANT((int)stage >= 0 && stage < RECONSTRUCT_STAGES);
    return texts[stage];
}

struct reconstruct_options reconstruct_default_options(void) {
    return (struct reconstruct_options){
        .rectify = {.scale = 1.0},
        .preset = match_default_options(0, 1).preset,
        .speckle_px = match_default_options(0, 1).speckle_px,
        .refine = true,
        .max_gap_q8 = MESH_DEFAULT_GAP_Q8,
    };
}

// One run: what every stage needs.
struct run {
    const struct raw_image *raw[2];
    const struct calibration *calibration;
    const struct reconstruct_options *options;
    const struct reconstruct_environment *environment;
    const struct parallel *parallel;
    struct arena *arena;
    struct reconstruct_result *result;
    struct develop_balance balance;
    int32_t *coordinates_q16;  // 2 * width values per part
    uint64_t stage_begin_us;
    uint64_t develop_us;  // time spent on developing while rectifying
    size_t peak_bytes;    // peak of the stages before
};

static int smaller(int a, int b) {
    return a < b ? a : b;
}

static size_t larger(size_t a, size_t b) {
    return a > b ? a : b;
}

static uint64_t now_us(const struct reconstruct_environment *environment) {
    return environment->now_us == NULL ? 0 : environment->now_us(environment->self);
}

static bool report(const struct run *run, enum reconstruct_stage stage, int done, int total) {
    const struct reconstruct_environment *environment = run->environment;
    INVARIANT(done >= 0 && done <= total);
    return environment->progress == NULL ||
           environment->progress(environment->self, stage, done, total);
}

static int begin_stage(struct run *run, enum reconstruct_stage stage) {
    run->stage_begin_us = now_us(run->environment);
    run->peak_bytes = larger(run->peak_bytes, run->arena->peak_bytes);
    run->arena->peak_bytes = run->arena->used_bytes;
    return report(run, stage, 0, 1) ? ERROR_OK : ERROR_CANCELLED;
}

static int end_stage(struct run *run, enum reconstruct_stage stage, int error) {
    run->result->stage_us[stage] = now_us(run->environment) - run->stage_begin_us;
    run->result->stage_peak_bytes[stage] = run->arena->peak_bytes;
    if (error != ERROR_OK) {
        return error;
    }
    return report(run, stage, 1, 1) ? ERROR_OK : ERROR_CANCELLED;
}

static bool take_u8(struct arena *arena, int width, int height, struct image_u8 *image) {
    *image = (struct image_u8){arena_take(arena, (size_t)width * (size_t)height, 1), width, height,
                               width};
    return image->data != NULL;
}

static bool take_rgb8(struct arena *arena, int width, int height, struct image_rgb8 *image) {
    *image = (struct image_rgb8){arena_take(arena, (size_t)width * (size_t)height, 3), width,
                                 height, (ptrdiff_t)3 * width};
    return image->data != NULL;
}

// If the surface is recomputed, only the matcher reads the right image in colour, and its memory is
// then sigma's.
static bool take_right_colour_and_sigma(const struct run *run) {
    struct reconstruct_result *result = run->result;
    const int width = result->plan.width_px;
    const int height = result->plan.height_px;
    const bool keep = !run->options->recompute_surface;
    const bool lend = !keep && run->raw[1]->layout != RAW_GREY;
    if ((keep || lend) && !take_rgb8(run->arena, width, height, &result->right_colour)) {
        return false;
    }
    void *sigma = result->right_colour.data;
    if (!lend) {
        sigma = arena_take(run->arena, (size_t)width * (size_t)height, sizeof(uint16_t));
    }
    result->sigma_q8 = (struct image_u16){sigma, width, height, width};
    return sigma != NULL;
}

static bool take_images(const struct run *run) {
    struct arena *arena = run->arena;
    struct reconstruct_result *result = run->result;
    const int width = result->plan.width_px;
    const int height = result->plan.height_px;
    INVARIANT(width >= MATCH_MIN_WIDTH_PX && height >= MATCH_MIN_HEIGHT_PX);
    const size_t pixels = (size_t)width * (size_t)height;
    struct match_output *match = &result->match;
    result->left_span = arena_take(arena, (size_t)height, sizeof *result->left_span);
    result->right_span = arena_take(arena, (size_t)height, sizeof *result->right_span);
    match->disparity_q8 =
        (struct image_i32){arena_take(arena, pixels, sizeof(int32_t)), width, height, width};
    return take_right_colour_and_sigma(run) && take_u8(arena, width, height, &result->left) &&
           take_u8(arena, width, height, &result->right) &&
           take_rgb8(arena, width, height, &result->left_colour) &&
           take_u8(arena, width, height, &match->reason) &&
           take_u8(arena, width, height, &match->confidence) && match->disparity_q8.data != NULL &&
           result->left_span != NULL && result->right_span != NULL;
}

static size_t images_need_bytes(int width, int height, bool keep_right_colour) {
    const size_t pixels = (size_t)width * (size_t)height;
    return 2 * arena_need_bytes((size_t)height, sizeof(struct rectify_span)) +
           4 * arena_need_bytes(pixels, 1) + 2 * arena_need_bytes(pixels, 3) +
           arena_need_bytes(pixels, sizeof(int32_t)) +
           (keep_right_colour ? arena_need_bytes(pixels, sizeof(uint16_t)) : 0);
}

size_t reconstruct_need_bytes(int raw_width_px, const struct rectify_plan *plan,
                              const struct reconstruct_options *options, int threads) {
    const size_t raw_width = (size_t)raw_width_px;
    const size_t valid = (size_t)plan->width_px * (size_t)plan->height_px;
    const struct match_options match = reconstruct_match_options(plan, options);
    const size_t threads_count = (size_t)threads;
    const size_t developing =
        arena_need_bytes(raw_width * STRIP_ROWS, 1) + arena_need_bytes(raw_width * STRIP_ROWS, 3) +
        develop_need_bytes(raw_width_px, 16, threads) + rectify_table_need_bytes(plan) +
        arena_need_bytes((size_t)plan->height_px, sizeof(struct rectify_extent)) +
        arena_need_bytes(threads_count * 2 * (size_t)plan->width_px, sizeof(int32_t));
    size_t largest = larger(developing, match_need_bytes(plan->width_px, &match, threads));
    largest = larger(largest, subpixel_need_bytes(plan->width_px, plan->height_px, threads));
    largest = larger(largest, row_residual_need_bytes());
    largest = larger(largest, fill_need_bytes(plan->width_px, plan->height_px));
    largest = larger(largest, surface_need_bytes(plan->width_px, plan->height_px,
                                                 options->recompute_surface ? 0 : valid));
    return images_need_bytes(plan->width_px, plan->height_px, !options->recompute_surface) +
           largest;
}

// One side being rectified: the raw image passes in strips, so that little of it is developed at a
// time.
struct side {
    const struct run *run;
    struct rectify_table table;
    struct rectify_extent *extent;  // one for each row
    struct rectify_strip strip;
    struct rectify_span *span;
    struct image_u8 *grey;
    struct image_rgb8 *colour;  // has no data if not wanted
};

static void part_rows(const struct run *run, int index, int *begin, int *end) {
    const int64_t height = run->result->plan.height_px;
    *begin = (int)(height * index / run->parallel->threads);
    *end = (int)(height * (index + 1) / run->parallel->threads);
}

static int32_t *part_coordinates(const struct run *run, int index) {
    return run->coordinates_q16 + (size_t)index * 2 * (size_t)run->result->plan.width_px;
}

static void begin_part(void *context, int index) {
    const struct side *side = context;
    const size_t width = (size_t)side->run->result->plan.width_px;
    int begin, end;
    part_rows(side->run, index, &begin, &end);
    for (int y = begin; y < end; y++) {
        side->extent[y] = rectify_row_extent(&side->table, y, part_coordinates(side->run, index));
        side->span[y] = side->extent[y].span;
        memset(image_u8_row(side->grey, y), 0, width);
        if (side->colour->data != NULL) {
            memset(image_rgb8_row(side->colour, y), 0, 3 * width);
        }
    }
}

static void strip_part(void *context, int index) {
    const struct side *side = context;
    int begin, end;
    part_rows(side->run, index, &begin, &end);
    for (int y = begin; y < end; y++) {
        uint8_t *colour = side->colour->data != NULL ? image_rgb8_row(side->colour, y) : NULL;
        rectify_row_strip(&side->table, &side->strip, &side->extent[y], y,
                          image_u8_row(side->grey, y), colour, part_coordinates(side->run, index));
    }
}

static bool take_side(struct run *run, struct side *side, int raw_width) {
    const size_t threads = (size_t)run->parallel->threads;
    const size_t width = (size_t)run->result->plan.width_px;
    side->extent =
        arena_take(run->arena, (size_t)run->result->plan.height_px, sizeof *side->extent);
    run->coordinates_q16 =
        arena_take(run->arena, threads * 2 * width, sizeof *run->coordinates_q16);
    return take_u8(run->arena, raw_width, STRIP_ROWS, &side->strip.grey) &&
           take_rgb8(run->arena, raw_width, STRIP_ROWS, &side->strip.colour) &&
           side->extent != NULL && run->coordinates_q16 != NULL;
}

// Develops and rectifies strip by strip; each begins with the last row of the one before.
static int pass_strips(struct run *run, struct side *side, const struct develop_state *develop,
                       int done) {
    const int height = develop->raw->height_px;
    run->parallel->run(run->parallel->self, begin_part, side, run->parallel->threads);
    for (int begin = 0; begin == 0 || begin < height - 1; begin += STRIP_ROWS - 1) {
        struct rectify_strip *strip = &side->strip;
        const uint64_t begin_us = now_us(run->environment);
        strip->begin = begin;
        strip->end = smaller(begin + STRIP_ROWS, height);
        strip->grey.height = strip->colour.height = strip->end - begin;
        develop_rows(develop, run->parallel, begin, &strip->grey, &strip->colour);
        run->develop_us += now_us(run->environment) - begin_us;
        run->parallel->run(run->parallel->self, strip_part, side, run->parallel->threads);
        if (!report(run, RECONSTRUCT_RECTIFY, done + strip->end, 2 * height)) {
            return ERROR_CANCELLED;
        }
    }
    return ERROR_OK;
}

static int rectify_side(struct run *run, struct side *side, enum rectify_side which) {
    const struct raw_image *raw = run->raw[which];
    struct develop_state develop;
    if (!take_side(run, side, raw->width_px)) {
        return ERROR_MEMORY;
    }
    int error =
        rectify_table_make(&run->result->plan, run->calibration, which, run->arena, &side->table);
    if (error == ERROR_OK) {
        error = develop_begin(&develop, raw, &run->balance, run->parallel->threads, run->arena);
    }
    return error != ERROR_OK
               ? error
               : pass_strips(run, side, &develop, which == RECTIFY_LEFT ? 0 : raw->height_px);
}

static int rectify(struct run *run) {
    struct reconstruct_result *result = run->result;
    struct side sides[2] = {{.run = run,
                             .span = result->left_span,
                             .grey = &result->left,
                             .colour = &result->left_colour},
                            {.run = run,
                             .span = result->right_span,
                             .grey = &result->right,
                             .colour = &result->right_colour}};
    int error = ERROR_OK;
    for (int side = 0; side < 2 && error == ERROR_OK; side++) {
        const size_t mark = arena_mark(run->arena);
        error = rectify_side(run, &sides[side], side == 0 ? RECTIFY_LEFT : RECTIFY_RIGHT);
        arena_release(run->arena, mark);
    }
    return error;
}

static struct match_input match_input_of(const struct reconstruct_result *result) {
    return (struct match_input){.left = result->left,
                                .right = result->right,
                                .left_span = result->left_span,
                                .right_span = result->right_span,
                                .resampled = !result->plan.identity,
                                .left_colour = result->left_colour,
                                .right_colour = result->right_colour};
}

static bool match_band_done(void *self, int rows_done, int rows) {
    return report(self, RECONSTRUCT_MATCH, rows_done, rows);
}

static int match(struct run *run) {
    struct reconstruct_result *result = run->result;
    const struct match_options options = reconstruct_match_options(&result->plan, run->options);
    const struct match_input input = match_input_of(result);
    // A view of the rest of the arena, to measure the matcher's own peak.
    struct arena rest;
    arena_init(&rest, run->arena->base + run->arena->used_bytes,
               run->arena->size_bytes - run->arena->used_bytes);
    int error =
        match_run(&input, &options, run->parallel, match_band_done, run, &rest, &result->match);
    if (error == ERROR_OK && !options.keep_all) {
        error = match_count_repeats(&input, &options, run->parallel, &rest, &result->match,
                                    &result->repeating_count);
    }
    result->match_peak_bytes = rest.peak_bytes;
    const size_t peak = run->arena->used_bytes + rest.peak_bytes;
    run->arena->peak_bytes = larger(run->arena->peak_bytes, peak);
    if (run->options->recompute_surface) {
        result->right_colour = (struct image_rgb8){0};
    }
    return error;
}

static int refine(struct run *run) {
    struct reconstruct_result *result = run->result;
    const struct match_input input = match_input_of(result);
    if (run->options->refine) {
        const int error =
            subpixel_fit(&input, run->parallel, run->arena, &result->match, &result->sigma_q8);
        if (error != ERROR_OK) {
            return error;
        }
    } else {
        for (int y = 0; y < result->plan.height_px; y++) {
            const uint8_t *reason = image_u8_row(&result->match.reason, y);
            uint16_t *sigma_q8 = image_u16_row(&result->sigma_q8, y);
            for (int x = 0; x < result->plan.width_px; x++) {
                sigma_q8[x] = reason[x] == REASON_VALID ? UNREFINED_SIGMA_Q8 : 0;
            }
        }
    }
    return run->options->skip_rows
               ? ERROR_OK
               : row_residual_measure(&input, &result->match, run->arena, &result->vertical);
}

static void count_reasons(struct reconstruct_result *result) {
    memset(result->reason_count, 0, sizeof result->reason_count);
    for (int y = 0; y < result->plan.height_px; y++) {
        const uint8_t *reason = image_u8_row(&result->match.reason, y);
        for (int x = 0; x < result->plan.width_px; x++) {
            INVARIANT(reason[x] < REASON_COUNT);
            result->reason_count[reason[x]]++;
        }
    }
}

static bool surface_found(const struct reconstruct_result *result) {
    uint32_t searched = 0;
    for (int reason = 0; reason < REASON_COUNT; reason++) {
        searched += reason == REASON_BORDER ? 0 : result->reason_count[reason];
    }
    const uint32_t valid = result->reason_count[REASON_VALID];
    return valid > 0 && valid >= searched / SURFACE_SHARE;
}

static int images_stages(struct run *run) {
    int error = begin_stage(run, RECONSTRUCT_DEVELOP);
    if (error == ERROR_OK) {
        // One balance for both, as both see the same scene in the same light.
        run->balance = develop_balance_of(run->raw[0]);
        error = end_stage(run, RECONSTRUCT_DEVELOP, ERROR_OK);
    }
    if (error == ERROR_OK) {
        error = begin_stage(run, RECONSTRUCT_RECTIFY);
    }
    if (error == ERROR_OK) {
        error = end_stage(run, RECONSTRUCT_RECTIFY, rectify(run));
        run->result->stage_us[RECONSTRUCT_DEVELOP] += run->develop_us;
        run->result->stage_us[RECONSTRUCT_RECTIFY] -= run->develop_us;
    }
    return error;
}

// The search is wider than the requested range: whole disparities, and more where few would give
// bad results.
static struct surface_depths depths_asked_for(const struct reconstruct_options *options) {
    const struct rectify_options *rectify = &options->rectify;
    struct surface_depths depths =
        options->keep_all || rectify->disparity_count != 0
            ? surface_depths_of(0, 0)
            : surface_depths_of(rectify->depth_near_mm, rectify->depth_far_mm);
    depths.keep_beyond = rectify->allow_beyond;
    return depths;
}

static int surface_stages(struct run *run) {
    struct reconstruct_result *result = run->result;
    const struct surface_depths depths = depths_asked_for(run->options);
    int error = begin_stage(run, RECONSTRUCT_TRIANGULATE);
    if (error == ERROR_OK && run->options->fill) {
        const struct fill_input input = {&result->left_colour, result->left_span,
                                         &result->sigma_q8};
        error = fill_run(&input, run->parallel, run->arena, &result->match);
    }
    if (error == ERROR_OK) {
        error = end_stage(run, RECONSTRUCT_TRIANGULATE,
                          surface_triangulate(run->parallel, run->arena, &depths,
                                              run->options->recompute_surface, result));
    }
    if (error == ERROR_OK) {
        error = begin_stage(run, RECONSTRUCT_MESH);
    }
    if (error == ERROR_OK) {
        error = end_stage(run, RECONSTRUCT_MESH, surface_mesh(run->arena, result));
    }
    return error;
}

static int all_stages(struct run *run) {
    static const struct {
        enum reconstruct_stage stage;
        int (*run)(struct run *run);
    } matching[] = {{RECONSTRUCT_MATCH, match}, {RECONSTRUCT_REFINE, refine}};
    if (!take_images(run)) {
        return ERROR_MEMORY;
    }
    int error = images_stages(run);
    for (int i = 0; i < 2 && error == ERROR_OK; i++) {
        error = begin_stage(run, matching[i].stage);
        if (error == ERROR_OK) {
            error = end_stage(run, matching[i].stage, matching[i].run(run));
        }
    }
    if (error != ERROR_OK) {
        return error;
    }
    count_reasons(run->result);
    if (!surface_found(run->result)) {
        return ERROR_NO_SURFACE;
    }
    error = surface_stages(run);
    count_reasons(run->result);
    const uint32_t found =
        run->result->reason_count[REASON_VALID] + run->result->reason_count[REASON_BEYOND];
    return error == ERROR_OK && found == 0 ? ERROR_NO_SURFACE : error;
}

static bool sizes_match(const struct raw_image *raw, const struct lens *lens) {
    return raw->width_px == lens->width_px && raw->height_px == lens->height_px;
}

int reconstruct_run(const struct raw_image *left, const struct raw_image *right,
                    const struct calibration *calibration, const struct rectify_plan *plan,
                    const struct reconstruct_options *options,
                    const struct reconstruct_environment *environment, struct arena *arena,
                    struct reconstruct_result *result) {
    static const struct reconstruct_environment bare = {0};
    if (!sizes_match(left, &calibration->left) || !sizes_match(right, &calibration->right)) {
        return ERROR_SIZE_MISMATCH;
    }
    memset(result, 0, sizeof *result);
    result->plan = *plan;
    result->calibration_crc = calibration_crc(calibration);
    result->max_gap_q8 = options->max_gap_q8;
    struct run run = {.raw = {left, right},
                      .calibration = calibration,
                      .options = options,
                      .environment = environment == NULL ? &bare : environment,
                      .arena = arena,
                      .result = result};
    run.parallel = run.environment->parallel == NULL ? &parallel_serial : run.environment->parallel;
    const int error = all_stages(&run);
    arena->peak_bytes = larger(arena->peak_bytes, run.peak_bytes);
    result->arena_peak_bytes = arena->peak_bytes;
    return error;
}
