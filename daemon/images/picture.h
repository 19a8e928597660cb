// SPDX-License-Identifier: Apache-2.0
/// Frames as 8 bit images for people, and those as PNG files.
#ifndef VERGENCE_DAEMON_IMAGES_PICTURE_H
#define VERGENCE_DAEMON_IMAGES_PICTURE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "stereo/develop.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { PICTURE_HEAD_BYTES = 64, PICTURE_COLOURS = 256 };

/// 8 bits a value.
struct picture {
    uint8_t *pixels;
    int width_px, height_px;
    int channels;      ///< 1: grey; 3: red, green, blue
    size_t row_bytes;  ///< distance from one row to the next
    const char *text;  ///< comment: printable ASCII and line feeds; NULL: none
    /// Red, green and blue of each value of a picture of one channel; NULL: grey.
    const uint8_t (*palette)[3];
};

/// Develops the image as a reconstruction does, into `picture`, whose channels are set and whose
/// size is the image's size divided by `shrink`, rounded down. One pixel is the mean of `shrink` x
/// `shrink` pixels. ERROR_ARGUMENT: less than 8 bits, or too small; ERROR_MEMORY.
int picture_develop(const struct raw_image *raw, const struct develop_balance *balance, int shrink,
                    struct picture *picture);

/// Develops two images of one size side by side, with the white balance of the left one, into a
/// picture whose pixels the caller frees: with 3 channels if `colour` and they have any, else 1.
/// Errors as above, without pixels.
int picture_develop_pair(const struct raw_image *left, const struct raw_image *right, int shrink,
                         bool colour, struct picture *picture);

/// The left (`side` 0) or right half of a picture, in its memory.
struct picture picture_half(const struct picture *picture, unsigned side);

/// Encodes the picture as a PNG file: returns its bytes, which the caller frees, and their number;
/// NULL if out of memory.
uint8_t *picture_png(const struct picture *picture, size_t *bytes);

/// Whether a file that begins with these bytes (PICTURE_HEAD_BYTES, or all of it) was made by
/// picture_png.
bool picture_png_is_ours(const uint8_t *head, size_t bytes);

#ifdef __cplusplus
}
#endif

#endif
