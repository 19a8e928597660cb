// SPDX-License-Identifier: Apache-2.0
#include "stereo/image/picture_view.h"

#include "core/invariant.h"
#include "core/root.h"
#include "stereo/image/image.h"

enum {
    COLUMNS = PICTURE_VIEW_COLUMNS,
    ROWS = PICTURE_VIEW_ROWS,
    LEVELS = 4095,
    AROUND = 3,  // neighbouring cells on each side
    PERMILLE = 1000,
};

/// First pixel of a column: even, so that a mosaic's cells contain all colours equally.
static int first_px(int column, int width_px) {
    return column * width_px / COLUMNS / 2 * 2;
}

void picture_view_begin(struct picture_view_sums *sums, const struct picture_form *form,
                        int height_px) {
    INVARIANT(form->width_px > 0 && form->width_px <= IMAGE_MAX_SIDE_PX);
    INVARIANT(height_px > 0 && height_px <= IMAGE_MAX_SIDE_PX);
    *sums = (struct picture_view_sums){.form = *form, .height_px = height_px};
}

void picture_view_row(struct picture_view_sums *sums, const uint16_t *values) {
    INVARIANT(sums->rows < sums->height_px);
    const int row = sums->rows / 2 * 2 * ROWS / sums->height_px;
    for (int column = 0; column < COLUMNS; column++) {
        const int end = first_px(column + 1, sums->form.width_px) * sums->form.channels;
        uint32_t sum = 0;
        for (int i = first_px(column, sums->form.width_px) * sums->form.channels; i < end; i++) {
            sum += values[i];
        }
        sums->cell[row][column] += sum;
    }
    sums->cell_rows[row]++;
    sums->rows++;
}

/// Mean of the existing cells around one.
static int mean_around(int16_t level[ROWS][COLUMNS], int row, int column) {
    const int top = row > AROUND ? row - AROUND : 0;
    const int bottom = row + AROUND < ROWS ? row + AROUND : ROWS - 1;
    const int left = column > AROUND ? column - AROUND : 0;
    const int right = column + AROUND < COLUMNS ? column + AROUND : COLUMNS - 1;
    int sum = 0;
    for (int y = top; y <= bottom; y++) {
        for (int x = left; x <= right; x++) {
            sum += level[y][x];
        }
    }
    return sum / ((bottom - top + 1) * (right - left + 1));
}

void picture_view_end(const struct picture_view_sums *sums, struct picture_view *view) {
    INVARIANT(sums->rows == sums->height_px);
    const struct picture_form *form = &sums->form;
    const uint64_t full = (UINT64_C(1) << form->bits) - 1;
    *view = (struct picture_view){.cell = {{0}}};
    if (form->width_px < 2 * COLUMNS || sums->height_px < 2 * ROWS) {
        return;
    }
    int16_t level[ROWS][COLUMNS];
    for (int row = 0; row < ROWS; row++) {
        for (int column = 0; column < COLUMNS; column++) {
            const int width_px =
                first_px(column + 1, form->width_px) - first_px(column, form->width_px);
            const int values = width_px * form->channels * sums->cell_rows[row];
            const uint64_t all = (uint64_t)values * full;
            const uint64_t sum = sums->cell[row][column] < all ? sums->cell[row][column] : all;
            level[row][column] = (int16_t)(all == 0 ? 0 : sum * LEVELS / all);
        }
    }
    for (int row = 0; row < ROWS; row++) {
        for (int column = 0; column < COLUMNS; column++) {
            view->cell[row][column] =
                (int16_t)(level[row][column] - mean_around(level, row, column));
        }
    }
}

static void turn_view(const struct picture_view *view, enum picture_turn turn,
                      struct picture_view *turned) {
    const bool rows = turn == PICTURE_ROTATED || turn == PICTURE_FLIPPED;
    const bool columns = turn == PICTURE_ROTATED || turn == PICTURE_MIRRORED;
    for (int y = 0; y < ROWS; y++) {
        for (int x = 0; x < COLUMNS; x++) {
            turned->cell[y][x] = view->cell[rows ? ROWS - 1 - y : y][columns ? COLUMNS - 1 - x : x];
        }
    }
}

static int correlation(const struct picture_view *first, const struct picture_view *second, int dx,
                       int dy) {
    const int left = dx > 0 ? dx : 0, right = dx < 0 ? COLUMNS + dx : COLUMNS;
    const int top = dy > 0 ? dy : 0, bottom = dy < 0 ? ROWS + dy : ROWS;
    const int64_t count = (int64_t)(right - left) * (bottom - top);
    int64_t a = 0, b = 0, aa = 0, bb = 0, ab = 0;
    for (int y = top; y < bottom; y++) {
        for (int x = left; x < right; x++) {
            const int32_t p = first->cell[y][x], q = second->cell[y - dy][x - dx];
            a += p;
            b += q;
            aa += p * p;
            bb += q * q;
            ab += p * q;
        }
    }
    const int64_t spread_a = count * aa - a * a, spread_b = count * bb - b * b;
    if (spread_a <= 0 || spread_b <= 0) {
        return 0;
    }
    // The roots are of positive integers, so at least 1.
    return (int)((count * ab - a * b) * PERMILLE / (root_of(spread_a) * root_of(spread_b)));
}

struct picture_overlay picture_view_compare(const struct picture_view *first,
                                            const struct picture_view *second,
                                            enum picture_turn turn, int min_dx, int max_dx) {
    struct picture_view turned;
    struct picture_overlay best = {.score_permille = 0};
    INVARIANT(min_dx >= -PICTURE_VIEW_MAX_DX && max_dx <= PICTURE_VIEW_MAX_DX);
    turn_view(second, turn, &turned);
    for (int dy = -PICTURE_VIEW_MAX_DY; dy <= PICTURE_VIEW_MAX_DY; dy++) {
        for (int dx = min_dx; dx <= max_dx; dx++) {
            const int across = COLUMNS - (dx < 0 ? -dx : dx);
            const int down = ROWS - (dy < 0 ? -dy : dy);
            const int overlap = across * down * PERMILLE / (COLUMNS * ROWS);
            const int found =
                correlation(first, &turned, dx, dy) * (PERMILLE + overlap) / (2 * PERMILLE);
            if (found > best.score_permille) {
                best = (struct picture_overlay){found, dx, dy, overlap};
            }
        }
    }
    return best;
}
