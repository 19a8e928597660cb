// SPDX-License-Identifier: Apache-2.0
#include "stereo/match/match_level.h"

#include <string.h>

#include "core/invariant.h"
#include "stereo/match/match_kernels.h"

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
    const int ends = match_range_ends(disparity_count);
    level->believed = (struct match_believed){ends, disparity_count - 1 - ends};
    level->lanes = padded_lanes(disparity_count);
    const int front = -disparity_min;
    const int behind = disparity_min + level->lanes;
    level->right_pad = front > 0 ? front : 0;
    level->right_length = width + level->right_pad + (behind > 0 ? behind : 0);
}

int match_mean_lanes(const struct match_level *level) {
    const struct match_method *method = level->state->method;
    const bool all =
        match_searches_everything(level) || method->whole_range || level->lanes < method->lanes;
    return all ? level->lanes : method->lanes;
}

// Number of lanes a column for which a level has memory. Windows at small objects far in front need
// many, the more disparities there are.
static int lanes_in_memory(const struct match_level *level) {
    const int mean = match_mean_lanes(level);
    const int part = padded_lanes(3 * level->lanes / 8);
    return part > mean ? part : mean;
}

// Number of halvings of a level's columns and disparities to those of the next one. Below the
// finest level each follows the slopes of the next, so that steeper surfaces are found from level
// to level.
static int halvings_below(const struct match_level *level) {
    return match_is_finest(level) ? level->state->method->halvings : 1;
}

// Whether a level gets a coarser one: it has many disparities, and enough columns remain.
static bool is_halved(const struct match_level *level) {
    const struct match_method *method = level->state->method;
    return method->coarse_disparities > 0 && level->disparity_count > method->coarse_disparities &&
           level->width >> halvings_below(level) >= MATCH_MIN_WIDTH_PX;
}

// Whether all tiles of all bands search the same disparities.
static bool has_one_window(const struct match_level *level) {
    const struct match_options *options = &level->state->options;
    return match_searches_everything(level) ||
           (match_searches_whole_range(level) && options->extra_below + options->extra_above == 0);
}

void match_set_levels(struct match_state *state, int width, int height) {
    const struct match_method *method = state->method;
    state->level[0] = (struct match_level){.state = state, .shift_y = method->halved_rows};
    set_level(&state->level[0], width, height >> method->halved_rows,
              match_searched_min(&state->options), match_searched_count(&state->options));
    state->level[0].believed = match_believed_of(&state->options);
    state->levels = 1;
    while (state->levels < MATCH_MAX_LEVELS && is_halved(&state->level[state->levels - 1])) {
        struct match_level *finer = &state->level[state->levels - 1];
        struct match_level *level = &state->level[state->levels];
        const int halvings = halvings_below(finer);
        const int shift = finer->shift_x + halvings;
        // Rows are halved once, so that a floor gains fewer disparities a row than on the finer
        // level. A low image keeps its rows: the memory requirement does not depend on the height.
        const int more = height >> (finer->shift_y + 1) >= MATCH_MIN_HEIGHT_PX ? 1 : 0;
        const int shift_y = finer->shift_y + more;
        *level = (struct match_level){.state = state, .shift_x = shift, .shift_y = shift_y};
        const int lowest = scaled_down(finer->disparity_min, halvings);
        const int highest =
            scaled_down(finer->disparity_min + finer->disparity_count - 1, halvings);
        set_level(level, width >> shift, height >> shift_y, lowest, highest - lowest + 1);
        finer->coarser = level;
        state->levels++;
    }
    for (int i = 0; i < state->levels; i++) {
        struct match_level *level = &state->level[i];
        level->row_bytes =
            (size_t)level->tiles * MATCH_TILE_COLUMNS * (size_t)lanes_in_memory(level);
    }
}

static void *take(struct match_memory *memory, size_t count, size_t element_bytes) {
    memory->need_bytes += arena_need_bytes(count, element_bytes);
    void *taken = memory->arena == NULL ? NULL : arena_take(memory->arena, count, element_bytes);
    memory->failed = memory->failed || taken == NULL;
    return taken;
}

static void take_band(const struct match_level *level, bool first, struct match_memory *memory,
                      struct match_band *band) {
    for (int i = 0; i < MATCH_BAND_ROWS; i++) {
        band->from_above[i] = take(memory, level->row_bytes, 1);
    }
    uint8_t *spare = take(memory, level->row_bytes, 1);
    // For the first band, the path costs above it are not needed once the sums exist.
    band->last_above = first ? spare : NULL;
    band->last_sum = first ? NULL : spare;
}

