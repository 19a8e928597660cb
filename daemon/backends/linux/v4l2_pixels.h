// SPDX-License-Identifier: Apache-2.0
/// From the bytes of a V4L2 buffer to the values of a hal_camera_frame.
///
/// Frames are copied, not lent from the driver's memory: that memory is often uncached, goes away
/// when a stream is restarted, and may hold bits above those of the format. So the driver has its
/// buffer back at once, and a value is never above 2^bits - 1.
#ifndef VERGENCE_DAEMON_BACKENDS_LINUX_V4L2_PIXELS_H
#define VERGENCE_DAEMON_BACKENDS_LINUX_V4L2_PIXELS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "hal/camera.h"

#ifdef __cplusplus
extern "C" {
#endif

/// How a format of V4L2 becomes a frame.
struct v4l2_pixels {
    uint32_t fourcc;
    const char *name;  ///< as people write it
    enum hal_camera_layout layout;
    uint8_t bits;
    uint8_t bytes_per_pixel;  ///< 0: compressed
};

/// What a driver's buffer holds.
struct v4l2_pixels_source {
    const uint8_t *data;
    size_t bytes;             ///< that are filled
    uint32_t bytes_per_line;  ///< from one row to the next
    uint16_t width_px, height_px;
    bool full_range;  ///< YUYV: Y from 0 to 255, not 16 to 235
};

/// The formats that we take, the best first; NULL after the last. MJPEG is the last, and there only
/// when the program was built with libjpeg.
const struct v4l2_pixels *v4l2_pixels_format(unsigned index);

/// Values in one row: of RGB three a pixel.
size_t v4l2_pixels_row_values(const struct v4l2_pixels *format, uint16_t width_px);

/// Bytes of a row that are read; 0 where it is compressed. YUYV has its colours for two pixels at a
/// time, also at the end of an odd row.
size_t v4l2_pixels_row_bytes(const struct v4l2_pixels *format, uint32_t width_px);

/// Fills `values` (height_px rows of `v4l2_pixels_row_values`, without gaps) and returns faults as
/// in hal_camera_frame: HAL_CAMERA_SHORT when bytes are missing (rows that are not whole are 0),
/// HAL_CAMERA_DAMAGED when it did not decode.
/// Colours of YUYV are those of BT.601, what webcams have.
uint32_t v4l2_pixels_convert(const struct v4l2_pixels *format,
                             const struct v4l2_pixels_source *source, uint16_t *values);

#ifdef __cplusplus
}
#endif

#endif
