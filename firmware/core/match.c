// SPDX-License-Identifier: Apache-2.0
#include "core/match.h"

#include "core/error.h"
#include "core/invariant.h"
#include "core/match_kernels.h"
#include "core/match_level.h"
#include "core/match_state.h"
#include "core/vet.h"

struct match_method exp_methods[4] = {{0,1,1024,20},{32,1,48,20},{16,1,48,20},{16,2,48,20}};
int exp_margin=3,exp_ac=4,exp_ar=2;
int exp_method=0;

struct match_options match_default_options(int disparity_min, int disparity_count) {
    return (struct match_options){
        .disparity_min = disparity_min, .disparity_count = disparity_count, .speckle_px = 60};
}

// Of any numbers that a caller may have written: no sum here can overflow.
static bool range_is_legal(const struct match_options *options) {
    return options->disparity_count >= 1 && options->disparity_count <= MATCH_MAX_DISPARITIES &&
           options->disparity_min >= -MATCH_DISPARITY_LIMIT &&
           options->disparity_min <= MATCH_DISPARITY_LIMIT - options->disparity_count;
}

static int check(const struct match_input *input, const struct match_options *options,
                 const struct match_output *output) {
    const struct image_u8 *left = &input->left;
    if (input->right.width != left->width || input->right.height != left->height ||
        output->disparity_q8.width != left->width || output->disparity_q8.height != left->height ||
        output->reason.width != left->width || output->reason.height != left->height ||
        output->confidence.width != left->width || output->confidence.height != left->height) {
        return ERROR_SIZE_MISMATCH;
    }
    if (left->width > IMAGE_MAX_SIDE_PX || left->height > IMAGE_MAX_SIDE_PX) {
        return ERROR_TOO_LARGE;
    }
    if (left->width < MATCH_MIN_WIDTH_PX || left->height < MATCH_MIN_HEIGHT_PX) {
        return ERROR_TOO_SMALL;
    }
    if (!range_is_legal(options)) {
        return ERROR_DISPARITY_RANGE;
    }
    return options->speckle_px < 0 ? ERROR_ARGUMENT : ERROR_OK;
}

static void set_state(struct match_state *state, int width, int height,
                      const struct match_options *options, int threads) {
    state->options = *options;
    if (options->kernels == NULL) {
        state->options.kernels = match_kernels_best();
    }
    state->method = &exp_methods[exp_method];
    state->threads = threads < 1 ? 1 : (threads > MATCH_MAX_THREADS ? MATCH_MAX_THREADS : threads);
    match_set_levels(state, width, height);
}

size_t match_need_bytes(int width, const struct match_options *options, int threads) {
    if (width < 1 || width > IMAGE_MAX_SIDE_PX || !range_is_legal(options) ||
        options->speckle_px < 0) {
        return 0;
    }
    struct match_state state;
    set_state(&state, width, IMAGE_MAX_SIDE_PX, options, threads);
    struct match_memory memory = {0};
    match_take_memory(&state, &memory);
    const size_t vetting = vet_need_bytes(options->speckle_px);
    return memory.need_bytes > vetting ? memory.need_bytes : vetting;
}

int match_run(const struct match_input *input, const struct match_options *options,
              const struct parallel *parallel, match_progress *progress, void *progress_self,
              struct arena *arena, struct match_output *output) {
    const int error = check(input, options, output);
    if (error != ERROR_OK) {
        return error;
    }
    const size_t mark = arena_mark(arena);
    struct match_state state = {.input = input, .output = output, .parallel = parallel};
    const int height = input->left.height;
    set_state(&state, input->left.width, height, options, parallel->threads);
    struct match_memory memory = {.arena = arena};
    match_take_memory(&state, &memory);
    if (memory.failed) {
        arena_release(arena, mark);
        return ERROR_MEMORY;
    }
    match_begin_levels(&state);
    bool cancelled = false;
    for (int y = 0; y < height && !cancelled; y += MATCH_BAND_ROWS) {
        const int end = y + MATCH_BAND_ROWS < height ? y + MATCH_BAND_ROWS : height;
        match_advance(&state.level[0], end);
        cancelled = progress != NULL && !progress(progress_self, end, height);
    }
    arena_release(arena, mark);
    if (cancelled) {
        return ERROR_CANCELLED;
    }
    return options->keep_all ? ERROR_OK : vet_speckles(options->speckle_px, arena, output);
}
