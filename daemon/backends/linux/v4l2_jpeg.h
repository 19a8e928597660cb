// SPDX-License-Identifier: Apache-2.0
/// Decodes the frames of webcams that only deliver JPEG. Requires libjpeg; without it nothing is
/// decoded and cameras are not asked for such frames.
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

/// Decodes into `values` (3 * width_px * height_px). False if it is not a JPEG of this size or is
/// damaged; rows that were not decoded are then undefined or 0. Harmless deviations of cameras are
/// accepted: a little padding before a marker, data after the end, and missing standard Huffman
/// tables.
bool v4l2_jpeg_decode(const uint8_t *data, size_t bytes, uint16_t width_px, uint16_t height_px,
                      uint16_t *values);

#ifdef __cplusplus
}
#endif

#endif
