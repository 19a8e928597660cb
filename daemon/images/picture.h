// SPDX-License-Identifier: Apache-2.0
/// Frames as pictures that a person can look at, and those as PNG files.
#ifndef VERGENCE_DAEMON_IMAGES_PICTURE_H
#define VERGENCE_DAEMON_IMAGES_PICTURE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "rig/pair.h"
#include "stereo/develop.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { PICTURE_HEAD_BYTES = 64 };

/// 8 bits a value.
struct picture {
    uint8_t *pixels;
    int width_px, height_px;
    int channels;      ///< 1: grey; 3: red, green, blue
    size_t row_bytes;  ///< from one row to the next
    const char *text;  ///< about it: printable ASCII and line feeds; NULL: none
};

/// A frame as the pipeline takes it; points to the same pixels.
struct reconstruct_image picture_raw(const struct pair_frame *frame);

/// Makes the picture of a frame, developed as for a reconstruction: into `picture`, whose channels
/// are set, and whose size is that of the frame divided by `shrink`, rounded down. The mean of
/// `shrink` x `shrink` pixels becomes one. ERROR_ARGUMENT: of less than 8 bits, or too small;
/// ERROR_MEMORY.
int picture_develop(const struct pair_frame *frame, const struct develop_balance *balance,
                    int shrink, struct picture *picture);

/// The picture as a PNG file: its bytes, which the caller frees, and their number; NULL when there
/// is no memory. Made without any library, for boards that have none: Paeth's filter in all rows,
/// one Huffman code for what remains. Of photographs this leaves about what zlib does. Sources:
/// W3C, "Portable Network Graphics", second edition; RFC 1950, RFC 1951.
uint8_t *picture_png(const struct picture *picture, size_t *bytes);

/// Whether a file that begins so (PICTURE_HEAD_BYTES, or all that it has) was made by picture_png.
bool picture_png_is_ours(const uint8_t *head, size_t bytes);

#ifdef __cplusplus
}
#endif

#endif