static void take_level(struct match_level *level, struct match_memory *memory) {
    const int threads = level->state->threads;
    const size_t columns = (size_t)level->tiles * MATCH_TILE_COLUMNS;
    for (int i = 0; i < threads + 2; i++) {
        level->tile[i] = take(memory, (size_t)level->tiles, sizeof *level->tile[i]);
    }
    for (int i = 0; i < threads; i++) {
        take_band(level, i == 0, memory, &level->band[i]);
    }
    level->ring_rows = MATCH_RING_ROWS(threads);
    for (int i = 0; i < level->ring_rows; i++) {
        level->ring[i] = take(memory, level->row_bytes, 1);
    }
    for (int i = 0; i < threads + 1; i++) {
        // If windows never change, the averages stay in place.
        const bool new_row = i == 0 || !has_one_window(level);
        level->down[i] = new_row ? take(memory, level->row_bytes, 1) : level->down[0];
    }
    level->down_mass = take(memory, columns, sizeof *level->down_mass);
    const bool finest = match_is_finest(level);
    for (int i = 0; i < level->ring_rows; i++) {
        const bool scaled = level->shift_x + level->shift_y > 0;
        level->guide[i] = finest && scaled ? take(memory, columns, 1) : NULL;
        level->step_along[i] = take(memory, columns, 1);
        level->step_down[i] = take(memory, columns, 1);
        level->weight_down[i] = take(memory, columns, sizeof *level->weight_down[i]);
    }
    level->surface_rows = MATCH_SURFACE_ROWS(threads);
    for (int i = 0; i < level->surface_rows && !finest; i++) {
        level->surface[i] = take(memory, columns, sizeof *level->surface[i]);
    }
}

// Allocates parts of a block of memory; only counts if there is no block.
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

// Memory of phase 1. Data written late shares memory with data no longer needed.
static void carve_cost(const struct match_level *level, int rows, struct block *block,
                       struct match_scratch *scratch) {
    const size_t width = (size_t)level->width;
    const size_t right = (size_t)level->right_length;
    for (int j = 0; j < MATCH_SOURCE_ROWS; j++) {
        scratch->source[j] = carve(block, width + 2 * MATCH_SOURCE_PAD, 1);
    }
    for (int r = 0; r < rows; r++) {
        struct match_line *line = &scratch->line[r];
        for (int plane = 0; plane < MATCH_CENSUS_PLANES; plane++) {
            line->cost.left.census[plane] = carve(block, width, 1);
            line->cost.right.census[plane] = carve(block, right, 1);
        }
        line->cost.left.gradient = carve(block, width, 1);
        line->cost.right.gradient = carve(block, right, 1);
        line->cost.forward = carve(block, width + 2, sizeof(match_share));
        line->cost.backward = carve(block, width, sizeof(match_share));
        line->cost.weight = carve(block, width, sizeof(uint16_t));
        line->cost.joined = line->cost.weight;
    }
    scratch->box = scratch->line[0].cost.forward;
}

// Memory of phase 3, and of the end of the run.
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
        line->row.contrast = line->row.fit;
        line->row.fits = carve(block, width, 1);
        line->row.claim = carve(block, width + 1, sizeof *line->row.claim);
        line->row.darkest = (uint8_t *)line->row.claim;
        line->row.brightest = line->row.darkest == NULL ? NULL : line->row.darkest + width;
    }
    scratch->finish = (int32_t *)scratch->line[0].row.claim;
}

// Levels and phases run one after the other, so memory for the largest one is enough.
static void take_scratch(const struct match_state *state, struct match_memory *memory,
                         struct match_scratch *scratch) {
    const struct match_level *level = &state->level[0];
    const int rows = MATCH_ROWS_ABREAST;
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
    }
}

// Plans the windows `tiles` of the band that begins at row `begin`.
static void plan(struct match_level *level, int begin, const struct match_tile *above,
                 struct match_tile *tiles) {
    if (level->coarser != NULL) {
        match_advance(level->coarser, match_window_rows(level, begin));
    }
    match_plan_windows(level, begin, level->state->scratch, above, tiles);
}

// Cells of columns outside the image and of rows below it are read, but have no effect. Each band's
// rows are cleared by one thread, most likely the one that will write them.
static void clear_part(void *level_pointer, int index) {
    const struct match_level *level = level_pointer;
    const struct match_band *band = &level->band[index];
    for (int j = 0; j < MATCH_BAND_ROWS; j++) {
        memset(band->from_above[j], 0, level->row_bytes);
        memset(level->ring[index * MATCH_BAND_ROWS + j], 0, level->row_bytes);
    }
    memset(index == 0 ? band->last_above : band->last_sum, 0, level->row_bytes);
    if (level->down[index + 1] != level->down[0]) {
        memset(level->down[index + 1], 0, level->row_bytes);
    }
}

