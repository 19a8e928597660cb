// SPDX-License-Identifier: Apache-2.0
#include "core/match.h"

#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/match_kernels.h"
#include "core/match_state.h"
#include "core/vet.h"

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

static int padded_lanes(int disparity_count) {
    return (disparity_count + MATCH_LANES - 1) / MATCH_LANES * MATCH_LANES;
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

// Weight of a neighbour across a grey step: 0.9 exp(-step / 14), in 1/4096; and the large penalty,
// lowered where an edge makes a jump plausible.
static void fill_tables(struct match_state *state) {
    enum { LARGE_MAX = 120, LARGE_MIN = 40 };
    // exp(-1/14) as a fraction, applied step by step.
    const double decay = 0.93106277970408;
    double weight = 0.9 * MATCH_MASS_ONE;
    for (int step = 0; step < 256; step++) {
        state->weight_of_step[step] = (uint16_t)weight;
        weight *= decay;
        const int large = LARGE_MAX * 10 / (10 + step);
        state->large_of_step[step] = (uint8_t)(large < LARGE_MIN ? LARGE_MIN : large);
    }
}

static void fill_inverse_masses(struct match_state *state) {
    for (int i = MATCH_MASS_ONE / MATCH_MASS_STEP; i < MATCH_MASS_STEPS; i++) {
        const uint32_t middle = (uint32_t)(i * MATCH_MASS_STEP + MATCH_MASS_STEP / 2);
        state->inverse_mass[i] =
            (uint16_t)((uint32_t)MATCH_WEIGHT_ONE * MATCH_INVERSE_ONE / middle);
    }
}

static bool take_line(const struct match_state *state, struct arena *arena,
                      struct match_line *line) {
    const size_t width = (size_t)state->width;
    const size_t lanes = (size_t)state->lanes;
    line->cells = arena_take(arena, width * lanes, 1);
    line->message[0] = arena_take(arena, lanes, 1);
    line->message[1] = arena_take(arena, lanes, 1);
    line->sum = arena_take(arena, lanes, sizeof *line->sum);
    line->right_lowest = arena_take(arena, width, sizeof *line->right_lowest);
    line->right_index = arena_take(arena, width, sizeof *line->right_index);
    line->index = arena_take(arena, width, sizeof *line->index);
    return line->cells != NULL && line->message[0] != NULL && line->message[1] != NULL &&
           line->sum != NULL && line->right_lowest != NULL && line->right_index != NULL &&
           line->index != NULL;
}

static bool take_scratch(const struct match_state *state, struct arena *arena,
                         struct match_scratch *scratch) {
    const size_t width = (size_t)state->width;
    const size_t lanes = (size_t)state->lanes;
    const size_t padded = width + 2 * MATCH_CENSUS_RADIUS;
    const size_t right = width + (size_t)state->right_pad_total;
    bool taken = true;
    for (int j = 0; j <= 2 * MATCH_CENSUS_RADIUS; j++) {
        taken = (scratch->window[j] = arena_take(arena, padded, 1)) != NULL && taken;
    }
    for (int plane = 0; plane < MATCH_CENSUS_PLANES; plane++) {
        taken = (scratch->left.census[plane] = arena_take(arena, width, 1)) != NULL && taken;
        taken = (scratch->right.census[plane] = arena_take(arena, right, 1)) != NULL && taken;
    }
    taken = (scratch->left.gradient = arena_take(arena, width, 1)) != NULL && taken;
    taken = (scratch->right.gradient = arena_take(arena, right, 1)) != NULL && taken;
    taken = (scratch->weight = arena_take(arena, width + 1, sizeof(uint16_t))) != NULL && taken;
    taken = (scratch->mass = arena_take(arena, width, sizeof(uint16_t))) != NULL && taken;
    taken = (scratch->strip = arena_take(arena, lanes, MATCH_STRIP_COLUMNS)) != NULL && taken;
    for (int r = 0; r < MATCH_ROWS_ABREAST; r++) {
        taken = take_line(state, arena, &scratch->line[r]) && taken;
    }
    // Costs are done with before messages from the left begin.
    scratch->cells = scratch->line[0].cells;
    return taken;
}

static bool take_state(struct match_state *state, struct arena *arena) {
    const size_t width = (size_t)state->width;
    const size_t cells = width * (size_t)state->lanes;
    bool taken = true;
    for (int i = 0; i < MATCH_RING_ROWS; i++) {
        taken = (state->ring[i] = arena_take(arena, cells, 1)) != NULL && taken;
    }
    for (int i = 0; i <= MATCH_BAND_ROWS; i++) {
        state->from_above[i] = arena_take(arena, cells, 1);
        taken = state->from_above[i] != NULL && taken;
    }
    taken = (state->above_lowest = arena_take(arena, width, 1)) != NULL && taken;
    taken = (state->down = arena_take(arena, cells, 1)) != NULL && taken;
    taken = (state->down_mass = arena_take(arena, width, sizeof(uint16_t))) != NULL && taken;
    state->scratch = arena_take(arena, (size_t)state->threads, sizeof *state->scratch);
    if (!taken || state->scratch == NULL) {
        return false;
    }
    for (int i = 0; i < state->threads; i++) {
        taken = take_scratch(state, arena, &state->scratch[i]) && taken;
    }
    return taken;
}

static void set_geometry(struct match_state *state, int width, const struct match_options *options,
                         int threads) {
    state->options = *options;
    if (options->kernels == NULL) {
        state->options.kernels = match_kernels_best();
    }
    state->width = width;
    state->lanes = padded_lanes(options->disparity_count);
    const int front = -options->disparity_min;
    const int behind = options->disparity_min + state->lanes;
    state->right_pad = front > 0 ? front : 0;
    state->right_pad_total = state->right_pad + (behind > 0 ? behind : 0);
    state->threads = threads < 1 ? 1 : (threads > MATCH_BAND_ROWS ? MATCH_BAND_ROWS : threads);
}

size_t match_need_bytes(int width, const struct match_options *options, int threads) {
    if (width < 1 || width > IMAGE_MAX_SIDE_PX || !range_is_legal(options) ||
        options->speckle_px < 0) {
        return 0;
    }
    struct match_state state;
    set_geometry(&state, width, options, threads);
    const size_t pixels = (size_t)width;
    const size_t cells = arena_need_bytes(pixels * (size_t)state.lanes, 1);
    const size_t right = arena_need_bytes(pixels + (size_t)state.right_pad_total, 1);
    const size_t lane_row = arena_need_bytes((size_t)state.lanes, sizeof(uint16_t));
    const size_t row_u16 = arena_need_bytes(pixels + 1, sizeof(uint16_t));
    const size_t shared = (MATCH_RING_ROWS + MATCH_BAND_ROWS + 2) * cells + 2 * row_u16 +
                          arena_need_bytes((size_t)state.threads, sizeof(struct match_scratch));
    const size_t vetting = vet_need_bytes(options->speckle_px);
    const size_t a_thread = 9 * arena_need_bytes(pixels + 2 * MATCH_CENSUS_RADIUS, 1) + 4 * right +
                            2 * row_u16 +
                            arena_need_bytes((size_t)state.lanes, MATCH_STRIP_COLUMNS) +
                            MATCH_ROWS_ABREAST * (cells + 3 * lane_row + 3 * row_u16);
    const size_t matching = shared + (size_t)state.threads * a_thread;
    return matching > vetting ? matching : vetting;
}

struct part_context {
    struct match_state *state;
    const struct match_kernels *kernels;
    int begin, end;  // rows or columns to share out
    int parts;
};

static void part_range(const struct part_context *context, int index, int *begin, int *end) {
    const int total = context->end - context->begin;
    *begin = context->begin + total * index / context->parts;
    *end = context->begin + total * (index + 1) / context->parts;
}

static void cost_part(void *context_pointer, int index) {
    struct part_context *context = context_pointer;
    int begin;
    int end;
    part_range(context, index, &begin, &end);
    for (int y = begin; y < end; y++) {
        context->kernels->cost_row(context->state, &context->state->scratch[index], y);
    }
}

static void column_part(void *context_pointer, int index) {
    struct part_context *context = context_pointer;
    int begin;
    int end;
    part_range(context, index, &begin, &end);
    context->kernels->columns(context->state, &context->state->scratch[index], begin, end);
}

static void row_part(void *context_pointer, int index) {
    struct part_context *context = context_pointer;
    int begin;
    int end;
    part_range(context, index, &begin, &end);
    context->kernels->rows(context->state, &context->state->scratch[index], begin, end);
}

static void run_phase(struct match_state *state, const struct parallel *parallel,
                      void (*part)(void *context, int index), int begin, int end) {
    struct part_context context = {state, state->options.kernels, begin, end, state->threads};
    parallel->run(parallel->self, part, &context, context.parts);
}

static void run_band(struct match_state *state, const struct parallel *parallel) {
    const int ahead = state->band_end + MATCH_AHEAD_ROWS;
    const int cost_end = ahead < state->height ? ahead : state->height;
    run_phase(state, parallel, cost_part, state->cost_end, cost_end);
    state->cost_end = cost_end;
    run_phase(state, parallel, column_part, 0, state->width);
    run_phase(state, parallel, row_part, state->band_begin, state->band_end);
    uint8_t *last = state->from_above[state->band_end - state->band_begin];
    state->from_above[state->band_end - state->band_begin] = state->from_above[0];
    state->from_above[0] = last;
}

int match_run(const struct match_input *input, const struct match_options *options,
              const struct parallel *parallel, match_progress *progress, void *progress_self,
              struct arena *arena, struct match_output *output) {
    const int error = check(input, options, output);
    if (error != ERROR_OK) {
        return error;
    }
    const size_t mark = arena_mark(arena);
    struct match_state state = {.input = input, .output = output, .height = input->left.height};
    set_geometry(&state, input->left.width, options, parallel->threads);
    fill_tables(&state);
    fill_inverse_masses(&state);
    if (!take_state(&state, arena)) {
        arena_release(arena, mark);
        return ERROR_MEMORY;
    }
    bool cancelled = false;
    for (int y = 0; y < state.height && !cancelled; y += MATCH_BAND_ROWS) {
        state.band_begin = y;
        state.band_end = y + MATCH_BAND_ROWS < state.height ? y + MATCH_BAND_ROWS : state.height;
        run_band(&state, parallel);
        cancelled = progress != NULL && !progress(progress_self, state.band_end, state.height);
    }
    arena_release(arena, mark);
    if (cancelled) {
        return ERROR_CANCELLED;
    }
    return options->keep_all ? ERROR_OK : vet_speckles(options->speckle_px, arena, output);
}
