// SPDX-License-Identifier: Apache-2.0
#include "core/match_level.h"

#include <string.h>

#include "core/invariant.h"
#include "core/match_kernels.h"
#include "core/match_window.h"

static int padded_lanes(int disparity_count) {
    return (disparity_count + MATCH_LANES - 1) / MATCH_LANES * MATCH_LANES;
}

static int scaled_down(int value, int shift) {
    const int rest = value & ((1 << shift) - 1);
    return (value - rest) / (1 << shift);
}

static void set_level(struct match_level *level, int width, int height, int disparity_min,
                      int disparity_count) {
    level->width = width;
    level->height = height;
    level->tiles = (width + MATCH_TILE_COLUMNS - 1) / MATCH_TILE_COLUMNS;
    level->disparity_min = disparity_min;
    level->disparity_count = disparity_count;
    level->lanes = padded_lanes(disparity_count);
    const int front = -disparity_min;
    const int behind = disparity_min + level->lanes;
    level->right_pad = front > 0 ? front : 0;
    level->right_length = width + level->right_pad + (behind > 0 ? behind : 0);
}

// Lanes a column on average for which a level has memory.
static int mean_lanes(const struct match_level *level) {
    const int lanes = level->state->method->lanes;
    return level->coarser == NULL || level->lanes < lanes ? level->lanes : lanes;
}

// Whether a level gets a coarser one: it has many disparities, and enough columns are left.
static bool is_halved(const struct match_level *level) {
    const struct match_method *method = level->state->method;
    return method->coarse_disparities > 0 && level->disparity_count > method->coarse_disparities &&
           level->width >> method->halvings >= MATCH_MIN_WIDTH_PX;
}

void match_set_levels(struct match_state *state, int width, int height) {
    const struct match_method *method = state->method;
    state->level[0] = (struct match_level){.state = state, .shift_y = method->halved_rows};
    set_level(&state->level[0], width, height >> method->halved_rows, state->options.disparity_min,
              state->options.disparity_count);
    state->levels = 1;
    while (state->levels < MATCH_MAX_LEVELS && is_halved(&state->level[state->levels - 1])) {
        struct match_level *finer = &state->level[state->levels - 1];
        struct match_level *level = &state->level[state->levels];
        const int shift = state->levels * method->halvings;
        // A low image keeps its rows: how much memory is needed does not depend on the height.
        int shift_y = finer->shift_y;
        while (shift_y < shift && height >> (shift_y + 1) >= MATCH_MIN_HEIGHT_PX) {
            shift_y++;
        }
        *level = (struct match_level){.state = state, .shift_x = shift, .shift_y = shift_y};
        const int lowest = scaled_down(finer->disparity_min, method->halvings);
        const int highest =
            scaled_down(finer->disparity_min + finer->disparity_count - 1, method->halvings);
        set_level(level, width >> shift, height >> shift_y, lowest, highest - lowest + 1);
        finer->coarser = level;
        state->levels++;
    }
    for (int i = 0; i < state->levels; i++) {
        struct match_level *level = &state->level[i];
        level->row_bytes = (size_t)level->tiles * MATCH_TILE_COLUMNS * (size_t)mean_lanes(level);
    }
}

static void *take(struct match_memory *memory, size_t count, size_t element_bytes) {
    memory->need_bytes += arena_need_bytes(count, element_bytes);
    void *taken = memory->arena == NULL ? NULL : arena_take(memory->arena, count, element_bytes);
    memory->failed = memory->failed || taken == NULL;
    return taken;
}

static void take_level(struct match_level *level, struct match_memory *memory) {
    const size_t columns = (size_t)level->tiles * MATCH_TILE_COLUMNS;
    for (int i = 0; i < 3; i++) {
        level->tile[i] = take(memory, (size_t)level->tiles, sizeof *level->tile[i]);
    }
    for (int i = 0; i < MATCH_RING_ROWS; i++) {
        level->ring[i] = take(memory, level->row_bytes, 1);
    }
    for (int i = 0; i <= MATCH_BAND_ROWS; i++) {
        level->from_above[i] = take(memory, level->row_bytes, 1);
    }
    level->down[0] = take(memory, level->row_bytes, 1);
    // Where windows never change, the averages stay in place.
    level->down[1] = level->coarser == NULL ? level->down[0] : take(memory, level->row_bytes, 1);
    level->down_mass = take(memory, columns, sizeof *level->down_mass);
    for (int i = 0; i < MATCH_GUIDE_ROWS && level->shift_x + level->shift_y > 0; i++) {
        level->guide[i] = take(memory, columns, 1);
    }
    for (int i = 0; i < MATCH_SURFACE_ROWS && level != &level->state->level[0]; i++) {
        level->surface[i] = take(memory, columns, sizeof *level->surface[i]);
    }
}

// Hands out parts of a block of memory; counts where there is no block.
struct block {
    uint8_t *at;
    size_t used_bytes;
};

