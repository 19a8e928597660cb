// SPDX-License-Identifier: Apache-2.0
#include "rig/auto/focus_frame.h"

#include "core/invariant.h"

static enum focus_plane plane_of(const struct raw_image *image) {
    if (image->layout == RAW_BAYER_GRBG) {
        return FOCUS_GREEN;
    }
    return image->layout == RAW_RGB ? FOCUS_RGB_GREEN : FOCUS_GREY;
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
    const struct focus_noise noise = rig_region_noise(frame, gain_is_factor);
    return focus_sample_of(&window, plane_of(image), measure, &noise);
}
