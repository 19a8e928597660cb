// SPDX-License-Identifier: Apache-2.0
/// Autofocus: finds the focus of one or both cameras by pictures of a region, and leaves the ring
/// there. The decisions are those of focus/focus_search.h; here are motor and camera.
///
/// The region is read with the sensor's own fast window (rig/rig_region.h) while the ring moves.
/// Exposure and gain are locked during a search. If the exposure is so long that the ring would
/// pass through the peak meanwhile, the search uses a shorter one with a higher gain; never shorter
/// than a half period of the mains, whose flicker cancels out. Window, exposure and gain are
/// afterwards as they were.
///
/// Both lenses move at once, and take turns with the frames, as the bridge passes one camera: while
/// one is under way to its peak, the other is swept. The right lens begins where the left one has
/// seen a peak, as soon as it has seen one, and is searched again where that turns out to be none.
///
/// A lens whose controller does not report positions while it moves, and a camera with a focus
/// control instead of a motorized lens, are moved in steps and measured at rest.
#ifndef VERGENCE_RIG_AUTO_AUTOFOCUS_H
#define VERGENCE_RIG_AUTO_AUTOFOCUS_H

#include "focus/focus_search.h"
#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Size of the region, px.
enum {
    RIG_AUTOFOCUS_REGION_PX = 100,  ///< unless another is asked for
    /// At least: in fewer pixels noise and single bright points look like texture.
    RIG_AUTOFOCUS_REGION_MIN_PX = 32,
};

struct rig_autofocus_options {
    /// Region as in rig_region_begin, each side RIG_AUTOFOCUS_REGION_MIN_PX .. FOCUS_WINDOW_MAX_PX;
    /// width 0: in the middle.
    struct rig_rectangle region_px;
    enum focus_measure measure;
    enum focus_choice choice;
    bool whole_range;  ///< sweep everything, whatever is known
    bool curve_only;   ///< sweep everything, then return to the present position
};

/// Focuses the cameras `sides` (bits RIG_LEFT, RIG_RIGHT). What was found is in `focus` of the
/// cameras (rig/base/rig_state.h), whose `done` says whether it was searched to the end. Returns 0
/// whatever the verdicts are; ERROR_ARGUMENT, ERROR_NOT_CONNECTED, ERROR_NOT_READY, ERROR_RANGE
/// before anything moves; ERROR_JAMMED (the verdict says so too), ERROR_CANCELLED and errors of the
/// parts, with the ring at rest and the camera as it was, or the rig RIG_SAFE. A lens controller
/// that has gone cannot stop its ring, which then ends where it was sent, within its range.
int rig_autofocus(struct rig *self, unsigned sides, const struct rig_autofocus_options *options);

#ifdef __cplusplus
}
#endif

#endif