static void clear_cells(struct match_level *level) {
    const struct match_state *state = level->state;
    state->parallel->run(state->parallel->self, clear_part, level, state->threads);
    for (int j = state->threads * MATCH_BAND_ROWS; j < level->ring_rows; j++) {
        memset(level->ring[j], 0, level->row_bytes);
    }
    memset(level->down[0], 0, level->row_bytes);
    memset(level->down_mass, 0,
           (size_t)level->tiles * MATCH_TILE_COLUMNS * sizeof *level->down_mass);
}

void match_begin_levels(struct match_state *state) {
    for (int i = state->levels - 1; i >= 0; i--) {
        struct match_level *level = &state->level[i];
        level->bands = level->rows_done = 0;
        clear_cells(level);
        memset(level->tile[0], 0, (size_t)level->tiles * sizeof *level->tile[0]);
        plan(level, 0, level->tile[0], level->tile[1]);
        match_plan_slopes(level, 0, level->tile[1]);
    }
}

static void swap_rows(uint8_t **a, uint8_t **b) {
    uint8_t *kept = *a;
    *a = *b;
    *b = kept;
}

static void swap_tiles(struct match_tile **a, struct match_tile **b) {
    struct match_tile *kept = *a;
    *a = *b;
    *b = kept;
}

// The state left by the last of the bands is above the next ones.
static void leave_bands(struct match_level *level) {
    const int bands = level->bands;
    if (bands == 0) {
        return;
    }
    struct match_band *last = &level->band[bands - 1];
    INVARIANT(last->end == level->rows_done && last->end - last->begin == MATCH_BAND_ROWS);
    swap_rows(&level->band[0].last_above, &last->from_above[MATCH_BAND_ROWS - 1]);
    swap_rows(&level->down[0], &level->down[bands]);
    swap_tiles(&level->tile[0], &level->tile[bands]);
    swap_tiles(&level->tile[1], &level->tile[bands + 1]);
}

// Pairs of rows up to row y.
static int pairs(int y) {
    return (y + MATCH_PAIR_ROWS - 1) / MATCH_PAIR_ROWS;
}

static void begin_band(struct match_level *level, int i) {
    struct match_band *band = &level->band[i];
    const struct match_band *above = i == 0 ? NULL : &level->band[i - 1];
    band->begin = level->rows_done + i * MATCH_BAND_ROWS;
    const int end = band->begin + MATCH_BAND_ROWS;
    band->end = end < level->height ? end : level->height;
    const int ahead = end + MATCH_AHEAD_ROWS;
    band->cost_begin = band->begin == 0 ? 0 : band->begin + MATCH_AHEAD_ROWS;
    band->cost_end = pairs(ahead < level->height ? ahead : level->height) * MATCH_PAIR_ROWS;
    band->before = level->tile[i];
    band->tile = level->tile[i + 1];
    band->next = level->tile[i + 2];
    if (above == NULL) {
        band->last_sum = band->last_above;
    } else {
        band->last_above = above->from_above[MATCH_BAND_ROWS - 1];
    }
    band->down_before = level->down[i];
    band->down = level->down[i + 1];
    atomic_store(&band->tiles_done, 0);
    if (band->end < level->height) {
        plan(level, band->end, band->tile, level->tile[i + 2]);
    }
}

struct part_context {
    struct match_level *level;
    const struct match_kernels *kernels;
    atomic_uint taken;  // one bit per band
};

static void relax(const struct parallel *parallel) {
    if (parallel->relax != NULL) {
        parallel->relax(parallel->self);
    }
}

// Takes the band with the number of the calling thread, which last wrote most of its memory; or, if
// that band is taken or earlier bands are slow to be taken, the first one left. In this order a
// thread that waits for the band above its own waits for a thread that is running.
static int take_a_band(struct part_context *context, const struct parallel *parallel, int index) {
    enum { TIMEOUT = 1000 };
    const int own = parallel->thread == NULL ? index : parallel->thread(parallel->self);
    for (int wait = 0;; wait++) {
        unsigned taken = atomic_load(&context->taken);
        int first = 0;
        while ((taken >> first & 1) != 0) {
            first++;
        }
        INVARIANT(first < context->level->bands);
        if (own > first && own < context->level->bands && wait < TIMEOUT &&
            (taken >> own & 1) == 0) {
            relax(parallel);
        } else if (atomic_compare_exchange_weak(&context->taken, &taken, taken | 1u << first)) {
            return first;
        }
    }
}

