// SPDX-License-Identifier: Apache-2.0
/// A frame of a pair, and what it was taken with; and the pair of two. rig/pair.h takes pairs.
#ifndef VERGENCE_RIG_PAIR_FRAME_H
#define VERGENCE_RIG_PAIR_FRAME_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "rig/rig.h"
#include "stereo/image/merge_exposures.h"
#include "stereo/image/picture_stats.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Pan and lens positions of a camera.
struct pair_axes {
    uint16_t pan_q4;                   ///< pulse being sent, 1/16 us; 0: no servo
    struct lens_mean lens[LENS_AXES];  ///< means of RIG_LENS_READINGS readings, if not of others
};

/// The part of a sensor behind the bridge that a frame shows, see struct mt9t001_window.
struct pair_window {
    uint16_t column_px, row_px;
    uint8_t skip;  ///< 0: not known, as for a camera with its own port
};

/// Frames with the same settings that were merged into one.
struct pair_part {
    uint32_t exposure_us;  ///< 0: not known
    uint16_t gain_q3;      ///< 0: not known
    uint16_t frames;
};

enum {
    PAIR_AVERAGE_MAX = MERGE_FRAMES_MAX,
    PAIR_BRACKET_MAX = 6,
    PAIR_PARTS_MAX = PAIR_BRACKET_MAX,
};

/// A frame, and what it was taken with. Of a merged one (see struct pair_options), sequence and
/// begin are those of the first frame, the end is that of the last, and the exposure is the
/// shortest: its light is that of this exposure.
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
    uint8_t parts;  ///< what it was merged from; 0: nothing, it is one frame
    struct pair_part part[PAIR_PARTS_MAX];
};

struct pair {
    uint32_t number;  ///< counted from 1 since the bring-up
    struct pair_frame frame[RIG_SIDES];
    int64_t skew_us;           ///< start of the right frame minus start of the left frame; of a
                               ///< merged pair, of the last right and the first left frame
    bool checked;              ///< the scene must not move; and:
    uint32_t change_permille;  ///< parts of the left image that changed by more than their noise,
                               ///< of 1000
};

/// Memory for merged images, as malloc and free.
struct pair_memory {
    void *(*allocate)(size_t bytes);
    void (*release)(void *memory);
};

/// Several frames of each camera may be merged into one of 16 bits (stereo/image/
/// merge_exposures.h): all left ones, then all right ones, so that no more than one camera's sums
/// are in memory, then another left one. Each is compared with those before, so the scene is always
/// checked and the pair's skew is not limited. The exposure is that from before afterwards, also
/// after errors.
struct pair_options {
    bool check_static;  ///< take a second left frame, and compare
    uint8_t average;    ///< frames of the same exposure, 2 .. PAIR_AVERAGE_MAX; 0: one
    uint8_t bracket;    ///< frames of different exposures, 2 .. PAIR_BRACKET_MAX; 0: one
    uint8_t readings;   ///< readings of the lens positions before the frames,
                        ///< 1 .. RIG_LENS_READINGS_MAX; 0: RIG_LENS_READINGS
    const struct pair_memory *memory;  ///< not NULL if frames are merged
};

/// Releases the images of both frames.
void pair_release(struct pair_frame frames[RIG_SIDES]);

/// Sets `picture` from the frame's data.
void pair_frame_assess(struct pair_frame *frame);

// ---- for rig/ only

enum { PAIR_FRAME_ATTEMPTS = 2 };  ///< attempts at one complete frame

/// Keeps a frame that was taken, with all its information but the axes, if it is complete; else
/// releases it. `out` has no image before.
int pair_keep_frame(struct rig *rig, unsigned side, struct hal_camera_frame *frame,
                    struct pair_frame *out);

/// Takes one complete frame of a camera, in place of that in `out`, which is released first,
/// without axes.
int pair_take_frame(struct rig *rig, unsigned side, uint64_t not_before_us, struct pair_frame *out);

/// ERROR_MOVED, with its message, if more of a camera's picture changed than noise explains.
int pair_check_change(struct rig *rig, unsigned side, uint32_t change_permille);

#ifdef __cplusplus
}
#endif

#endif
