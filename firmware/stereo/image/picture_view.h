// SPDX-License-Identifier: Apache-2.0
/// Whether two pictures show the same scene, and in which orientation: both are shrunk to a few
/// cells and compared at every shift. Rows are added one by one. Integers only.
#ifndef VERGENCE_STEREO_IMAGE_PICTURE_VIEW_H
#define VERGENCE_STEREO_IMAGE_PICTURE_VIEW_H

#include <stdint.h>

#include "stereo/image/picture_stats.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    PICTURE_VIEW_COLUMNS = 48,
    PICTURE_VIEW_ROWS = 36,
    /// Shifts that leave less than a fourth of the columns, or three fourths of the rows, are not
    /// compared.
    PICTURE_VIEW_MAX_DX = 36,
    PICTURE_VIEW_MAX_DY = 9,
};

/// A picture's cells, each minus the mean of its neighbourhood (7 x 7 cells); 4095 is full scale.
/// All 0 for pictures with less than two pixels per column or row of cells.
struct picture_view {
    int16_t cell[PICTURE_VIEW_ROWS][PICTURE_VIEW_COLUMNS];
};

/// Accumulator for one view.
struct picture_view_sums {
    struct picture_form form;
    int height_px, rows;
    int cell_rows[PICTURE_VIEW_ROWS];  ///< picture rows already added to a row of cells
    uint32_t cell[PICTURE_VIEW_ROWS][PICTURE_VIEW_COLUMNS];
};

/// Sides at most IMAGE_MAX_SIDE_PX.
void picture_view_begin(struct picture_view_sums *sums, const struct picture_form *form,
                        int height_px);
/// Adds the next of `height_px` rows.
void picture_view_row(struct picture_view_sums *sums, const uint16_t *values);
void picture_view_end(const struct picture_view_sums *sums, struct picture_view *view);

/// Transformation of the second picture before the comparison.
enum picture_turn {
    PICTURE_AS_IS,
    PICTURE_ROTATED,   ///< half a turn
    PICTURE_FLIPPED,   ///< upside down: rows in reverse
    PICTURE_MIRRORED,  ///< columns in reverse
    PICTURE_TURNS
};

/// Best alignment of two pictures.
struct picture_overlay {
    /// Correlation of the cells (1000: equal up to light) times (1 + overlap) / 2, as a few cells
    /// may agree by chance. Measured: two views of one scene 277..916, of two scenes 107..412,
    /// mostly below 270 (49 pairs).
    int score_permille;
    /// The cell (x, y) of the first corresponds to (x - dx, y - dy) of the second: nearer objects
    /// have a larger dx.
    int dx, dy;
    int overlap_permille;  ///< area that both pictures cover, over that of one
};

/// The best alignment with min_dx <= dx <= max_dx. Score 0 if nothing fits.
struct picture_overlay picture_view_compare(const struct picture_view *first,
                                            const struct picture_view *second,
                                            enum picture_turn turn, int min_dx, int max_dx);

#ifdef __cplusplus
}
#endif

#endif
