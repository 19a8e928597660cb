// SPDX-License-Identifier: Apache-2.0
/// Where a point of the left picture of a pair may be in the right one, as uncertain as the views
/// are.
#ifndef VERGENCE_STEREO_ZOOM_ADJUST_EXPECT_H
#define VERGENCE_STEREO_ZOOM_ADJUST_EXPECT_H

#include "stereo/image/image.h"
#include "stereo/zoom/adjustment.h"
#include "stereo/zoom/sparse_match.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { ADJUST_TERMS = 2 * VIEW_TERMS };

/// A pair of grey pictures, the part of the sensor that they show, and where the motors were.
struct adjust_picture {
    struct image_u8 grey[2];
    struct calibration_window window[2];
    struct zoom_state axes;
    int state;  // its number in a adjustment-calibration: 0 if it is the only one
    double depth_near_mm, depth_far_mm;  // range of depths in a scene; far may be INFINITY
};

/// Between pixels of a picture and of the sensor.
void adjust_to_sensor(const struct calibration_window *window, double px[2]);
void adjust_from_sensor(const struct calibration_window *window, double px[2]);

struct adjust_expectation {
    const struct adjust_picture *picture;
    const struct adjustment *adjustment;
    double across_px;  // added to what the uncertainty asks for
};

/// Calls the one who watches the adjustment: a serve of sparse_match.
void adjust_expect_serve(void *context);

/// `expectation` is a struct adjust_expectation.
bool adjust_expect(void *expectation, const double left_px[2], struct sparse_region *region);

#ifdef __cplusplus
}
#endif

#endif
