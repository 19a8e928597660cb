// SPDX-License-Identifier: Apache-2.0
/// Fits a calibration to frames of a part of the sensor.
#ifndef VERGENCE_CONSOLE_PAIR_CALIBRATION_FIT_H
#define VERGENCE_CONSOLE_PAIR_CALIBRATION_FIT_H

#include "rig/pair_frame.h"
#include "stereo/geometry/calibration.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Cuts the lens of a whole sensor to a window of it. Pixels are read in pairs (a colour sensor's),
/// so with a skip the frame's pixels are not evenly spaced; the mean position of the two is used.
struct lens calibration_fit_lens(const struct lens *lens, const struct pair_window *window,
                                 int width_px, int height_px);

enum calibration_fit {
    CALIBRATION_FITS,
    CALIBRATION_CUT,    ///< it was of the whole sensor
    CALIBRATION_OTHER,  ///< it is for images of another size
};

/// Fits one camera's part of a calibration to its frame.
enum calibration_fit calibration_fit_side(struct calibration *calibration, int side,
                                          const struct pair_frame *frame);

#ifdef __cplusplus
}
#endif

#endif
