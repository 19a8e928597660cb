// SPDX-License-Identifier: Apache-2.0
/// Image views: they describe where pixels are, and do not own them. Pixel (0,0) is the centre of
/// the top-left pixel; x grows to the right, y down. `stride` counts elements of the view's type
/// (not bytes) from one row to the next. Where memory is short a view has a ring of rows: row y is
/// in slot y % ring_rows, and what is there depends on who fills it; 0 where all rows are there.
#ifndef VERGENCE_STEREO_IMAGE_IMAGE_H
#define VERGENCE_STEREO_IMAGE_IMAGE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// Initializers of whole views may leave ring_rows out: it is 0 then.
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"

/// Largest width and height that the core accepts, in pixels.
enum { IMAGE_MAX_SIDE_PX = 4096 };

struct image_u8 {
    uint8_t *data;
    int width, height;
    ptrdiff_t stride;
    int ring_rows;
};

struct image_u16 {
    uint16_t *data;
    int width, height;
    ptrdiff_t stride;
};

struct image_i32 {
    int32_t *data;
    int width, height;
    ptrdiff_t stride;
};

/// Interleaved red, green, blue; `stride` counts bytes (3 per pixel).
struct image_rgb8 {
    uint8_t *data;
    int width, height;
    ptrdiff_t stride;
    int ring_rows;
};

/// First element of row y, 0 <= y < height.
/*@ requires \valid_read(image) && -INT32_MAX <= image->stride <= INT32_MAX;
    requires image->ring_rows == 0;
    assigns \nothing;
    ensures \result == image->data + y * image->stride; */
static inline uint8_t *image_u8_row(const struct image_u8 *image, int y) {
    const int slot = image->ring_rows == 0 ? y : y % image->ring_rows;
    return image->data + (ptrdiff_t)slot * image->stride;
}

static inline uint16_t *image_u16_row(const struct image_u16 *image, int y) {
    return image->data + (ptrdiff_t)y * image->stride;
}

/*@ requires \valid_read(image) && -INT32_MAX <= image->stride <= INT32_MAX;
    assigns \nothing;
    ensures \result == image->data + y * image->stride; */
static inline int32_t *image_i32_row(const struct image_i32 *image, int y) {
    return image->data + (ptrdiff_t)y * image->stride;
}

static inline uint8_t *image_rgb8_row(const struct image_rgb8 *image, int y) {
    const int slot = image->ring_rows == 0 ? y : y % image->ring_rows;
    return image->data + (ptrdiff_t)slot * image->stride;
}

#endif
