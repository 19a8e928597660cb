// SPDX-License-Identifier: Apache-2.0
/// Two frames of one scene, with information about each. Behind one port the cameras take turns, so
/// the scene must not move meanwhile: the time between the frames is part of every pair, and a pair
/// during which something moved is rejected.
#ifndef VERGENCE_RIG_PAIR_H
#define VERGENCE_RIG_PAIR_H

#include <stdbool.h>
#include <stdint.h>

#include "rig/pair_frame.h"
#include "rig/rig.h"
#include "rig/rig_region.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Takes a pair. Errors: ERROR_MEMORY; ERROR_MOVED: pan or lens moved between the frames, they are
/// too far apart in time, or the scene changed; ERROR_FRAME: incomplete, also at the second
/// attempt; ERROR_UNSUPPORTED, ERROR_RANGE: no such bracket, `rejected` says why; others of the
/// parts. `*pair` is set only on success, when the caller releases it, and
/// for ERROR_MOVED, when it shows what moved but has no images.
int pair_capture(struct rig *rig, const struct pair_options *options, struct pair *pair);

/// A frame for display.
struct pair_look_frame {
    struct rig_region_frame frame;
    uint16_t column_px, row_px;  ///< of its first pixel on the sensor
    uint8_t skip;                ///< skip of the sensor; 1 for a camera with its own port
};

enum { PAIR_LOOK_MIN_PX = 256, PAIR_LOOK_WHOLE_PX = UINT16_MAX };

/// Takes one current frame of each camera without any comparison, for display only. Behind the
/// bridge, frames of more than `max_side_px` (at least PAIR_LOOK_MIN_PX) a side are thinned by the
/// sensor, which is then set as before; other cameras send theirs whole. Their axes are not read.
/// `streams`: for one look after the other; frames of cameras with their own ports, unless they are
/// triggered, may then have begun up to two frame periods before the call, so that none is missed
/// that came since the look before. Errors: ERROR_MEMORY; ERROR_FRAME: incomplete, also at the
/// second attempt; ERROR_CANCELLED; others of the parts. On success the caller releases them.
int pair_look(struct rig *rig, int max_side_px, bool streams,
              struct pair_look_frame looks[RIG_SIDES]);
void pair_look_release(struct pair_look_frame looks[RIG_SIDES]);

#ifdef __cplusplus
}
#endif

#endif