static void *carve(struct block *block, size_t count, size_t element_bytes) {
    uint8_t *result = block->at == NULL ? NULL : block->at + block->used_bytes;
    const size_t bytes = count * element_bytes;
    block->used_bytes += (bytes + ARENA_ALIGNMENT - 1) / ARENA_ALIGNMENT * ARENA_ALIGNMENT;
    return result;
}

// What phase 1 needs. What is written late lies where something else is no longer needed.
static void carve_cost(const struct match_level *level, int rows, struct block *block,
                       struct match_scratch *scratch) {
    const size_t width = (size_t)level->width;
    const size_t right = (size_t)level->right_length;
    for (int j = 0; j < rows + 2 * MATCH_CENSUS_RADIUS; j++) {
        scratch->source[j] = carve(block, width + 2 * MATCH_CENSUS_RADIUS, 1);
    }
    for (int r = 0; r < rows; r++) {
        struct match_line *line = &scratch->line[r];
        for (int plane = 0; plane < MATCH_CENSUS_PLANES; plane++) {
            line->cost.left.census[plane] = carve(block, width, 1);
            line->cost.right.census[plane] = carve(block, right, 1);
        }
        line->cost.left.gradient = carve(block, width, 1);
        line->cost.right.gradient = carve(block, right, 1);
        line->cost.forward = carve(block, width, sizeof(match_share));
        line->cost.backward = carve(block, width, sizeof(match_share));
        line->cost.weight = carve(block, width, sizeof(uint16_t));
        line->cost.joined = line->cost.weight;
    }
    scratch->box = scratch->line[0].cost.forward;
}

// What phase 3 needs, and what is needed when all is done.
static void carve_row(const struct match_level *level, int rows, struct block *block,
                      struct match_scratch *scratch) {
    const size_t width = (size_t)level->width;
    for (int r = 0; r < rows; r++) {
        struct match_line *line = &scratch->line[r];
        line->row.penalty = carve(block, width + 1, 1);
        line->row.consistent = line->row.penalty;
        line->row.margin = carve(block, width, 1);
        line->row.lane = carve(block, width, sizeof *line->row.lane);
        line->row.around = carve(block, width, sizeof *line->row.around);
        line->row.fit = carve(block, width, 1);
        line->row.textured = line->row.fit;
        line->row.right_x = carve(block, width, sizeof *line->row.right_x);
        line->row.fits = (uint8_t *)line->row.right_x;
        line->row.claim = carve(block, width + 1, sizeof *line->row.claim);
        line->row.darkest = (uint8_t *)line->row.claim;
        line->row.brightest = line->row.darkest == NULL ? NULL : line->row.darkest + width;
    }
    scratch->finish = (int32_t *)scratch->line[0].row.claim;
}

static int rows_abreast(int threads) {
    const int rows = MATCH_BAND_ROWS / threads / MATCH_PAIR_ROWS * MATCH_PAIR_ROWS;
    return rows < MATCH_ROWS_ABREAST ? rows : MATCH_ROWS_ABREAST;
}

// Levels and phases take turns, so what is enough for the largest one serves all.
static void take_scratch(const struct match_state *state, struct match_memory *memory,
                         struct match_scratch *scratch) {
    const struct match_level *level = &state->level[0];
    const int rows = rows_abreast(state->threads);
    scratch->running = take(memory, (size_t)level->lanes * MATCH_TILE_COLUMNS, 1);
    struct block cost = {NULL, 0};
    struct block row = {NULL, 0};
    carve_cost(level, rows, &cost, scratch);
    carve_row(level, rows, &row, scratch);
    const size_t bytes = cost.used_bytes > row.used_bytes ? cost.used_bytes : row.used_bytes;
    cost = (struct block){take(memory, bytes, 1), 0};
    row = cost;
    if (cost.at != NULL) {
        carve_cost(level, rows, &cost, scratch);
        carve_row(level, rows, &row, scratch);
    }
}

void match_take_memory(struct match_state *state, struct match_memory *memory) {
    for (int i = 0; i < state->levels; i++) {
        take_level(&state->level[i], memory);
    }
    state->scratch = take(memory, (size_t)state->threads, sizeof *state->scratch);
    for (int i = 0; i < state->threads; i++) {
        struct match_scratch counted;
        struct match_scratch *scratch = state->scratch == NULL ? &counted : &state->scratch[i];
        take_scratch(state, memory, scratch);
        scratch->first_slot =
            i * (MATCH_BAND_ROWS / state->threads / MATCH_PAIR_ROWS) * MATCH_PAIR_ROWS;
    }
}

static void plan(struct match_level *level, int band_begin) {
    if (level->coarser != NULL) {
        match_advance(level->coarser, match_window_rows(level, band_begin));
    }
    match_plan_windows(level, band_begin, level->state->scratch, level->tile[1], level->tile[2]);
}

