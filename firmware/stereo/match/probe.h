// SPDX-License-Identifier: Apache-2.0
/// Debug probe of the matcher: kernels that do the same as those of a processor level, and report
/// each row of each level to a callback. The result is identical, and a run without a probe has no
/// overhead. For pictures and tests.
#ifndef VERGENCE_STEREO_MATCH_PROBE_H
#define VERGENCE_STEREO_MATCH_PROBE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "stereo/match/kernels.h"

#ifdef __cplusplus
extern "C" {
#endif

struct match_tile;

/// When a row is reported; each row of each level is reported once at each event.
enum match_probe_event {
    MATCH_PROBE_COSTS,       // phase 1 is done with it
    MATCH_PROBE_PATH_COSTS,  // phase 2 is done with it
    MATCH_PROBE_WINNERS,     // phase 3 is done with it
};

/// A row at an event. A plane holds one byte for every searched disparity of every pixel; see
/// match_probe_window_at. All pointers belong to the matcher and are valid during the call only;
/// those of other events are NULL.
struct match_probe_row {
    enum match_probe_event event;
    int level;  // 0: the finest
    int y;      // row of the level
    // Size of the level; 2^shift columns and rows make a pixel.
    int width, height, shift_x, shift_y;
    int disparity_min, disparity_count;  // disparities of the level, in its pixels
    size_t plane_bytes;
    const struct match_tile *tiles;
    const struct match_level *owner;

    // MATCH_PROBE_COSTS
    const uint8_t *census[3], *gradient;  // features of the left row, by column
    const uint8_t *cost, *cost_along;     // planes: of the pixel, averaged along the row
    // MATCH_PROBE_PATH_COSTS
    const uint8_t *cost_around;  // plane: averaged along the columns as well
    const uint8_t *from_above;   // plane: path costs from the row above
    // MATCH_PROBE_WINNERS, by column
    const int16_t *winner;      // counted from disparity_min; -1: there is no disparity
    const uint32_t *around;     // costs before, at and after it, in the lower bytes
    const uint8_t *margin;      // margin over its best rival
    const uint8_t *consistent;  // 1: left and right agree
    const uint8_t *fits;        // 1: inside the range, and its cost is low enough
    const uint8_t *reason;      // level 0 only: enum reason, before speckles are removed
};

/// The disparities that one pixel of a row searched, counted from the level's lowest, and the start
/// of their bytes in a plane.
struct match_probe_window {
    int first, count;  // the last ones may lie beyond the level's range, as padding
    size_t cell;
    bool doubtful;                // the coarser level saw other good matches
    int slope_down, slope_along;  // followed, in 1/256 disparities a row and a column
};

/// Callback for a row. Called by the thread that processed it, so by several threads at the same
/// time.
typedef void match_probe_look(void *self, const struct match_probe_row *row);

/// Owned by the caller, and valid for longer than the run; `kernels` goes into
/// match_options.kernels.
struct match_probe {
    struct match_kernels kernels;
    const struct match_kernels *real;
    match_probe_look *look;
    void *self;
};

/// A probe of the kernels `real`, or of the fastest ones if that is NULL.
struct match_probe match_probe_of(const struct match_kernels *real, match_probe_look *look,
                                  void *self);

/// The window of column x.
struct match_probe_window match_probe_window_at(const struct match_probe_row *row, int x);

/// Computes the path costs along a row reported at MATCH_PROBE_PATH_COSTS into a plane
/// (row->plane_bytes, the caller's): from the left, or from the right. They are recomputed, as the
/// matcher only keeps their sum.
void match_probe_path_costs(const struct match_probe_row *row, bool from_right, uint8_t *plane);

#ifdef __cplusplus
}
#endif

#endif
