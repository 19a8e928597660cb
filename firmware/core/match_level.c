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

void match_set_levels(struct match_state *state, int width, int height) {
    const int wide = state->method->coarse_disparities;
    const int halvings = state->method->halvings;
    set_level(&state->level[0], width, height, state->options.disparity_min,
              state->options.disparity_count);
    state->levels = 1;
    for (int i = 0; i < MATCH_MAX_LEVELS; i++) {
        struct match_level *level = &state->level[i];
        level->state = state;
        level->shift = i * state->method->halvings;
        level->coarser = NULL;
        int mean_lanes = level->lanes;
        const bool halve = wide > 0 && level->disparity_count > wide &&
                           level->width >> halvings >= MATCH_MIN_WIDTH_PX &&
                           level->height >> halvings >= MATCH_MIN_HEIGHT_PX && i + 1 < MATCH_MAX_LEVELS;
        if (halve) {
            const int lowest = scaled_down(level->disparity_min, halvings);
            const int highest =
                scaled_down(level->disparity_min + level->disparity_count - 1, halvings);
            set_level(&state->level[i + 1], level->width >> halvings, level->height >> halvings, lowest,
                      highest - lowest + 1);
            level->coarser = &state->level[i + 1];
            state->levels = i + 2;
            mean_lanes = mean_lanes < state->method->mean_lanes ? mean_lanes
                                                                : state->method->mean_lanes;
        }
        level->row_bytes = (size_t)level->tiles * MATCH_TILE_COLUMNS * (size_t)mean_lanes;
        if (!halve) {
            break;
        }
    }
}

static void *take(struct match_memory *memory, size_t count, size_t element_bytes) {
    memory->need_bytes += arena_need_bytes(count, element_bytes);
    void *taken =
        memory->arena == NULL ? NULL : arena_take(memory->arena, count, element_bytes);
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
    level->down[1] =
        level->coarser == NULL ? level->down[0] : take(memory, level->row_bytes, 1);
    level->down_mass = take(memory, columns, sizeof *level->down_mass);
    for (int i = 0; i < MATCH_GUIDE_ROWS && level->shift > 0; i++) {
        level->guide[i] = take(memory, columns, 1);
    }
    for (int i = 0; i < MATCH_SURFACE_ROWS && level->shift > 0; i++) {
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

static void carve_cost_line(const struct match_level *level, struct block *block,
                            struct match_line *line) {
    const size_t width = (size_t)level->width;
    const size_t right = (size_t)level->right_length;
    for (int plane = 0; plane < MATCH_CENSUS_PLANES; plane++) {
        line->cost.left.census[plane] = carve(block, width, 1);
        line->cost.right.census[plane] = carve(block, right, 1);
    }
    line->cost.left.gradient = carve(block, width, 1);
    line->cost.right.gradient = carve(block, right, 1);
    line->cost.weight = carve(block, width, sizeof(uint16_t));
    line->cost.forward = carve(block, width, sizeof(match_share));
    line->cost.joined = carve(block, width, sizeof(match_share));
    line->cost.backward = carve(block, width, sizeof(match_share));
}

static void carve_row_line(const struct match_level *level, struct block *block,
                           struct match_line *line) {
    const size_t width = (size_t)level->width;
    line->row.penalty = carve(block, width + 1, 1);
    line->row.fit = carve(block, width, 1);
    line->row.fits = carve(block, width, 1);
    line->row.darkest = carve(block, width, 1);
    line->row.brightest = carve(block, width, 1);
    line->row.around = carve(block, width, sizeof *line->row.around);
    line->row.margin = carve(block, width, 1);
    line->row.lane = carve(block, width, sizeof *line->row.lane);
    line->row.right_x = carve(block, width, sizeof *line->row.right_x);
    line->row.claim = carve(block, width + 1, sizeof *line->row.claim);
}

static int rows_abreast(int threads) {
    const int rows = MATCH_BAND_ROWS / threads / MATCH_PAIR_ROWS * MATCH_PAIR_ROWS;
    return rows < MATCH_ROWS_ABREAST ? rows : MATCH_ROWS_ABREAST;
}

// Levels take turns, so what is enough for the largest one serves all.
static void take_scratch(const struct match_state *state, struct match_memory *memory,
                         struct match_scratch *scratch) {
    const struct match_level *level = &state->level[0];
    const size_t width = (size_t)level->width;
    const size_t cells = (size_t)level->lanes * MATCH_TILE_COLUMNS;
    const int rows = rows_abreast(state->threads);
    for (int j = 0; j < rows + 2 * MATCH_CENSUS_RADIUS; j++) {
        scratch->source[j] = take(memory, width + 2 * MATCH_CENSUS_RADIUS, 1);
    }
    scratch->box = take(memory, width, sizeof *scratch->box);
    scratch->running = take(memory, cells, 1);
    scratch->realigned = take(memory, cells, 1);
    for (int r = 0; r < rows; r++) {
        struct block cost = {NULL, 0};
        struct block row = {NULL, 0};
        carve_cost_line(level, &cost, &scratch->line[r]);
        carve_row_line(level, &row, &scratch->line[r]);
        const size_t bytes = cost.used_bytes > row.used_bytes ? cost.used_bytes : row.used_bytes;
        cost = (struct block){take(memory, bytes, 1), 0};
        row = cost;
        if (cost.at != NULL) {
            carve_cost_line(level, &cost, &scratch->line[r]);
            carve_row_line(level, &row, &scratch->line[r]);
        }
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
        scratch->first_slot = i * (MATCH_BAND_ROWS / state->threads / MATCH_PAIR_ROWS) *
                              MATCH_PAIR_ROWS;
    }
}

static void plan(struct match_level *level, int band_begin, struct match_tile *tiles) {
    if (level->coarser != NULL) {
        match_advance(level->coarser, match_window_rows(level, band_begin));
    }
    match_plan_windows(level, band_begin, level->state->scratch[0].box, tiles);
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
        plan(level, 0, level->tile[2]);
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
        plan(level, level->band_end, level->tile[2]);
    }
}

static void run_band(struct match_level *level) {
    begin_band(level);
    const int ahead = level->band_begin + MATCH_RING_ROWS;
    const int cost_end =
        pairs(ahead < level->height ? ahead : level->height) * MATCH_PAIR_ROWS;
    INVARIANT(level->cost_end <= cost_end && cost_end - level->band_begin <= MATCH_RING_ROWS);
    run_phase(level, cost_part, level->cost_end / MATCH_PAIR_ROWS, cost_end / MATCH_PAIR_ROWS);
    level->cost_end = cost_end;
    run_phase(level, column_part, 0, level->tiles);
    run_phase(level, row_part, level->band_begin / MATCH_PAIR_ROWS, pairs(level->band_end));
    level->rows_done = level->band_end;
}

void match_advance(struct match_level *level, int rows) {
    INVARIANT(rows <= level->height);
    while (level->rows_done < rows) {
        run_band(level);
    }
}
