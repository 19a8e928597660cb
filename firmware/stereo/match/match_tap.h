// SPDX-License-Identifier: Apache-2.0
/// A look at the matcher while it works: kernels that do what those of a processor level do, and
/// show each row of each level to a callback. The result keeps its bytes, and a run without a tap
/// does not know of it. For pictures and tests.
#ifndef VERGENCE_STEREO_MATCH_MATCH_TAP_H
#define VERGENCE_STEREO_MATCH_MATCH_TAP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "stereo/match/match_kernels.h"

#ifdef __cplusplus
extern "C" {
#endif

struct match_tile;

/// When a row is shown; each row of each level comes once at each.
enum match_tap_event {
    MATCH_TAP_COSTS,     // phase 1 is done with it
    MATCH_TAP_MESSAGES,  // phase 2 is done with it
    MATCH_TAP_WINNERS,   // phase 3 is done with it
};

/// A row as it is at an event. A plane holds a byte for every searched disparity of every pixel;
/// see match_tap_window_at. All pointers are the matcher's and valid during the call only; those of
/// other events are NULL.
struct match_tap_row {
    enum match_tap_event event;
    int level;                            // 0: the finest
    int y;                                // of the level
    int width, height, shift_x, shift_y;  // of the level: 2^shift columns and rows make a pixel
    int disparity_min, disparity_count;   // of the level, in its pixels
    size_t plane_bytes;
    const struct match_tile *tiles;
    const struct match_level *owner;

    // MATCH_TAP_COSTS
    const uint8_t *census[3], *gradient;  // of the left row, by column
    const uint8_t *cost, *cost_along;     // planes: of the pixel, averaged along the row
    // MATCH_TAP_MESSAGES
    const uint8_t *cost_around;  // plane: averaged along the columns as well
    const uint8_t *from_above;   // plane: messages from the row above
    // MATCH_TAP_WINNERS, by column
    const int16_t *winner;      // counted from disparity_min; -1: none
    const uint32_t *around;     // costs before, at and after it, in the lower bytes
    const uint8_t *margin;      // by which it beats its best rival
    const uint8_t *consistent;  // 1: left and right agree
    const uint8_t *fits;        // 1: inside the range, and its cost is low
    const uint8_t *reason;      // level 0 only: enum reason, before islands are looked for
};

/// The disparities that one pixel of a row searched, counted from the level's lowest, and where
/// their bytes begin in a plane.
struct match_tap_window {
    int first, count;  // the last ones may lie beyond the level's range, as padding
    size_t cell;
    bool doubtful;  // the coarser level saw other places that fit as well
};

/// Looks at a row. Called by the thread that worked on it, so by several at the same time.
typedef void match_tap_look(void *self, const struct match_tap_row *row);

/// Owned by the caller, for longer than the run; `kernels` is what match_options.kernels takes.
struct match_tap {
    struct match_kernels kernels;
    const struct match_kernels *real;
    match_tap_look *look;
    void *self;
};

/// A tap of the kernels `real`, or of the fastest ones where that is NULL.
struct match_tap match_tap_of(const struct match_kernels *real, match_tap_look *look, void *self);

/// The window of column x.
struct match_tap_window match_tap_window_at(const struct match_tap_row *row, int x);

/// Fills a plane (row->plane_bytes, the caller's) with the messages along a row that is shown at
/// MATCH_TAP_MESSAGES: from the left, or from the right. Computed once more, since the matcher
/// keeps only their sum.
void match_tap_messages(const struct match_tap_row *row, bool from_right, uint8_t *plane);

#ifdef __cplusplus
}
#endif

#endif
