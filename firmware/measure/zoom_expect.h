// SPDX-License-Identifier: Apache-2.0
/// The error that all depths of a pair will share once the pair has adjusted the calibration,
/// before it is taken: the covariance that the adjustment would leave, from points as a scene
/// usually has them. So it can be said what a second zoom or a board is worth.
#ifndef VERGENCE_MEASURE_ZOOM_EXPECT_H
#define VERGENCE_MEASURE_ZOOM_EXPECT_H

#include "core/arena.h"
#include "core/parallel.h"
#include "measure/zoom_field.h"
#include "stereo/zoom/adjustment.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { ZOOM_EXPECT_CORNERS_MAX = 128 };

struct zoom_expect_request {
    struct zoom_state state;         ///< of the pair, aimed and focused
    const struct zoom_state *other;  ///< of a pair at another zoom, pan untouched; NULL: none
    bool only_helped;                ///< the pair alone does not matter, which saves its time
    double point_mm[3];              ///< of the instrument's frame, whose depth it is about
    double near_mm, far_mm;          ///< depths of the scene; 0 0: a twelfth of the distance
    /// Points that both pictures show, and the standard deviation of one coordinate in px of the
    /// frames. 0: as many and as good as usual.
    int matches;
    double match_px;
    /// Corners of a board held at the point, at most ZOOM_EXPECT_CORNERS_MAX; 2 x 1: a length. 0:
    /// no board.
    int columns, rows;
    double square_mm;
    struct watch watch;
};

/// Standard deviations of the depth of the point, mm, with that of all lengths. Negative: not asked
/// for, or not visible.
struct zoom_expect {
    double alone_mm;  ///< by the pair alone
    double other_mm;  ///< with the pair at the other zoom
    double board_mm;  ///< with the board, and no other zoom
};

/// `frames` as zoom_field_at. ERROR_RANGE: the point is not in front of both cameras, or less than
/// 20 points of the scene are in both; ERROR_MEMORY.
int zoom_expect_at(const struct zoom_calibration *calibration, const struct zoom_frames *frames,
                   const struct zoom_expect_request *request, struct arena *arena,
                   struct zoom_expect *expect);
size_t zoom_expect_need_bytes(void);

/// The zoom that helps a pair at this state most, times the left camera's smallest focal length.
double zoom_expect_other_factor(const struct zoom_calibration *calibration,
                                const struct zoom_state *state);

/// Completes a request, whose state and point are set: the board of the demo, and in `*other` the
/// zoom that helps most. No other zoom if the lenses do not reach it.
void zoom_expect_complete(const struct zoom_calibration *calibration,
                          struct zoom_expect_request *request, struct zoom_state *other);

#ifdef __cplusplus
}
#endif

#endif
