// SPDX-License-Identifier: Apache-2.0
#include "stereo/match_repeats.h"

#include "core/invariant.h"
#include "stereo/image/reason.h"

enum {
    CELL_COLUMNS = 16,  // what is tested at once
    CELL_ROWS = 8,
    ROW_STEP = 2,  // distance of the rows that are compared
    LAG_MIN = 3,   // minimum period in pixels: closer rivals are in every search
    FALL = 4,      // a repetition must differ by this factor less than what lies before it
    PARTS_MAX = 8,
    DIFFERENT = 6,  // mean difference of grey levels between the two, at least
};

struct cells {
    const struct match_input *input;
    const struct match_options *options;
    const struct match_output *output;
    int parts;
    uint32_t count[PARTS_MAX];
};

// A cell and its disparity.
struct cell {
    const struct image_u8 *image;
    int x, y, rows, disparity;
    uint32_t valid;  // pixels
};

static bool is_inside(const struct cell *cell, int lag) {
    return cell->x - lag >= 0 && cell->x - lag + CELL_COLUMNS <= cell->image->width;
}

// Sum of the differences of grey levels between the cell and the pixels `lag` to the left of it.
static int difference(const struct cell *cell, int lag) {
    INVARIANT(is_inside(cell, lag) && cell->y + cell->rows <= cell->image->height);
    int sum = 0;
    for (int j = 0; j < cell->rows; j += ROW_STEP) {
        const uint8_t *restrict here = image_u8_row(cell->image, cell->y + j) + cell->x;
        const uint8_t *restrict there = here - lag;
        for (int i = 0; i < CELL_COLUMNS; i++) {
            sum += here[i] > there[i] ? here[i] - there[i] : there[i] - here[i];
        }
    }
    return sum;
}

// A period need not be an integer number of pixels.
static bool is_alike_near(const struct cell *cell, int lag, int limit) {
    for (int near = lag - 1; near <= lag + 1; near++) {
        if (is_inside(cell, near) && difference(cell, near) <= limit) {
            return true;
        }
    }
    return false;
}

// Whether the content of the cell occurs again `direction` times 3 to `last` pixels to the left,
// with something else between, and once more: on the other side or as far again. Two similar edges
// are not a repetition.
static bool repeats(const struct cell *cell, int direction, int last) {
    const int compared = (cell->rows + ROW_STEP - 1) / ROW_STEP * CELL_COLUMNS;
    int max = DIFFERENT * compared;
    bool left_it = false;
    for (int step = 1; step <= last && is_inside(cell, direction * step); step++) {
        const int lag = direction * step;
        const int here = difference(cell, lag);
        if (here >= max) {
            max = here;
            left_it = true;
        } else if (left_it && step >= LAG_MIN && here <= max / FALL &&
                   (is_alike_near(cell, -lag, max / FALL) ||
                    is_alike_near(cell, 2 * lag, max / FALL))) {
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

static uint32_t count_row_of_cells(const struct cells *cells, int y) {
    INVARIANT(cells->input->left.width >= CELL_COLUMNS);
    uint32_t repeated = 0;
    const struct match_options *options = cells->options;
    const struct image_u8 *image = &cells->input->left;
    const int rows = image->height - y < CELL_ROWS ? image->height - y : CELL_ROWS;
    for (int begin = 0; begin < image->width; begin += CELL_COLUMNS) {
        // The last cell ends at the end of the image and overlaps the one before.
        const int last = image->width - CELL_COLUMNS;
        struct cell cell = {.image = image, .x = begin < last ? begin : last, .y = y, .rows = rows};
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
    const int rows = (cells->input->left.height + CELL_ROWS - 1) / CELL_ROWS;
    for (int i = rows * index / cells->parts; i < rows * (index + 1) / cells->parts; i++) {
        cells->count[index] += count_row_of_cells(cells, i * CELL_ROWS);
    }
}

uint32_t match_count_repeats(const struct match_input *input, const struct match_options *options,
                             const struct parallel *parallel, const struct match_output *output) {
    const int threads = parallel->threads < 1 ? 1 : parallel->threads;
    struct cells cells = {.input = input,
                          .options = options,
                          .output = output,
                          .parts = threads < PARTS_MAX ? threads : PARTS_MAX};
    parallel->run(parallel->self, count_part, &cells, cells.parts);
    uint32_t count = 0;
    for (int i = 0; i < cells.parts; i++) {
        count += cells.count[i];
    }
    return count;
}
