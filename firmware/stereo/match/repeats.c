// SPDX-License-Identifier: Apache-2.0
// Repetitive texture: of a match that is finished. Rows needed: those of a cell.
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "stereo/image/reason.h"
#include "stereo/match/checks.h"
#include "stereo/match/match.h"
#include "stereo/match/tuning.h"

enum {
    CELL_COLUMNS = 16,  // tested at once
    CELL_ROWS = MATCH_REPEAT_ROWS,
    PARTS_MAX = 8,
};

struct cells {
    const struct match_input *input;
    const struct match_options *options;
    const struct match_output *output;
    int begin, end;  // rows of cells
    int parts;
    uint16_t *columns[PARTS_MAX];  // sums of a row of cells' grey levels
    uint32_t *before[PARTS_MAX];   // sums of the columns to the left of each, and of all
    uint32_t count[PARTS_MAX];
};

// A cell and its disparity.
struct cell {
    const struct image_u8 *image;
    const uint16_t *columns;  // sums of the rows' grey levels
    const uint32_t *before;   // sums of the columns to the left
    int x, y, rows, disparity;
    uint32_t valid;  // pixels
};

// Columns compared at a lag, around the cell: more at longer ones, as there are more of them that
// chance could make alike.
static int window_of(int lag) {
    const int length = lag < 0 ? -lag : lag;
    const int window = TUNE_REPEAT_WINDOW * length / 2;
    return window > TUNE_REPEAT_WINDOW_PX ? window : TUNE_REPEAT_WINDOW_PX;
}

static int window_begin(const struct cell *cell, int window) {
    return cell->x + (CELL_COLUMNS - window) / 2;
}

static bool is_inside(const struct cell *cell, int window, int lag) {
    const int begin = window_begin(cell, window);
    const int end = begin + window;
    return (lag > 0 ? begin - lag : begin) >= 0 &&
           (lag < 0 ? end - lag : end) <= cell->image->width;
}

// Mean difference, in 1/16 grey level, between the window around the cell and the pixels `lag` to
// the left of it, but for one of brightness; both are summed over the rows: what repeats along the
// row is upright, and noise averages out.
static int difference(const struct cell *cell, int window, int lag) {
    INVARIANT(is_inside(cell, window, lag));
    const int begin = window_begin(cell, window);
    const uint16_t *restrict here = cell->columns + begin;
    const uint16_t *restrict there = here - lag;
    const uint32_t *before = cell->before + begin;
    const int32_t total =
        (int32_t)(before[window] - before[0]) - (int32_t)(before[window - lag] - before[-lag]);
    const int16_t mean = (int16_t)(total / window);
    uint32_t sum = 0;
    for (int i = 0; i < window; i++) {
        const int16_t change = (int16_t)(here[i] - there[i] - mean);
        sum += (uint16_t)(change > 0 ? change : -change);
    }
    return (int)(16 * sum / (uint32_t)(cell->rows * window));
}

// A period need not be an integer number of pixels.
static bool is_alike_near(const struct cell *cell, int window, int lag, int limit) {
    for (int near = lag - 1; near <= lag + 1; near++) {
        if (is_inside(cell, window, near) && difference(cell, window, near) <= limit) {
            return true;
        }
    }
    return false;
}

// Whether the content of the cell occurs again `direction` times 3 to `last` pixels to the left,
// with something else between, and twice more: on the other side and as far again. Three similar
// edges are not a repetition.
static bool repeats(const struct cell *cell, int direction, int last) {
    int max = 16 * TUNE_REPEAT_DIFFERENT;
    bool left_it = false;
    for (int step = 1; step <= last; step++) {
        const int lag = direction * step;
        const int window = window_of(lag);
        if (!is_inside(cell, window, lag)) {
            break;
        }
        const int here = difference(cell, window, lag);
        if (here >= max) {
            max = here;
            left_it = true;
        } else if (left_it && step >= TUNE_REPEAT_LAG_PX && here <= max / TUNE_REPEAT_FALL &&
                   is_alike_near(cell, window, -lag, max / TUNE_REPEAT_FALL) &&
                   is_alike_near(cell, window, 2 * lag, max / TUNE_REPEAT_FALL)) {
            return true;
        }
    }
    return false;
}

