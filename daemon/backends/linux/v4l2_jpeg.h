// SPDX-License-Identifier: Apache-2.0
/// Frames of webcams that give JPEG only. Needs libjpeg; where it was not built in, nothing decodes
/// and no camera is asked for such frames.
#ifndef VERGENCE_DAEMON_BACKENDS_LINUX_V4L2_JPEG_H
#define VERGENCE_DAEMON_BACKENDS_LINUX_V4L2_JPEG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Whether the program was built with libjpeg.
bool v4l2_jpeg_available(void);

/// Decodes into `values` (3 * width_px * height_px). False when it is no JPEG of this size, or was
/// damaged; the rows that could not be decoded are undefined or 0 then. What cameras add or leave
/// out without harm is no damage: a little padding in front of a marker, anything behind the end,
/// and the usual Huffman tables.
bool v4l2_jpeg_decode(const uint8_t *data, size_t bytes, uint16_t width_px, uint16_t height_px,
                      uint16_t *values);

#ifdef __cplusplus
}
#endif

#endif
