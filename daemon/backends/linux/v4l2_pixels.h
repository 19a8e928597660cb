// SPDX-License-Identifier: Apache-2.0
/// Converts a V4L2 buffer to the values of a frame.
///
/// Frames are copied once, here, or converted in the driver's memory if they fit into it. It may
/// contain bits above those of the format: afterwards no value exceeds 2^bits - 1.
#ifndef VERGENCE_DAEMON_BACKENDS_LINUX_V4L2_PIXELS_H
#define VERGENCE_DAEMON_BACKENDS_LINUX_V4L2_PIXELS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "hal/camera.h"

#ifdef __cplusplus
extern "C" {
#endif

/// How a V4L2 format maps to a frame.
struct v4l2_pixels {
    uint32_t fourcc;
    const char *name;  ///< conventional name
    enum raw_layout layout;
    uint8_t bits;
    uint8_t bytes_per_pixel;  ///< 0: compressed
};

/// Contents of a driver's buffer.
struct v4l2_pixels_source {
    const uint8_t *data;
    size_t bytes;             ///< filled bytes
    uint32_t bytes_per_line;  ///< stride from row to row
    uint16_t width_px, height_px;
    bool full_range;  ///< YUYV: Y from 0 to 255, not 16 to 235
};

/// Supported formats, best first; NULL after the last. MJPEG is last, and only present if built
/// with libjpeg.
const struct v4l2_pixels *v4l2_pixels_format(unsigned index);

/// Values per row (three per pixel for RGB).
size_t v4l2_pixels_row_values(const struct v4l2_pixels *format, uint16_t width_px);

/// Bytes read per row; 0 for compressed formats. YUYV stores colour for two pixels, also at the end
/// of an odd row.
size_t v4l2_pixels_row_bytes(const struct v4l2_pixels *format, uint32_t width_px);

/// Whether the values take the place of the bytes that they are made from.
bool v4l2_pixels_fit(const struct v4l2_pixels *format, const struct v4l2_pixels_source *layout);

/// Fills `values` (height_px rows of `v4l2_pixels_row_values`, `stride` values from one to the
/// next) and returns faults as in hal_camera_frame: HAL_CAMERA_SHORT if bytes are missing
/// (incomplete rows are 0), HAL_CAMERA_DAMAGED if decoding failed. YUYV is converted by BT.601,
/// which webcams use. Where they fit, `values` may be the source's data. Compressed formats have
/// rows without gaps.
uint32_t v4l2_pixels_convert(const struct v4l2_pixels *format,
                             const struct v4l2_pixels_source *source, uint16_t *values,
                             ptrdiff_t stride);

#ifdef __cplusplus
}
#endif

#endif
