// SPDX-License-Identifier: Apache-2.0
// The order of the steps, on bands, tiles and threads, and the memory that they share. A band goes
// through three kernels:
//   1. by rows:  features, cost, average along the row
//   2. by tiles: average down and up (with TUNE_AHEAD_ROWS rows of look-ahead), path cost from the
//                row above
//   3. by rows:  path costs from the left and the right, selection, validation
// Each thread processes one band at a time, so that nearly all of a band's cells stay in one
// processor's cache; in 2 a tile waits for those above it. All threads wait for each other before
// and after a batch of bands. The checks of validation.c and speckle.c follow the last band.
#include <stdatomic.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "stereo/match/kernels.h"
#include "stereo/match/state.h"

// Bands of a batch: as many for each thread. With one thread one is enough.
static int bands_of_batch(int threads) {
    const int each = MATCH_MAX_BATCH / threads;
    return threads == 1 ? 1 : threads * (each < TUNE_BANDS_EACH ? each : TUNE_BANDS_EACH);
}

// Whether all tiles of all bands search the same disparities.
static bool has_one_window(const struct match_level *level) {
    const struct match_options *options = &level->state->options;
    return match_searches_everything(level) ||
           (match_searches_whole_range(level) && options->extra_below + options->extra_above == 0);
}

static void take_pictures(struct match_level *level, struct match_memory *memory) {
    for (int i = 0; i < 2 && !match_is_finest(level); i++) {
        level->picture[i] = (struct image_u8){
            match_take(memory, (size_t)level->width * (size_t)level->picture_rows, 1), level->width,
            level->height, level->width, level->picture_rows};
    }
}

