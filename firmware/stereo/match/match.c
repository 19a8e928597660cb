// SPDX-License-Identifier: Apache-2.0
#include "stereo/match/match.h"

#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "stereo/match/checks.h"
#include "stereo/match/kernels.h"
#include "stereo/match/state.h"

_Static_assert(sizeof match_methods / sizeof *match_methods == MATCH_PRESET_COUNT,
               "one for each preset");

const char *match_preset_name(enum match_preset preset) {
    return (unsigned)preset < MATCH_PRESET_COUNT ? match_methods[preset].name : NULL;
}

enum match_preset match_preset_named(const char *name) {
    unsigned preset = 0;
    while (preset < MATCH_PRESET_COUNT && strcmp(match_methods[preset].name, name) != 0) {
        preset++;
    }
    return (enum match_preset)preset;
}

struct match_options match_default_options(int disparity_min, int disparity_count) {
    return (struct match_options){.disparity_min = disparity_min,
                                  .disparity_count = disparity_count,
                                  .preset = MATCH_PRESET_STANDARD,
                                  .speckle_px = match_rules[MATCH_ISLAND].limit};
}

// No sum here can overflow.
bool match_range_is_legal(const struct match_options *options) {
    return options->disparity_count >= 1 && options->disparity_count <= MATCH_MAX_DISPARITIES &&
           options->extra_below >= 0 && options->extra_below <= MATCH_MAX_DISPARITIES &&
           options->extra_above >= 0 && options->extra_above <= MATCH_MAX_DISPARITIES &&
           match_searched_count(options) <= MATCH_MAX_DISPARITIES &&
           options->disparity_min >= -MATCH_DISPARITY_LIMIT + options->extra_below &&
           match_searched_count(options) - options->extra_below <=
               MATCH_DISPARITY_LIMIT - options->disparity_min;
}

static int larger(int a, int b) {
    return a > b ? a : b;
}

void *match_take(struct match_memory *memory, size_t count, size_t element_bytes) {
    memory->need_bytes += arena_need_bytes(count, element_bytes);
    void *taken =
        memory->arena == NULL ? NULL : arena_take_fast(memory->arena, count, element_bytes);
    memory->failed = memory->failed || taken == NULL;
    return taken;
}

static void set_state(struct match_state *state, int width, int height,
                      const struct match_options *options, int threads) {
    state->options = *options;
    if (options->kernels == NULL) {
        state->options.kernels = match_kernels_best();
    }
    state->method = &match_methods[options->preset];
    state->threads = threads < 1 ? 1 : (threads > MATCH_MAX_THREADS ? MATCH_MAX_THREADS : threads);
    match_set_levels(state, width, height);
    match_plan_rows(state);
}

struct match_need match_needs(int width, int height, const struct match_options *options,
                              int threads) {
    struct match_need need = {.rows_kept = CHECKS_ROWS_KEPT, .rows_ahead = 1};
    if (width < 1 || width > IMAGE_MAX_SIDE_PX || height < 1 || height > IMAGE_MAX_SIDE_PX ||
        !match_range_is_legal(options) || options->speckle_px < 0 ||
        (unsigned)options->preset >= MATCH_PRESET_COUNT) {
        return (struct match_need){.bytes = 0};
    }
    if (options->preset == MATCH_PRESET_PAPER) {
        need.bytes = match_paper_need_bytes(width, options);
    } else {
        struct match_state state = {.input = NULL};
        set_state(&state, width, height, options, threads);
        struct match_memory memory = {0};
        match_take_memory(&state, &memory);
        const size_t filtering = speckle_filter_need_bytes(width, options->speckle_px, threads);
        const size_t checking = match_check_blocks_need_bytes(width, height, threads);
        const size_t after = filtering > checking ? filtering : checking;
        need.bytes = memory.need_bytes > after ? memory.need_bytes : after;
        need.rows_kept = larger(need.rows_kept, state.kept_rows);
        need.rows_ahead = match_ahead_step(&state);
    }
    need.rows_kept = need.rows_kept < height ? need.rows_kept : height;
    return need;
}

uint64_t match_work(int width, int height, const struct match_options *options) {
    if (match_needs(width, height, options, 1).bytes == 0) {
        return 0;
    }
    if (options->preset == MATCH_PRESET_PAPER) {
        return (uint64_t)TUNE_PAPER_LANES * (uint64_t)width * (uint64_t)height;
    }
    struct match_state state;
    set_state(&state, width, height, options, 1);
    uint64_t cells = 0;
    for (int i = 0; i < state.levels; i++) {
        const struct match_level *level = &state.level[i];
        cells += (uint64_t)level->tiles * MATCH_TILE_COLUMNS * (uint64_t)level->height *
                 (uint64_t)match_mean_lanes(level);
    }
    return cells;
}

static bool is_size_of_colour(const struct image_rgb8 *colour, int width, int height) {
    return colour->data == NULL || (colour->width == width && colour->height == height);
}

static bool sizes_agree(const struct match_input *input, const struct match_output *output) {
    const int width = input->left.width, height = input->left.height;
    return input->right.width == width && input->right.height == height &&
           is_size_of_colour(&input->left_colour, width, height) &&
           is_size_of_colour(&input->right_colour, width, height) &&
           output->disparity_q8.width == width && output->disparity_q8.height == height &&
           output->reason.width == width && output->reason.height == height &&
           output->confidence.width == width && output->confidence.height == height;
}

int match_check(const struct match_input *input, const struct match_options *options,
                const struct match_output *output) {
    const struct image_u8 *left = &input->left;
    if (!sizes_agree(input, output)) {
        return ERROR_SIZE_MISMATCH;
    }
    if (left->width > IMAGE_MAX_SIDE_PX || left->height > IMAGE_MAX_SIDE_PX) {
        return ERROR_TOO_LARGE;
    }
    if (left->width < MATCH_MIN_WIDTH_PX || left->height < MATCH_MIN_HEIGHT_PX) {
        return ERROR_TOO_SMALL;
    }
    if (!match_range_is_legal(options)) {
        return ERROR_DISPARITY_RANGE;
    }
    const bool legal = options->speckle_px >= 0 && (unsigned)options->preset < MATCH_PRESET_COUNT;
    return legal ? ERROR_OK : ERROR_ARGUMENT;
}

int match_run(const struct match_input *input, const struct match_options *options,
              const struct parallel *parallel, match_progress *progress, void *progress_self,
              struct arena *arena, struct match_output *output) {
    const int error = match_check(input, options, output);
    if (error != ERROR_OK) {
        return error;
    }
    if (options->preset == MATCH_PRESET_PAPER) {
        return match_paper_run(input, options, progress, progress_self, arena, output);
    }
    struct match_state state = {.input = input, .output = output, .parallel = parallel};
    set_state(&state, input->left.width, input->left.height, options, parallel->threads);
    match_look_at(input, &state.look);
    return match_run_steps(&state, progress, progress_self, arena);
}
