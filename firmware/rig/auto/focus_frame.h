// SPDX-License-Identifier: Apache-2.0
/// How sharp a frame of a region is.
#ifndef VERGENCE_RIG_AUTO_FOCUS_FRAME_H
#define VERGENCE_RIG_AUTO_FOCUS_FRAME_H

#include "focus/focus_curve.h"
#include "rig/rig_region.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Measures a frame, with the noise that its gain and black level imply. `gain_is_factor`: its gain
/// is that of an MT9T001, as behind the bridge; else the noise of gain 1 is assumed. Position, time
/// and leg of the sample are the caller's.
struct focus_sample focus_frame_measure(const struct rig_region_frame *frame,
                                        enum focus_measure measure, bool gain_is_factor);

#ifdef __cplusplus
}
#endif

#endif