void match_begin_levels(struct match_state *state) {
    for (int i = state->levels - 1; i >= 0; i--) {
        struct match_level *level = &state->level[i];
        level->band_begin = level->band_end = level->cost_end = level->rows_done = 0;
        // Cells of columns beyond the image and rows below it are looked at, though nothing comes
        // of them.
        for (int j = 0; j < MATCH_RING_ROWS; j++) {
            memset(level->ring[j], 0, level->row_bytes);
        }
        for (int j = 0; j <= MATCH_BAND_ROWS; j++) {
            memset(level->from_above[j], 0, level->row_bytes);
        }
        memset(level->down[0], 0, level->row_bytes);
        memset(level->down[1], 0, level->row_bytes);
        memset(level->down_mass, 0,
               (size_t)level->tiles * MATCH_TILE_COLUMNS * sizeof *level->down_mass);
        memset(level->tile[1], 0, (size_t)level->tiles * sizeof *level->tile[1]);
        plan(level, 0);
    }
}

struct part_context {
    struct match_level *level;
    const struct match_kernels *kernels;
    int begin, end;  // pairs of rows, or tiles
    int parts;
};

static void part_range(const struct part_context *context, int index, int *begin, int *end) {
    const int total = context->end - context->begin;
    *begin = context->begin + total * index / context->parts;
    *end = context->begin + total * (index + 1) / context->parts;
}

// Rows that one call may take from row y on: no more than `end`, and not beyond the band.
static int rows_together(const struct match_level *level, int y, int end) {
    const int abreast = rows_abreast(level->state->threads);
    const int border = level->band_begin + MATCH_BAND_ROWS;
    const int beyond = y < border && end > border ? border : end;
    return beyond - y < abreast ? beyond - y : abreast;
}

static void cost_part(void *context_pointer, int index) {
    struct part_context *context = context_pointer;
    struct match_level *level = context->level;
    int begin;
    int end;
    part_range(context, index, &begin, &end);
    for (int y = MATCH_PAIR_ROWS * begin; y < MATCH_PAIR_ROWS * end;) {
        const int rows = rows_together(level, y, MATCH_PAIR_ROWS * end);
        context->kernels->cost_rows(level, &level->state->scratch[index], y, rows);
        y += rows;
    }
}

static void column_part(void *context_pointer, int index) {
    struct part_context *context = context_pointer;
    int begin;
    int end;
    part_range(context, index, &begin, &end);
    context->kernels->columns(context->level, &context->level->state->scratch[index], begin, end);
}

static void row_part(void *context_pointer, int index) {
    struct part_context *context = context_pointer;
    struct match_level *level = context->level;
    int begin;
    int end;
    part_range(context, index, &begin, &end);
    for (int y = MATCH_PAIR_ROWS * begin; y < MATCH_PAIR_ROWS * end;) {
        const int rows = rows_together(level, y, MATCH_PAIR_ROWS * end);
        context->kernels->rows(level, &level->state->scratch[index], y, rows);
        y += rows;
    }
}

static void run_phase(struct match_level *level, void (*part)(void *context, int index), int begin,
                      int end) {
    const struct match_state *state = level->state;
    struct part_context context = {level, state->options.kernels, begin, end, state->threads};
    state->parallel->run(state->parallel->self, part, &context, context.parts);
}

static void swap_rows(uint8_t **a, uint8_t **b) {
    uint8_t *kept = *a;
    *a = *b;
    *b = kept;
}

// Pairs of rows up to row y.
static int pairs(int y) {
    return (y + MATCH_PAIR_ROWS - 1) / MATCH_PAIR_ROWS;
}

static void begin_band(struct match_level *level) {
    const int last = level->band_end - level->band_begin;
    swap_rows(&level->from_above[0], &level->from_above[last]);
    swap_rows(&level->down[0], &level->down[1]);
    struct match_tile *before = level->tile[0];
    level->tile[0] = level->tile[1];
    level->tile[1] = level->tile[2];
    level->tile[2] = before;
    level->band_begin = level->band_end;
    const int end = level->band_begin + MATCH_BAND_ROWS;
    level->band_end = end < level->height ? end : level->height;
    if (level->band_end < level->height) {
        plan(level, level->band_end);
    }
}

static void run_band(struct match_level *level) {
    begin_band(level);
    const int ahead = level->band_begin + MATCH_RING_ROWS;
    const int cost_end = pairs(ahead < level->height ? ahead : level->height) * MATCH_PAIR_ROWS;
    INVARIANT(level->cost_end <= cost_end && cost_end - level->band_begin <= MATCH_RING_ROWS);
    run_phase(level, cost_part, level->cost_end / MATCH_PAIR_ROWS, cost_end / MATCH_PAIR_ROWS);
    level->cost_end = cost_end;
    run_phase(level, column_part, 0, level->tiles);
    run_phase(level, row_part, level->band_begin / MATCH_PAIR_ROWS, pairs(level->band_end));
    level->rows_done = level->band_end;
}

static void finish_part(void *context_pointer, int index) {
    struct part_context *context = context_pointer;
    int begin;
    int end;
    part_range(context, index, &begin, &end);
    context->kernels->finish(context->level, &context->level->state->scratch[index], begin, end);
}

void match_finish(struct match_state *state) {
    run_phase(&state->level[0], finish_part, 0, state->level[0].width);
}

void match_advance(struct match_level *level, int rows) {
    INVARIANT(rows <= level->height);
    while (level->rows_done < rows) {
        run_band(level);
    }
}