// Rows that one call may process from row y on: up to `end`, and inside the band.
static int rows_together(const struct match_band *band, int y, int end) {
    const int border = band->begin + MATCH_BAND_ROWS;
    const int beyond = y < border && end > border ? border : end;
    return beyond - y < MATCH_ROWS_ABREAST ? beyond - y : MATCH_ROWS_ABREAST;
}

static void average_columns(const struct part_context *context, struct match_scratch *scratch,
                            struct match_band *band, struct match_band *above) {
    // The band above is so many tiles ahead: processors fetch ahead of what they read, and close
    // behind it they would take lines of the cache that its thread is still writing.
    enum { TILES_BETWEEN = 4 };
    struct match_level *level = context->level;
    const struct parallel *parallel = level->state->parallel;
    for (int t = 0; t < level->tiles; t++) {
        const int after = t + 1 + TILES_BETWEEN;
        const int needed = after < level->tiles ? after : level->tiles;
        while (above != NULL && atomic_load(&above->tiles_done) < needed) {
            relax(parallel);
        }
        context->kernels->columns(level, scratch, t, t + 1);
        atomic_store(&band->tiles_done, t + 1);
    }
}

// Processes one band. It only waits for bands that were taken earlier.
static void band_part(void *context_pointer, int index) {
    struct part_context *context = context_pointer;
    struct match_level *level = context->level;
    const int i = take_a_band(context, level->state->parallel, index);
    struct match_band *band = &level->band[i];
    struct match_scratch *scratch = &level->state->scratch[i];
    scratch->band = band;
    for (int y = band->cost_begin; y < band->cost_end;) {
        const int rows = rows_together(band, y, band->cost_end);
        context->kernels->cost_rows(level, scratch, y, rows);
        y += rows;
    }
    average_columns(context, scratch, band, i == 0 ? NULL : &level->band[i - 1]);
    const int end = pairs(band->end) * MATCH_PAIR_ROWS;
    for (int y = band->begin; y < end;) {
        const int rows = rows_together(band, y, end);
        context->kernels->rows(level, scratch, y, rows);
        y += rows;
    }
}

// Gives each thread the rows of the ring that it wrote last time, as far as these are free.
static void save_ring(struct match_level *level) {
    const int before = level->state->threads * MATCH_BAND_ROWS;
    const int begin = level->band[0].begin;
    for (int y = level->band[0].cost_begin; begin > 0 && y < begin + before; y++) {
        swap_rows(&level->ring[y % level->ring_rows],
                  &level->ring[(y - before) % level->ring_rows]);
    }
}

// Plans the slopes below a band: each on its own, unlike the windows.
static void slopes_part(void *level_pointer, int index) {
    const struct match_level *level = level_pointer;
    if (level->band[index].end < level->height) {
        match_plan_slopes(level, level->band[index].end, level->tile[index + 2]);
    }
}

static void run_bands(struct match_level *level) {
    const struct match_state *state = level->state;
    leave_bands(level);
    const int rest = (level->height - level->rows_done + MATCH_BAND_ROWS - 1) / MATCH_BAND_ROWS;
    level->bands = rest < state->threads ? rest : state->threads;
    INVARIANT(level->bands > 0);
    for (int i = 0; i < level->bands; i++) {
        begin_band(level, i);
    }
    state->parallel->run(state->parallel->self, slopes_part, level, level->bands);
    save_ring(level);
    struct part_context context = {.level = level, .kernels = state->options.kernels};
    state->parallel->run(state->parallel->self, band_part, &context, level->bands);
    level->rows_done = level->band[level->bands - 1].end;
}

struct finish_context {
    struct match_level *level;
    int parts;
};

static void finish_part(void *context_pointer, int index) {
    const struct finish_context *context = context_pointer;
    struct match_level *level = context->level;
    const int begin = level->width * index / context->parts;
    const int end = level->width * (index + 1) / context->parts;
    level->state->options.kernels->finish(level, &level->state->scratch[index], begin, end);
}

void match_finish(struct match_state *state) {
    struct finish_context context = {&state->level[0], state->threads};
    state->parallel->run(state->parallel->self, finish_part, &context, context.parts);
}

void match_advance(struct match_level *level, int rows) {
    INVARIANT(rows <= level->height);
    while (level->rows_done < rows) {
        run_bands(level);
    }
}
