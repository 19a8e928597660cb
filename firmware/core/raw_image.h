// SPDX-License-Identifier: Apache-2.0
/// One image as a camera or a file delivers it: the form in which it goes from there to the
/// matcher.
#ifndef VERGENCE_CORE_RAW_IMAGE_H
#define VERGENCE_CORE_RAW_IMAGE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum raw_layout {
    RAW_GREY,        ///< one value per pixel
    RAW_RGB,         ///< three values per pixel, interleaved
    RAW_BAYER_GRBG,  ///< one value per pixel, linear; even rows G R, odd rows B G
};

/// Pixel (0,0) is the centre of the top-left pixel. A copy of the struct refers to the same pixels;
/// of all copies, the one that was handed over is released, once.
struct raw_image {
    const uint16_t *data;  ///< NULL: none
    int width_px, height_px;
    ptrdiff_t stride;  ///< values from one row to the next
    int bits;          ///< 8 .. 16: values are 0 .. 2^bits - 1
    enum raw_layout layout;
    /// Frees the pixels, from any thread. NULL: they belong to someone else, who keeps them longer
    /// than the image is used.
    void (*release)(void *owner);
    void *owner;
};

/// Values in a row, without a gap after it.
static inline size_t raw_image_row_values(const struct raw_image *image) {
    return (size_t)image->width_px * (image->layout == RAW_RGB ? 3 : 1);
}

/// First value of row y, 0 <= y < height_px.
static inline const uint16_t *raw_image_row(const struct raw_image *image, int y) {
    return image->data + (ptrdiff_t)y * image->stride;
}

/// Frees the pixels if the image owns them; it has none afterwards. Allowed without pixels.
static inline void raw_image_release(struct raw_image *image) {
    if (image->release != NULL) {
        image->release(image->owner);
    }
    image->data = NULL;
    image->release = NULL;
    image->owner = NULL;
}

#ifdef __cplusplus
}
#endif

#endif
