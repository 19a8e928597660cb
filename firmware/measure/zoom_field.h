// SPDX-License-Identifier: Apache-2.0
/// What both cameras see at a distance, how finely, and the zoom at which they see as much, or as
/// finely, as is wanted.
///
/// All of it is of the plane through a point, across the instrument's z axis. Source of the density
/// as a measure: Liu, Willis and Sui, "Stereoscopic 3D Reconstruction using Motorized Zoom Lenses
/// within an Embedded System", figure 3: F^2 / Z^2.
#ifndef VERGENCE_MEASURE_ZOOM_FIELD_H
#define VERGENCE_MEASURE_ZOOM_FIELD_H

#include "stereo/zoom/zoom_calibration.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The parts of the sensors that frames show. `skip` 0: all of both.
struct zoom_frames {
    struct zoom_range edge_px[2]
                             [2];  ///< of each side, columns and rows: outer edges, -0.5 the first
    int skip;                      ///< one of every so many pixels is read
};

/// Frames that begin at the same or different places, as `struct calibration_window` has them.
struct zoom_frames zoom_frames_of(const struct calibration_window window[2], int width_px,
                                  int height_px);

/// The frames themselves, or whole sensors for NULL or frames of unknown place.
struct zoom_frames zoom_frames_or_whole(const struct zoom_calibration *calibration,
                                        const struct zoom_frames *frames);

struct zoom_field {
    /// The largest rectangle with the point in its middle that both cameras see, by the row and the
    /// column of the point. 0: a camera does not see the point.
    double width_mm, height_mm;
    double density_per_mm2;  ///< px of the frames for each mm^2, of the camera that has fewer
    double distance_mm[2];   ///< of the point, along each optical axis
    double pixel_px[2][2];   ///< where each camera sees it
    double baseline_mm;
    double depth_per_px_mm;  ///< depth that one px of disparity makes, in the frames: Z^2 / (F B)
};

/// The field around a point of the instrument's frame, in `frames` (NULL: of the whole sensors, as
/// for the functions below). ERROR_RANGE: the point is not in front of
/// both cameras.
int zoom_field_at(const struct zoom_calibration *calibration, const struct zoom_frames *frames,
                  const struct zoom_state *state, const double point_mm[3],
                  struct zoom_field *field);

/// Part of the width of a whole image at the point's distance that the field has, of the camera
/// with the narrower view: 1 if both see the point in their middle, 0 if one does not see it.
double zoom_field_centred(const struct zoom_calibration *calibration,
                          const struct zoom_frames *frames, const struct zoom_state *state,
                          const struct zoom_field *field);

enum zoom_wish_kind {
    ZOOM_WISH_DENSITY,  ///< px per mm^2, of each camera: at least
    ZOOM_WISH_WIDTH,    ///< mm that both cameras see: at least
    ZOOM_WISH_FACTOR,   ///< times the smallest calibrated focal length of each camera
};
struct zoom_wish {
    enum zoom_wish_kind kind;
    double value;
};

/// Sets zoom and focus of both sides of `state` so that they meet a wish at a point, focused there;
/// pan stays. Zooms are whole counts. ERROR_RANGE: the wish is beyond what the calibrated zooms
/// reach (`*reach`: what they do reach, in the wish's unit; 0 to 0 if a camera does not see the
/// point at any zoom), or the lenses do not focus so near (`*reach` has min > max). `state` is
/// unchanged on error.
int zoom_for_wish(const struct zoom_calibration *calibration, const struct zoom_frames *frames,
                  const struct zoom_wish *wish, const double point_mm[3], struct zoom_state *state,
                  struct zoom_range *reach);

/// Sets the focus of both sides for objects at a point, within the calibrated range. ERROR_RANGE:
/// the focus would lie outside by more than four standard deviations of the motors; it is set to
/// the end of the range then.
int zoom_focus_at(const struct zoom_calibration *calibration, const double point_mm[3],
                  struct zoom_state *state);

#ifdef __cplusplus
}
#endif

#endif
