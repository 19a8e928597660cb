// SPDX-License-Identifier: Apache-2.0
#include "stereo/reconstruct.h"

#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "stereo/fill.h"
#include "stereo/match/match.h"
#include "stereo/mesh.h"
#include "stereo/pictures.h"
#include "stereo/row_residual.h"
#include "stereo/surface.h"

_Static_assert((int)ROW_RESIDUAL_AROUND > (int)SUBPIXEL_LATE_ROWS, "a sample reads a final match");

enum {
    // Used where the fit gives no prediction of its own: the accuracy of the winner's parabola.
    UNREFINED_SIGMA_Q8 = 64,
    // Fewer valid pixels than this share are chance. Swapped images, or images of different scenes,
    // leave up to 7 % (measured); matching pairs more than 85 %.
    SURFACE_SHARE = 10,
    RECTIFY_ROWS = 64,  // rows between two reports of progress
    LOOK_ROWS = 16,     // rows of the last look at both images
    // Rows of the images that the last look needs above those that are new.
    LOOK_ABOVE_ROWS = 2 * ROW_RESIDUAL_AROUND,
    OUTPUT_ROWS = 64,  // of the left picture in colour in memory for who asks for its rows
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
    struct pictures *pictures;
    struct pictures ahead;  // for the coarser levels of the matcher
    struct match_need match_need;
    uint64_t stage_begin_us;
    uint64_t pictures_us;  // spent on pictures before the stage
    size_t peak_bytes;     // peak of the stages before
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

// Time spent so far on pictures, which any stage may ask for.
static uint64_t pictures_us(const struct run *run) {
    return run->pictures == NULL ? 0
                                 : run->pictures->develop_us + run->pictures->rectify_us +
                                       run->ahead.develop_us + run->ahead.rectify_us;
}

static int begin_stage(struct run *run, enum reconstruct_stage stage) {
    run->stage_begin_us = now_us(run->environment);
    run->pictures_us = pictures_us(run);
    run->peak_bytes = larger(run->peak_bytes, run->arena->peak_bytes);
    run->arena->peak_bytes = run->arena->used_bytes;
    return report(run, stage, 0, 1) ? ERROR_OK : ERROR_CANCELLED;
}

static int end_stage(struct run *run, enum reconstruct_stage stage, int error) {
    run->result->stage_us[stage] =
        now_us(run->environment) - run->stage_begin_us - (pictures_us(run) - run->pictures_us);
    run->result->stage_peak_bytes[stage] = run->arena->peak_bytes;
    if (error != ERROR_OK) {
        return error;
    }
    return report(run, stage, 1, 1) ? ERROR_OK : ERROR_CANCELLED;
}

// Whether the pictures are made again, row by row, by each stage that reads them. Filling looks at
// all of the left one.
static bool has_rings(const struct reconstruct_options *options) {
    return options->remake_pictures && !options->fill;
}

static struct match_need match_needs_of(const struct rectify_plan *plan,
                                        const struct reconstruct_options *options, int threads) {
    const struct match_options match = reconstruct_match_options(plan, options);
    return match_needs(plan->width_px, plan->height_px, &match, threads);
}

static bool take_u8(struct arena *arena, int width, int height, struct image_u8 *image) {
    *image = (struct image_u8){arena_take(arena, (size_t)width * (size_t)height, 1), width, height,
                               width};
    return image->data != NULL;
}

// Of grey raw images colour shows nothing more, and is not matched.
static bool is_coloured(const struct raw_image *left, const struct raw_image *right) {
    return left->layout != RAW_GREY || right->layout != RAW_GREY;
}

// Rows of a side's picture in colour that are in memory, if `rows` of the grey one are.
static int colour_rows(const struct rectify_plan *plan, bool coloured, int rows,
                       enum rectify_side side) {
    if (rows == plan->height_px || coloured) {
        return rows;
    }
    return side == RECTIFY_LEFT ? smaller(rows, OUTPUT_ROWS) : 0;
}

static bool take_side(const struct run *run, int rows, enum rectify_side which) {
    struct picture_side *side = &run->pictures->side[which];
    const struct rectify_plan *plan = &run->result->plan;
    const int width = plan->width_px;
    const int height = plan->height_px;
    const int in_colour = colour_rows(plan, is_coloured(run->raw[0], run->raw[1]), rows, which);
    side->raw = *run->raw[which];
    side->span = arena_take(run->arena, (size_t)height, sizeof *side->span);
    side->grey = (struct image_u8){arena_take(run->arena, (size_t)width * (size_t)rows, 1), width,
                                   height, width, rows < height ? rows : 0};
    side->colour = (struct image_rgb8){NULL, width, height, (ptrdiff_t)3 * width,
                                       in_colour < height ? in_colour : 0};
    if (in_colour > 0) {
        side->colour.data = arena_take(run->arena, (size_t)width * (size_t)in_colour, 3);
    }
    return side->span != NULL && side->grey.data != NULL &&
           (side->colour.data != NULL || in_colour == 0);
}

static bool take_pictures(struct run *run) {
    struct reconstruct_result *result = run->result;
    const int rows = has_rings(run->options) ? run->match_need.rows_kept : result->plan.height_px;
    run->pictures = arena_take(run->arena, 1, sizeof *run->pictures);
    if (run->pictures == NULL) {
        return false;
    }
    *run->pictures = (struct pictures){.parallel = run->parallel,
                                       .now_us = run->environment->now_us,
                                       .clock = run->environment->self};
    const struct picture_side *side = run->pictures->side;
    const bool taken = take_side(run, rows, RECTIFY_LEFT) && take_side(run, rows, RECTIFY_RIGHT);
    result->left = side[0].grey;
    result->right = side[1].grey;
    result->left_colour = side[0].colour;
    result->right_colour = side[1].colour;
    result->left_span = side[0].span;
    result->right_span = side[1].span;
    return taken;
}

static bool take_maps(const struct run *run) {
    struct arena *arena = run->arena;
    struct reconstruct_result *result = run->result;
    const int width = result->plan.width_px;
    const int height = result->plan.height_px;
    INVARIANT(width >= MATCH_MIN_WIDTH_PX && height >= MATCH_MIN_HEIGHT_PX);
    const size_t pixels = (size_t)width * (size_t)height;
    struct match_output *match = &result->match;
    match->disparity_q8 =
        (struct image_i32){arena_take(arena, pixels, sizeof(int32_t)), width, height, width};
    return take_u8(arena, width, height, &match->reason) &&
           take_u8(arena, width, height, &match->confidence) && match->disparity_q8.data != NULL;
}

// After matching, whose own memory it takes over.
static bool take_sigma(const struct run *run) {
    struct reconstruct_result *result = run->result;
    const int width = result->plan.width_px;
    const int height = result->plan.height_px;
    return take_u8(run->arena, width, height, &result->sigma);
}

static size_t maps_need_bytes(const struct rectify_plan *plan) {
    const size_t pixels = (size_t)plan->width_px * (size_t)plan->height_px;
    return 2 * arena_need_bytes(pixels, 1) + arena_need_bytes(pixels, sizeof(int32_t));
}

struct reconstruct_need reconstruct_needs(const struct raw_image *left,
                                          const struct raw_image *right,
                                          const struct calibration *calibration,
                                          const struct rectify_plan *plan,
                                          const struct reconstruct_options *options, int threads) {
    const int width = plan->width_px;
    const int height = plan->height_px;
    const size_t valid = (size_t)width * (size_t)height;
    const struct match_need match = match_needs_of(plan, options, threads);
    const int rows = has_rings(options) ? match.rows_kept : height;
    const int bits = left->bits > right->bits ? left->bits : right->bits;
    size_t ahead = 0;
    const size_t making =
        pictures_need_bytes(plan, calibration, bits, threads, match.rows_ahead, &ahead);
    size_t images =
        arena_need_bytes(1, sizeof(struct pictures)) + (has_rings(options) ? making : 0);
    for (int side = 0; side < 2; side++) {
        const int in_colour =
            colour_rows(plan, is_coloured(left, right), rows, (enum rectify_side)side);
        images += arena_need_bytes((size_t)width * (size_t)rows, 1) +
                  arena_need_bytes((size_t)width * (size_t)in_colour, 3) +
                  arena_need_bytes((size_t)height, sizeof(struct rectify_span));
    }
    const size_t surface =
        surface_need_bytes(width, height, options->recompute_surface ? 0 : valid);
    const size_t sigma = arena_need_bytes(valid, 1);
    size_t after = subpixel_need_bytes(width, threads) + row_residual_need_bytes() +
                   match_repeats_need_bytes(width, threads);
    after = larger(after, options->fill ? fill_need_bytes(width, height) : 0);
    after = sigma + larger(after, surface);
    const size_t before = has_rings(options) ? match.bytes + ahead : larger(making, match.bytes);
    const size_t maps = maps_need_bytes(plan);
    return (struct reconstruct_need){.bytes = maps + images + larger(before, after),
                                     .result_bytes = maps + images + sigma + surface,
                                     .map_bytes = maps + sigma};
}

static void rows_of(void *self, enum match_wanted what, int begin, int end) {
    struct run *run = self;
    struct pictures *pictures = run->pictures;
    if (what == MATCH_WANTS_AHEAD) {
        pictures_rows(&run->ahead, begin, end);
        return;
    }
    pictures_want(pictures, what == MATCH_WANTS_LEFT ? 1 : 2,
                  what == MATCH_WANTS_COLOUR && pictures->side[RECTIFY_RIGHT].colour.data != NULL);
    pictures_rows(pictures, begin, end);
}

// Prepares the pictures, and makes them if they are kept.
static int rectify(struct run *run) {
    const int height = run->result->plan.height_px;
    const size_t mark = arena_mark(run->arena);
    int error = pictures_begin(run->pictures, &run->result->plan, run->calibration, run->arena);
    if (error != ERROR_OK || has_rings(run->options)) {
        return error;
    }
    for (int y = 0; y < height && error == ERROR_OK; y += RECTIFY_ROWS) {
        const int end = smaller(y + RECTIFY_ROWS, height);
        pictures_rows(run->pictures, y, end);
        error = report(run, RECONSTRUCT_RECTIFY, end, height) ? ERROR_OK : ERROR_CANCELLED;
    }
    arena_release(run->arena, mark);
    return error;
}

static struct match_input match_input_of(struct run *run) {
    const struct reconstruct_result *result = run->result;
    const bool coloured = is_coloured(run->raw[0], run->raw[1]);
    const struct image_rgb8 none = {.data = NULL};
    return (struct match_input){.left = result->left,
                                .right = result->right,
                                .left_span = result->left_span,
                                .right_span = result->right_span,
                                .resampled = !result->plan.identity,
                                .left_colour = coloured ? result->left_colour : none,
                                .right_colour = coloured ? result->right_colour : none,
                                .rows = has_rings(run->options) ? rows_of : NULL,
                                .self = run,
                                .ahead = {run->ahead.side[0].grey, run->ahead.side[1].grey}};
}

static bool match_band_done(void *self, int rows_done, int rows) {
    return report(self, RECONSTRUCT_MATCH, rows_done, rows);
}

static int match(struct run *run) {
    struct reconstruct_result *result = run->result;
    const struct match_options options = reconstruct_match_options(&result->plan, run->options);
    const size_t mark = arena_mark(run->arena);
    if (has_rings(run->options)) {
        const int begun = pictures_begin_ahead(run->pictures, run->match_need.rows_ahead,
                                               run->arena, &run->ahead);
        if (begun != ERROR_OK) {
            return begun;
        }
    }
    const struct match_input input = match_input_of(run);
    // A view of the rest of the arena, to measure the matcher's own peak.
    struct arena rest = arena_rest(run->arena);
    const int error =
        match_run(&input, &options, run->parallel, match_band_done, run, &rest, &result->match);
    result->match_peak_bytes = rest.peak_bytes;
    const size_t peak = run->arena->used_bytes + rest.peak_bytes;
    run->arena->peak_bytes = larger(run->arena->peak_bytes, peak);
    arena_release(run->arena, mark);
    return error;
}

static void set_unrefined_sigma(struct reconstruct_result *result) {
    for (int y = 0; y < result->plan.height_px; y++) {
        const uint8_t *reason = image_u8_row(&result->match.reason, y);
        uint8_t *sigma = image_u8_row(&result->sigma, y);
        for (int x = 0; x < result->plan.width_px; x++) {
            sigma[x] = reason[x] == REASON_VALID ? subpixel_sigma_code(UNREFINED_SIGMA_Q8) : 0;
        }
    }
}

// What looks at both images once the matches are final, in one pass over their rows: repeats, of
// the disparities before the fit, then the fit, then the residual between the rows, of the fitted
// ones.
struct last_look {
    struct match_input input;
    struct match_options options;
    struct subpixel fit;
    struct row_residual residual;
};

static int begin_last_look(struct run *run, struct last_look *look) {
    struct reconstruct_result *result = run->result;
    look->input = match_input_of(run);
    look->options = reconstruct_match_options(&result->plan, run->options);
    int error = ERROR_OK;
    if (run->options->refine) {
        error = subpixel_begin(&look->fit, &look->input, run->parallel, run->arena, &result->match,
                               &result->sigma, false);
    } else {
        set_unrefined_sigma(result);
    }
    return error != ERROR_OK || run->options->skip_rows
               ? error
               : row_residual_begin(&look->residual, &look->input, &result->match, run->arena);
}

// The rows from `begin` on, which those before need, up to `end` are there.
static int look_at_rows(struct run *run, struct last_look *look, int begin, int end) {
    struct reconstruct_result *result = run->result;
    int error = ERROR_OK;
    if (!look->options.keep_all) {
        error = match_count_repeats(&look->input, &look->options, run->parallel, run->arena,
                                    &result->match, begin, end, &result->repeating_count);
    }
    if (error == ERROR_OK && run->options->refine) {
        (void)subpixel_advance(&look->fit, end);
    }
    if (error == ERROR_OK && !run->options->skip_rows) {
        row_residual_add(&look->residual, end);
    }
    return error;
}

static int refine(struct run *run) {
    struct reconstruct_result *result = run->result;
    const int height = result->plan.height_px;
    struct last_look look;
    if (!take_sigma(run)) {
        return ERROR_MEMORY;
    }
    const size_t mark = arena_mark(run->arena);
    int error = begin_last_look(run, &look);
    for (int y = 0; y < height && error == ERROR_OK; y += LOOK_ROWS) {
        const int end = smaller(y + LOOK_ROWS, height);
        match_input_rows(&look.input, MATCH_WANTS_GREY, y - LOOK_ABOVE_ROWS, end);
        error = look_at_rows(run, &look, y, end);
        if (error == ERROR_OK && !report(run, RECONSTRUCT_REFINE, end, height)) {
            error = ERROR_CANCELLED;
        }
    }
    if (error == ERROR_OK && !run->options->skip_rows) {
        row_residual_finish(&look.residual, &result->vertical);
    }
    arena_release(run->arena, mark);
    return error;
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
    const int error = begin_stage(run, RECONSTRUCT_RECTIFY);
    return error == ERROR_OK ? end_stage(run, RECONSTRUCT_RECTIFY, rectify(run)) : error;
}

// What is in rings is gone. The left picture in colour can be made again by who asks for its rows.
static void end_pictures(struct run *run) {
    struct reconstruct_result *result = run->result;
    struct pictures *pictures = run->pictures;
    if (pictures == NULL) {
        return;
    }
    result->stage_us[RECONSTRUCT_DEVELOP] += pictures->develop_us + run->ahead.develop_us;
    result->stage_us[RECONSTRUCT_RECTIFY] += pictures->rectify_us + run->ahead.rectify_us;
    pictures->now_us = NULL;
    if (has_rings(run->options)) {
        pictures_want(pictures, 1, true);
        result->pictures = pictures;
        result->left.data = result->right.data = result->right_colour.data = NULL;
    }
}

const uint8_t *reconstruct_colour_row(const struct reconstruct_result *result, int y) {
    if (result->pictures != NULL) {
        pictures_rows(result->pictures, y, y + 1);
    }
    return image_rgb8_row(&result->left_colour, y);
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
        const struct fill_input input = {&result->left_colour, result->left_span, &result->sigma};
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
    if (!take_maps(run) || !take_pictures(run)) {
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
    run.match_need = match_needs_of(plan, options, run.parallel->threads);
    result->watch = run.environment->watch;
    const int error = all_stages(&run);
    end_pictures(&run);
    arena->peak_bytes = larger(arena->peak_bytes, run.peak_bytes);
    result->arena_peak_bytes = arena->peak_bytes;
    return error;
}
