// SPDX-License-Identifier: Apache-2.0
/// Whether two frames of one camera show the same scene, as far as their noise allows.
#ifndef VERGENCE_STEREO_IMAGE_IMAGE_CHANGE_H
#define VERGENCE_STEREO_IMAGE_IMAGE_CHANGE_H

#include "core/raw_image.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Parts per thousand of the picture whose squares of 4 x 4 values differ in their sums by more
/// than five times the noise of the difference, which sensor_noise.h assumes.
/// `gain_q3`: of the sensor; 0: not known. Both images have the same size and layout.
uint32_t image_change_permille(const struct raw_image *before, const struct raw_image *after,
                               uint16_t gain_q3);

#ifdef __cplusplus
}
#endif

#endif