// What is used most comes first, as there may be little fast memory.
static void take_level(struct match_level *level, struct match_memory *memory) {
    const int threads = level->state->threads;
    const size_t columns = (size_t)level->tiles * MATCH_TILE_COLUMNS;
    const bool finest = match_is_finest(level);
    level->ring_rows = MATCH_RING_ROWS(threads);
    for (int i = 0; i < level->ring_rows; i++) {
        const bool scaled = level->shift_x + level->shift_y > 0;
        level->guide[i] = finest && scaled ? match_take(memory, columns, 1) : NULL;
        level->step_along[i] = match_take(memory, columns, 1);
        level->step_down[i] = match_take(memory, columns, 1);
        level->weight_down[i] = match_take(memory, columns, sizeof *level->weight_down[i]);
    }
    level->down_mass = match_take(memory, columns, sizeof *level->down_mass);
    for (int i = 0; i < level->batch + 2; i++) {
        level->tile[i] = match_take(memory, (size_t)level->tiles, sizeof *level->tile[i]);
    }
    // If windows never change, the averages stay in place.
    level->down_rows = has_one_window(level) ? 1 : threads + 1;
    for (int i = 0; i < level->down_rows; i++) {
        level->down[i] = match_take(memory, level->row_bytes, 1);
    }
    for (int i = 0; i < threads; i++) {
        memcpy(level->cells[i], level->state->shared_cells[i],
               sizeof level->state->shared_cells[i]);
        for (int j = MATCH_BAND_ROWS - 1; j < MATCH_BAND_ROWS + 1; j++) {
            level->cells[i][j] = match_take(memory, level->row_bytes, 1);
        }
    }
    for (int i = 0; i < MATCH_BAND_ROWS; i++) {
        level->kept[i] = match_take(memory, level->row_bytes, 1);
    }
    take_pictures(level, memory);
    level->surface_rows = MATCH_SURFACE_ROWS(level->batch);
    for (int i = 0; i < level->surface_rows && !finest; i++) {
        level->surface[i] = match_take(memory, columns, sizeof *level->surface[i]);
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
    const size_t columns = (size_t)level->tiles * MATCH_TILE_COLUMNS;
    const size_t right = (size_t)level->right_length;
    for (int j = 0; j < MATCH_SOURCE_ROWS; j++) {
        scratch->source[j] = carve(block, width + 2 * MATCH_SOURCE_PAD, 1);
    }
    for (int r = 0; r < rows; r++) {
        struct match_line *line = &scratch->line[r];
        for (int plane = 0; plane < MATCH_CENSUS_PLANES; plane++) {
            line->cost.left.census[plane] = carve(block, columns, 1);
            line->cost.right.census[plane] = MATCH_HAS_CELLS ? NULL : carve(block, right, 1);
        }
        line->cost.right_census =
            MATCH_HAS_CELLS ? carve(block, right, sizeof *line->cost.right_census) : NULL;
        line->cost.left.gradient = carve(block, columns, 1);
        line->cost.right.gradient = carve(block, right, 1);
        line->cost.forward = carve(block, width + MATCH_BOX_MORE, sizeof(match_share));
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
    scratch->running = match_take(memory, (size_t)level->lanes * MATCH_TILE_COLUMNS, 1);
    struct block cost = {NULL, 0};
    struct block row = {NULL, 0};
    carve_cost(level, rows, &cost, scratch);
    carve_row(level, rows, &row, scratch);
    const size_t bytes = cost.used_bytes > row.used_bytes ? cost.used_bytes : row.used_bytes;
    cost = (struct block){match_take(memory, bytes, 1), 0};
    row = cost;
    if (cost.at != NULL) {
        carve_cost(level, rows, &cost, scratch);
        carve_row(level, rows, &row, scratch);
    }
}

// Rows of cells that the levels use in turn.
static void take_shared(struct match_state *state, struct match_memory *memory) {
    size_t row_bytes = 0;
    for (int i = 0; i < state->levels; i++) {
        const size_t bytes = state->level[i].row_bytes;
        row_bytes = bytes > row_bytes ? bytes : row_bytes;
    }
    for (int i = 0; i < state->threads; i++) {
        for (int j = 0; j < MATCH_BAND_ROWS - 1; j++) {
            state->shared_cells[i][j] = match_take(memory, row_bytes, 1);
        }
    }
    for (int i = 0; i < state->threads * MATCH_BAND_ROWS; i++) {
        state->shared_ring[i] = match_take(memory, row_bytes, 1);
    }
}

void match_take_memory(struct match_state *state, struct match_memory *memory) {
    state->scratch = match_take(memory, (size_t)state->threads, sizeof *state->scratch);
    for (int i = 0; i < state->threads; i++) {
        struct match_scratch counted;
        struct match_scratch *scratch = state->scratch == NULL ? &counted : &state->scratch[i];
        take_scratch(state, memory, scratch);
    }
    take_shared(state, memory);
    for (int i = 0; i < state->levels; i++) {
        take_level(&state->level[i], memory);
    }
}

static void advance(struct match_level *level, int rows);

// Plans the windows `tiles` of the band that begins at row `begin`.
static void plan(struct match_level *level, int begin, const struct match_tile *above,
                 struct match_tile *tiles) {
    if (level->coarser != NULL) {
        advance(level->coarser, match_window_rows(level, begin));
    }
    if (!level->state->dry) {
        match_plan_windows(level, begin, level->state->scratch, above, tiles);
    }
}

static int band_count(const struct match_level *level) {
    return (level->height + MATCH_BAND_ROWS - 1) / MATCH_BAND_ROWS;
}

// Windows of a band: those of the batch in progress exist, of the band above it, and of the one
// below. Above band 0 there is one of no disparities.
static struct match_tile *windows(const struct match_level *level, int number) {
    const int count = level->batch + 2;
    return level->tile[(number + count) % count];
}

// Cells of columns outside the image and of rows below it are read, but have no effect.
static void clear_part(void *level_pointer, int index) {
    const struct match_level *level = level_pointer;
    const int threads = level->state->threads;
    for (int j = 0; j < MATCH_BAND_ROWS + 1; j++) {
        memset(level->cells[index][j], 0, level->row_bytes);
    }
    for (int j = 0; j < MATCH_BAND_ROWS; j++) {
        memset(level->state->shared_ring[index * MATCH_BAND_ROWS + j], 0, level->row_bytes);
    }
    for (int j = index; j < MATCH_BAND_ROWS; j += threads) {
        memset(level->kept[j], 0, level->row_bytes);
    }
    for (int j = index; j < level->down_rows; j += threads) {
        memset(level->down[j], 0, level->row_bytes);
    }
}

static void clear_cells(struct match_level *level) {
    const struct match_state *state = level->state;
    state->parallel->run(state->parallel->self, clear_part, level, state->threads);
    memset(level->down_mass, 0,
           (size_t)level->tiles * MATCH_TILE_COLUMNS * sizeof *level->down_mass);
}

static void begin_levels(struct match_state *state) {
    for (int i = state->levels - 1; i >= 0; i--) {
        struct match_level *level = &state->level[i];
        level->rows_done = 0;
        if (state->dry) {
            plan(level, 0, NULL, NULL);
            continue;
        }
        clear_cells(level);
        memset(windows(level, -1), 0, (size_t)level->tiles * sizeof *level->tile[0]);
        plan(level, 0, windows(level, -1), windows(level, 0));
        match_plan_slopes(level, 0, windows(level, 0));
    }
}

// Bands `threads` apart share nine rows of cells. The last row of path costs stays until the band
// below has read it, while the next of these bands begins: the last two change places.
static uint8_t *last_row(const struct match_level *level, int number, bool is_sum) {
    const int threads = level->state->threads;
    const bool is_swapped = number / threads % 2 != 0;
    return level->cells[number % threads][MATCH_BAND_ROWS - (is_sum == is_swapped ? 1 : 0)];
}

_Static_assert(MATCH_BAND_ROWS % MATCH_ROWS_ABREAST == 0 &&
                   (int)TUNE_AHEAD_ROWS <= (int)MATCH_BAND_ROWS,
               "a call processes rows of one band; averages reach no further than the next one");

// Row y, or the end of the image, where a call of a kernel ends: the last one of the image may
// include rows below it.
static int end_of_call(const struct match_level *level, int y) {
    const int calls = (level->height + MATCH_ROWS_ABREAST - 1) / MATCH_ROWS_ABREAST;
    return y < calls * MATCH_ROWS_ABREAST ? y : calls * MATCH_ROWS_ABREAST;
}

// Rows whose costs a band's thread computes: those of the next band.
static void cost_rows_of(const struct match_level *level, int number, int *begin, int *end) {
    const int first = number * MATCH_BAND_ROWS;
    *begin = first == 0 ? 0 : first + MATCH_BAND_ROWS;
    *end = end_of_call(level, first + 2 * MATCH_BAND_ROWS);
}

static struct match_band band_of(const struct match_level *level, int number) {
    struct match_band band = {.begin = number * MATCH_BAND_ROWS};
    const int end = band.begin + MATCH_BAND_ROWS;
    band.end = end < level->height ? end : level->height;
    cost_rows_of(level, number, &band.cost_begin, &band.cost_end);
    band.before = windows(level, number - 1);
    band.tile = windows(level, number);
    band.next = windows(level, number + 1);
    memcpy(band.from_above, level->cells[number % level->state->threads], sizeof band.from_above);
    band.from_above[MATCH_BAND_ROWS - 1] = last_row(level, number, false);
    band.last_sum = last_row(level, number, true);
    band.last_above = number == 0 ? NULL : last_row(level, number - 1, false);
    band.down_before = level->down[(number + level->down_rows - 1) % level->down_rows];
    band.down = level->down[number % level->down_rows];
    return band;
}

// Bands between two points where all threads wait for each other; a thread works on one at a time.
struct batch {
    struct match_level *level;
    int first, bands;
    atomic_int taken;
    // By band of the batch: number of tiles whose columns are averaged, and one more when the band
    // is finished.
    atomic_int done[MATCH_MAX_BATCH];
};

static void relax(const struct parallel *parallel) {
    if (parallel->relax != NULL) {
        parallel->relax(parallel->self);
    }
}

// Until an earlier band of the batch, if there is one, has done as much.
static void wait_for(struct batch *batch, int i, int done) {
    const struct parallel *parallel = batch->level->state->parallel;
    while (i >= 0 && atomic_load(&batch->done[i]) < done) {
        relax(parallel);
    }
}

static void average_columns(struct batch *batch, int i, struct match_scratch *scratch) {
    // The band above is so many tiles ahead: processors fetch ahead of what they read, and close
    // behind it they would take lines of the cache that its thread is still writing.
    struct match_level *level = batch->level;
    for (int t = 0; t < level->tiles; t++) {
        const int after = t + 1 + TUNE_TILES_BETWEEN;
        wait_for(batch, i - 1, after < level->tiles ? after : level->tiles);
        level->state->options.kernels->columns(level, scratch, t, t + 1);
        atomic_store(&batch->done[i], t + 1);
    }
}

// Processes one band. It only waits for bands that were taken earlier. Band n overwrites memory of
// band n - threads, which is finished: the rows of the ring with the costs of that band, which only
// it and the band above read; the downward average before that of the bands in progress; and, in
// phase 3, the row of path costs that the band below that one has read before phase 2 of band n.
static void run_band(struct batch *batch, int i) {
    struct match_level *level = batch->level;
    const struct match_kernels *kernels = level->state->options.kernels;
    const int threads = level->state->threads;
    const int number = batch->first + i;
    wait_for(batch, i - threads, level->tiles + 1);
    struct match_band band = band_of(level, number);
    struct match_scratch *scratch = &level->state->scratch[number % threads];
    scratch->band = &band;
    for (int y = band.cost_begin; y < band.cost_end; y += MATCH_ROWS_ABREAST) {
        kernels->cost_rows(level, scratch, y);
    }
    average_columns(batch, i, scratch);
    const int end = end_of_call(level, band.begin + MATCH_BAND_ROWS);
    for (int y = band.begin; y < end; y += MATCH_ROWS_ABREAST) {
        kernels->rows(level, scratch, y);
    }
    scratch->band = NULL;
    atomic_store(&batch->done[i], level->tiles + 1);
}

// Takes bands from above to below until none is left.
static void bands_part(void *batch_pointer, int index) {
    (void)index;
    struct batch *batch = batch_pointer;
    for (int i = atomic_fetch_add(&batch->taken, 1); i < batch->bands;
         i = atomic_fetch_add(&batch->taken, 1)) {
        run_band(batch, i);
    }
}

// Plans the slopes below a band: each on its own, unlike the windows.
static void slopes_part(void *batch_pointer, int index) {
    const struct batch *batch = batch_pointer;
    const struct match_level *level = batch->level;
    const int below = batch->first + index + 1;
    if (below < band_count(level)) {
        match_plan_slopes(level, below * MATCH_BAND_ROWS, windows(level, below));
    }
}

// Rows of both images, scaled down for a coarser level.
struct scaling {
    const struct match_level *level;
    int begin;  // row of the level
};

static void scale_part(void *context, int index) {
    const struct scaling *scaling = context;
    const struct match_level *level = scaling->level;
    const struct match_input *input = level->state->input;
    const int side = index % 2;
    const int y = scaling->begin + index / 2;
    const struct image_u8 *whole = side == 0 ? &input->left : &input->right;
    const struct image_u8 *from = input->ahead[side].data != NULL ? &input->ahead[side] : whole;
    level->state->options.kernels->scale(level, from, y, image_u8_row(&level->picture[side], y));
}

// Shows rows [begin, end) of the images in the pictures of all coarser levels.
static void scale_rows(const struct match_state *state, int begin, int end) {
    match_input_rows(state->input, MATCH_WANTS_AHEAD, begin, end);
    for (int i = 1; i < state->levels && !state->dry; i++) {
        const struct match_level *level = &state->level[i];
        const int last =
            end >> level->shift_y < level->height ? end >> level->shift_y : level->height;
        struct scaling scaling = {level, begin >> level->shift_y};
        if (last > scaling.begin) {
            state->parallel->run(state->parallel->self, scale_part, &scaling,
                                 2 * (last - scaling.begin));
        }
    }
}

// The rows of the pair that a batch reads: of the features, and, on the finest level, of the
// texture of the rows that it finishes. A coarser level's come from its pictures.
static void need_rows(struct match_level *level, int first, int bands) {
    struct match_state *state = level->state;
    int begin, end, unused;
    cost_rows_of(level, first, &begin, &unused);
    cost_rows_of(level, first + bands - 1, &unused, &end);
    begin -= MATCH_CENSUS_RADIUS + 1;
    end += MATCH_CENSUS_RADIUS + 1;
    if (match_is_finest(level)) {
        const int texture = first * MATCH_BAND_ROWS;
        begin = begin < texture ? begin : texture;
        match_input_rows(state->input, MATCH_WANTS_COLOUR, begin * (1 << level->shift_y),
                         end * (1 << level->shift_y));
        return;
    }
    const int step = match_ahead_step(state);
    for (; state->ahead_rows < end << level->shift_y; state->ahead_rows += step) {
        if (state->ahead_rows < state->input->left.height) {
            scale_rows(state, state->ahead_rows, state->ahead_rows + step);
        }
    }
    const int shown = state->ahead_rows >> level->shift_y;
    const int kept = (shown < level->height ? shown : level->height) - (begin > 0 ? begin : 0);
    INVARIANT(state->dry || kept <= level->picture_rows);
    level->picture_rows = state->dry && kept > level->picture_rows ? kept : level->picture_rows;
}

static void plan_batch(const struct batch *batch, int rest) {
    struct match_level *level = batch->level;
    for (int i = 1; i <= batch->bands && i < rest; i++) {
        const int below = batch->first + i;
        plan(level, below * MATCH_BAND_ROWS, windows(level, below - 1), windows(level, below));
    }
}

// Gives the ring its rows: those of a band, which are the level's own, and the shared ones.
static void lend_rows(struct match_level *level, int number) {
    uint8_t *const *shared = level->state->shared_ring;
    const int bands = level->ring_rows / MATCH_BAND_ROWS;
    for (int i = 0; i < bands; i++) {
        uint8_t **rows = level->ring + (number + i) % bands * MATCH_BAND_ROWS;
        memcpy(rows, i == 0 ? level->kept : shared + (i - 1) * MATCH_BAND_ROWS,
               MATCH_BAND_ROWS * sizeof *rows);
    }
}

// Until its next batch other levels use the shared rows: the costs of its next band are kept.
static void keep_part(void *level_pointer, int index) {
    const struct match_level *level = level_pointer;
    const int slot = level->rows_done % level->ring_rows;
    memcpy(level->kept[index], level->ring[slot + index], level->row_bytes);
}

static void run_batch(struct match_level *level) {
    const struct match_state *state = level->state;
    INVARIANT(level->rows_done % MATCH_BAND_ROWS == 0 && level->rows_done < level->height);
    const int first = level->rows_done / MATCH_BAND_ROWS;
    const int rest = band_count(level) - first;
    struct batch batch = {
        .level = level, .first = first, .bands = rest < level->batch ? rest : level->batch};
    plan_batch(&batch, rest);
    need_rows(level, first, batch.bands);
    if (!state->dry) {
        lend_rows(level, first);
        state->parallel->run(state->parallel->self, slopes_part, &batch, batch.bands);
        state->parallel->run(state->parallel->self, bands_part, &batch, state->threads);
    }
    level->rows_done += batch.bands * MATCH_BAND_ROWS;
    if (batch.bands == rest) {
        level->rows_done = level->height;
    } else if (!state->dry) {
        state->parallel->run(state->parallel->self, keep_part, level, MATCH_BAND_ROWS);
    }
}

static void reach_rows(void *self, enum match_wanted what, int begin, int end) {
    int *rows = self;
    if (what == MATCH_WANTS_COLOUR && end - begin > *rows) {
        *rows = end - begin;
    }
}

void match_plan_rows(struct match_state *state) {
    const struct match_level *finest = &state->level[0];
    const struct match_input input = {.left.height = finest->height << finest->shift_y,
                                      .rows = reach_rows,
                                      .self = &state->kept_rows};
    const struct match_input *real = state->input;
    state->input = &input;
    state->dry = true;
    state->kept_rows = 0;
    for (int i = 0; i < state->levels; i++) {
        state->level[i].batch = bands_of_batch(state->threads);
        state->level[i].picture_rows = 0;
    }
    state->ahead_rows = 0;
    begin_levels(state);
    advance(&state->level[0], finest->height);
    state->input = real;
    state->dry = false;
    state->ahead_rows = 0;
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

static void finish_levels(struct match_state *state) {
    struct finish_context context = {&state->level[0], state->threads};
    state->parallel->run(state->parallel->self, finish_part, &context, context.parts);
}

static void advance(struct match_level *level, int rows) {
    INVARIANT(rows <= level->height);
    while (level->rows_done < rows) {
        run_batch(level);
    }
}

static bool run_levels(struct match_state *state, match_progress *progress, void *progress_self) {
    struct match_level *finest = &state->level[0];
    const int height = state->input->left.height;
    begin_levels(state);
    bool wanted = true;
    while (wanted && finest->rows_done < finest->height) {
        const int rows = finest->rows_done + MATCH_BAND_ROWS;
        advance(finest, rows < finest->height ? rows : finest->height);
        const bool done = finest->rows_done == finest->height;
        const int rows_done = done ? height : finest->rows_done << finest->shift_y;
        wanted = progress == NULL || progress(progress_self, rows_done, height);
    }
    finish_levels(state);
    return wanted;
}

int match_run_steps(struct match_state *state, match_progress *progress, void *progress_self,
                    struct arena *arena) {
    const size_t mark = arena_mark(arena);
    struct match_memory memory = {.arena = arena};
    match_take_memory(state, &memory);
    const bool finished = !memory.failed && run_levels(state, progress, progress_self);
    arena_release(arena, mark);
    if (!finished) {
        return memory.failed ? ERROR_MEMORY : ERROR_CANCELLED;
    }
    if (state->options.keep_all) {
        return ERROR_OK;
    }
    const int checked = match_check_blocks(state->input, &state->options, &state->look,
                                           state->parallel, arena, state->output);
    return checked != ERROR_OK ? checked
                               : speckle_filter_run_all(state->options.speckle_px, state->parallel,
                                                        arena, state->output);
}
