// SPDX-License-Identifier: Apache-2.0
/// Two frames of one scene, with information about each. Behind one port the cameras take turns, so
/// the scene must not move meanwhile: the time between the frames is part of every pair, and a pair
/// during which something moved is rejected.
#ifndef VERGENCE_RIG_PAIR_H
#define VERGENCE_RIG_PAIR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "rig/rig.h"
#include "rig/rig_region.h"
#include "stereo/image/picture_stats.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Pan and lens positions of a camera.
struct pair_axes {
    uint16_t pan_q4;              ///< pulse being sent, 1/16 us; 0: no servo
    int32_t position[LENS_AXES];  ///< of the lens, counts; INT32_MIN: no such axis
};

/// The part of a sensor behind the bridge that a frame shows, see struct mt9t001_window.
struct pair_window {
    uint16_t column_px, row_px;
    uint8_t skip;  ///< 0: not known, as for a camera with its own port
};

/// A frame, and what it was taken with.
struct pair_frame {
    struct raw_image image;
    struct pair_window window;
    uint32_t sequence;
    uint64_t begin_us, end_us;
    uint32_t exposure_us;
    uint16_t gain_q3;
    struct pair_axes before, after;
    bool has_picture;  ///< whether `picture` is known; see pair_frame_assess
    struct picture_stats picture;
};

struct pair {
    uint32_t number;  ///< counted from 1 since the bring-up
    struct pair_frame frame[RIG_SIDES];
    int64_t skew_us;           ///< start of the right frame minus start of the left frame
    bool checked;              ///< the scene must not move; and:
    uint32_t change_permille;  ///< parts of the left image that changed by more than their noise,
                               ///< of 1000
};

struct pair_options {
    bool check_static;  ///< take a second left frame, and compare
};

/// Takes a pair. Errors: ERROR_MEMORY; ERROR_MOVED: pan or lens moved between the frames, they are
/// too far apart in time, or the scene changed; ERROR_FRAME: incomplete, also at the second
/// attempt; others of the parts. `*pair` is set only on success, when the caller releases it, and
/// for ERROR_MOVED, when it shows what moved but has no images.
int pair_capture(struct rig *rig, const struct pair_options *options, struct pair *pair);

/// A frame for display.
struct pair_look_frame {
    struct rig_region_frame frame;
    uint8_t skip;  ///< of the sensor; 1 for a camera with its own port
};

enum { PAIR_LOOK_MIN_PX = 256, PAIR_LOOK_WHOLE_PX = UINT16_MAX };

/// Takes one current frame of each camera without any comparison, for display only. Behind the
/// bridge, frames of more than `max_side_px` (at least PAIR_LOOK_MIN_PX) a side are thinned by the
/// sensor, which is then set as before; other cameras send theirs whole. Their axes are not read.
/// Errors: ERROR_MEMORY; ERROR_FRAME: incomplete, also at the second attempt; ERROR_CANCELLED;
/// others of the parts. On success the caller releases them.
int pair_look(struct rig *rig, int max_side_px, struct pair_look_frame looks[RIG_SIDES]);
void pair_look_release(struct pair_look_frame looks[RIG_SIDES]);

/// Releases the images of both frames.
void pair_release(struct pair_frame frames[RIG_SIDES]);

/// Sets `picture` from the frame's data.
void pair_frame_assess(struct pair_frame *frame);

#ifdef __cplusplus
}
#endif

#endif
