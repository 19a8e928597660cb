// SPDX-License-Identifier: Apache-2.0
/// Two frames that belong together, with the circumstances of each. Behind one port the cameras
/// are looked at in turn, so the scene must stand still meanwhile: the time between them is part
/// of every pair, and what moved makes it no pair.
#ifndef VERGENCE_RIG_PAIR_H
#define VERGENCE_RIG_PAIR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "rig/rig.h"
#include "stereo/image/picture_stats.h"

#ifdef __cplusplus
extern "C" {
#endif

/// How a camera stood.
struct pair_stand {
    uint16_t pan_q4;              ///< pulse being sent, 1/16 us; 0: no servo
    int32_t position[LENS_AXES];  ///< of the lens, counts; INT32_MIN: no such axis
};

/// Which part of a sensor behind the bridge a frame shows, see struct mt9t001_window.
struct pair_window {
    uint16_t column_px, row_px;
    uint8_t skip;  ///< 0: nobody knows, as with a camera that has a port of its own
};

/// A frame. `data` points into the caller's memory.
struct pair_frame {
    uint16_t *data;
    uint16_t width_px, height_px;
    struct pair_window window;
    uint32_t stride;
    uint8_t bits;
    enum hal_camera_layout layout;
    uint32_t sequence;
    uint64_t begin_us, end_us;
    uint32_t exposure_us;
    uint16_t gain_q3;
    struct pair_stand before, after;
    bool has_picture;  ///< whether `picture` is known; see pair_frame_judge
    struct picture_stats picture;
};

struct pair {
    uint32_t number;  ///< since the bring-up, from 1
    struct pair_frame frame[RIG_SIDES];
    int64_t skew_us;           ///< start of the right frame after the left's
    bool checked;              ///< for a scene that stands still; then:
    uint32_t change_permille;  ///< pixels of the left camera that changed by more than their noise
};

struct pair_options {
    bool check_static;  ///< the left camera again, and compare
};

/// Values (of uint16_t) that a pair of the present window needs, all frames that are used for it
/// included.
size_t pair_values(const struct rig *rig, const struct pair_options *options);

/// Takes a pair into `memory` (`values` long). ERROR_MEMORY; ERROR_MOVED: pan or lens moved between
/// the frames, they are too far apart in time, or the scene changed; ERROR_FRAME: torn, also after
/// a second try; others of the parts. `*pair` is set only on success, but for ERROR_MOVED, when it
/// shows what moved.
int pair_capture(struct rig *rig, const struct pair_options *options, uint16_t *memory,
                 size_t values, struct pair *pair);

/// Takes a frame of each camera as they are now, into `memory` (`values` long; as many as a pair
/// without options needs). Nothing is compared: they are for a person to look at. Of their axes
/// nothing is known. ERROR_MEMORY; ERROR_FRAME: torn, also after a second try; others of the parts.
int pair_look(struct rig *rig, uint16_t *memory, size_t values,
              struct pair_frame frames[RIG_SIDES]);

/// Sets `picture` from the frame's data.
void pair_frame_judge(struct pair_frame *frame);

#ifdef __cplusplus
}
#endif

#endif
