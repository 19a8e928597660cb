// SPDX-License-Identifier: Apache-2.0
/// Whether two pictures show the same scene, and which way up: both are shrunk to a few cells and
/// laid over each other at every shift. Rows go in one after the other. Integers only.
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
    /// Shifts that leave less than a fourth of the columns, or three fourths of the rows, say
    /// nothing.
    PICTURE_VIEW_MAX_DX = 36,
    PICTURE_VIEW_MAX_DY = 9,
};

/// A picture's cells, each less the mean of its surroundings (7 x 7 cells), of 4095 at full scale.
/// All 0 for pictures narrower than two pixels a column or lower than two a row.
struct picture_view {
    int16_t cell[PICTURE_VIEW_ROWS][PICTURE_VIEW_COLUMNS];
};

/// A view in the making.
struct picture_view_sums {
    struct picture_form form;
    int height_px, rows;
    int cell_rows[PICTURE_VIEW_ROWS];  ///< of the picture, that went into a row of cells
    uint32_t cell[PICTURE_VIEW_ROWS][PICTURE_VIEW_COLUMNS];
};

/// Sides at most IMAGE_MAX_SIDE_PX.
void picture_view_begin(struct picture_view_sums *sums, const struct picture_form *form,
                        int height_px);
/// The next of `height_px` rows.
void picture_view_row(struct picture_view_sums *sums, const uint16_t *values);
void picture_view_end(const struct picture_view_sums *sums, struct picture_view *view);

/// What is done to the second picture before it is compared.
enum picture_turn {
    PICTURE_AS_IS,
    PICTURE_ROTATED,   ///< by 180 degrees
    PICTURE_FLIPPED,   ///< upside down: rows in reverse
    PICTURE_MIRRORED,  ///< columns in reverse
    PICTURE_TURNS
};

/// How two pictures lie over each other.
struct picture_overlay {
    /// Correlation of the cells, 1000: the same up to light; times (1 + overlap) / 2, as a few
    /// cells are alike by chance. Measured: two views of one scene 277..916, of two scenes
    /// 107..412, mostly below 270 (49 pairs).
    int score_permille;
    /// The cell (x, y) of the first is (x - dx, y - dy) of the second: nearer things have a larger
    /// dx.
    int dx, dy;
    int overlap_permille;  ///< of the pictures' area
};

/// The best one of those with min_dx <= dx <= max_dx. A score of 0 where nothing fits.
struct picture_overlay picture_view_compare(const struct picture_view *first,
                                            const struct picture_view *second,
                                            enum picture_turn turn, int min_dx, int max_dx);

#ifdef __cplusplus
}
#endif

#endif