// Counts the valid pixels from column `first` on, and computes their mean disparity; false: no
// valid pixels.
static bool set_disparity(const struct match_output *output, int first, struct cell *cell) {
    int64_t sum_q8 = 0;
    uint32_t count = 0;
    for (int y = cell->y; y < cell->y + cell->rows; y++) {
        const uint8_t *reason = image_u8_row(&output->reason, y) + cell->x;
        const int32_t *disparity_q8 = image_i32_row(&output->disparity_q8, y) + cell->x;
        for (int i = first - cell->x; i < CELL_COLUMNS; i++) {
            sum_q8 += reason[i] == REASON_VALID ? disparity_q8[i] : 0;
            count += reason[i] == REASON_VALID;
        }
    }
    cell->disparity = count > 0 ? (int)(sum_q8 / (int64_t)count / 256) : 0;
    INVARIANT(count <= CELL_COLUMNS * CELL_ROWS);
    cell->valid = count;
    return count > 0;
}

static void sum_rows(const struct image_u8 *image, int y, int rows, uint16_t *restrict columns) {
    memset(columns, 0, (size_t)image->width * sizeof *columns);
    for (int j = 0; j < rows; j++) {
        const uint8_t *restrict row = image_u8_row(image, y + j);
        for (int x = 0; x < image->width; x++) {
            columns[x] = (uint16_t)(columns[x] + row[x]);
        }
    }
}

static uint32_t count_row_of_cells(const struct cells *cells, int y, uint16_t *columns,
                                   uint32_t *before) {
    INVARIANT(cells->input->left.width >= CELL_COLUMNS);
    uint32_t repeated = 0;
    const struct match_options *options = cells->options;
    const struct image_u8 *image = &cells->input->left;
    const int rows = image->height - y < CELL_ROWS ? image->height - y : CELL_ROWS;
    sum_rows(image, y, rows, columns);
    before[0] = 0;
    for (int x = 0; x < image->width; x++) {
        before[x + 1] = before[x] + columns[x];
    }
    for (int begin = 0; begin < image->width; begin += CELL_COLUMNS) {
        // The last cell ends at the end of the image and overlaps the one before.
        const int last = image->width - CELL_COLUMNS;
        struct cell cell = {.image = image,
                            .columns = columns,
                            .before = before,
                            .x = begin < last ? begin : last,
                            .y = y,
                            .rows = rows};
        if (!set_disparity(cells->output, begin, &cell)) {
            continue;
        }
        const int above = options->disparity_min + options->disparity_count - 1 - cell.disparity;
        const int below = cell.disparity - options->disparity_min;
        if (repeats(&cell, 1, above) || repeats(&cell, -1, below)) {
            repeated += cell.valid;
        }
    }
    return repeated;
}

static void count_part(void *cells_pointer, int index) {
    struct cells *cells = cells_pointer;
    const int rows = cells->end - cells->begin;
    for (int i = cells->begin + rows * index / cells->parts;
         i < cells->begin + rows * (index + 1) / cells->parts; i++) {
        cells->count[index] +=
            count_row_of_cells(cells, i * CELL_ROWS, cells->columns[index], cells->before[index]);
    }
}

static int part_count(int threads) {
    const int parts = threads < PARTS_MAX ? threads : PARTS_MAX;
    return parts < 1 ? 1 : parts;
}

size_t match_repeats_need_bytes(int width, int threads) {
    return (size_t)part_count(threads) * (arena_need_bytes((size_t)width, sizeof(uint16_t)) +
                                          arena_need_bytes((size_t)width + 1, sizeof(uint32_t)));
}

int match_count_repeats(const struct match_input *input, const struct match_options *options,
                        const struct parallel *parallel, struct arena *arena,
                        const struct match_output *output, int begin, int end, uint32_t *count) {
    INVARIANT(begin % CELL_ROWS == 0 && begin <= end && end <= input->left.height);
    struct cells cells = {.input = input,
                          .options = options,
                          .output = output,
                          .begin = begin / CELL_ROWS,
                          .end = (end + CELL_ROWS - 1) / CELL_ROWS,
                          .parts = part_count(parallel->threads)};
    const size_t mark = arena_mark(arena);
    bool taken = true;
    for (int i = 0; i < cells.parts; i++) {
        cells.columns[i] = arena_take(arena, (size_t)input->left.width, sizeof *cells.columns[i]);
        cells.before[i] = arena_take(arena, (size_t)input->left.width + 1, sizeof *cells.before[i]);
        taken = taken && cells.columns[i] != NULL && cells.before[i] != NULL;
    }
    if (taken) {
        parallel->run(parallel->self, count_part, &cells, cells.parts);
    }
    arena_release(arena, mark);
    for (int i = 0; i < cells.parts; i++) {
        *count += cells.count[i];
    }
    return taken ? ERROR_OK : ERROR_MEMORY;
}
