// SPDX-License-Identifier: Apache-2.0
/// The calibration of a captured pair from the calibration of all zooms, corrected by what the
/// pair's own pictures show.
#ifndef VERGENCE_CONSOLE_PAIR_PAIR_ADJUST_H
#define VERGENCE_CONSOLE_PAIR_PAIR_ADJUST_H

#include "core/arena.h"
#include "core/message.h"
#include "core/parallel.h"
#include "rig/pair.h"
#include "stereo/zoom/wide_pair.h"

#ifdef __cplusplus
extern "C" {
#endif

/// What is known of the scene of the first pair, and who looks after the rig meanwhile.
struct pair_adjust_scene {
    double near_mm;  ///< nearest depth; 0: not known. Corners count at all depths beyond it
    /// A thing of known size, as its left (view 0) and right camera (1) see it; NULL: none.
    const struct adjust_target *target;
    struct watch watch;
};

struct pair_adjust_report {
    struct adjust_report self_calibration;
    uint32_t with_pair;   ///< number of the second pair that helps with this one; 0: none
    bool with_pair_used;  ///< the second pair did help
    struct wide_pair_report wide_pair;
    int target_points;                    ///< of the thing of known size; 0: none
    struct adjust_report without_target;  ///< what the pictures alone gave then
};

/// Refines the first of `count` pairs, taken in these states; the second, if there is one, is of
/// the same scene at another zoom, with pan untouched. Returns 0 with the calibration of the frames
/// as they are, or an error with `message` set.
int pair_adjust(const struct zoom_calibration *zoom, const struct pair *const *pairs,
                const struct zoom_state *states, int count, const struct pair_adjust_scene *scene,
                struct arena *arena, struct calibration *calibration,
                struct pair_adjust_report *report, struct message *message);
size_t pair_adjust_need_bytes(const struct pair *const *pairs, int count,
                              const struct adjust_target *target);

#ifdef __cplusplus
}
#endif

#endif
