// SPDX-License-Identifier: Apache-2.0
#include "rig/auto/focus_frame.h"

#include "core/invariant.h"

enum {
    SENSOR_BITS = 10,
    UNITY_Q3 = 8,
    // The noise of the MT9T001 at gain 1, from its full well (8500 electrons in 981 steps of 10
    // bits) and read noise (8 electrons).
    SHOT_Q16 = 7560,
    READ_Q8 = 240,
};

static enum focus_plane plane_of(const struct raw_image *image) {
    return image->layout == RAW_BAYER_GRBG ? FOCUS_GREEN
           : image->layout == RAW_RGB      ? FOCUS_RGB_GREEN
                                           : FOCUS_GREY;
}

struct focus_sample focus_frame_measure(const struct rig_region_frame *frame,
                                        enum focus_measure measure, bool gain_is_factor) {
    const struct raw_image *image = &frame->image;
    INVARIANT(image->data != NULL && image->bits >= 8 && image->bits <= FOCUS_VALUE_BITS);
    const struct focus_window window = {
        .values = image->data,
        .stride = (size_t)image->stride,
        .width_px = (uint16_t)image->width_px,
        .height_px = (uint16_t)image->height_px,
        .saturated = (uint16_t)((1u << image->bits) - 1),
    };
    const int fewer_bits = image->bits < SENSOR_BITS ? SENSOR_BITS - image->bits : 0;
    const struct focus_noise unity = {frame->black, READ_Q8 >> 2 * fewer_bits,
                                      SHOT_Q16 >> fewer_bits};
    const bool known = gain_is_factor && frame->gain_q3 > 0;
    const struct focus_noise noise = focus_noise_at(&unity, known ? frame->gain_q3 : UNITY_Q3);
    return focus_sample_of(&window, plane_of(image), measure, &noise);
}
