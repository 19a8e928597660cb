// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/linux/v4l2_pixels.h"

#include <linux/videodev2.h>
#include <string.h>

#include "core/invariant.h"
#include "core/math.h"
#include "daemon/backends/linux/v4l2_jpeg.h"

// Raw mosaics and grey before colours interpolated from fewer samples; compressed formats last.
static const struct v4l2_pixels formats[] = {
    {V4L2_PIX_FMT_SGRBG10, "SGRBG10", RAW_BAYER_GRBG, 10, 2},
    {V4L2_PIX_FMT_SGRBG8, "SGRBG8", RAW_BAYER_GRBG, 8, 1},
    {V4L2_PIX_FMT_GREY, "GREY", RAW_GREY, 8, 1},
    {V4L2_PIX_FMT_YUYV, "YUYV", RAW_RGB, 8, 2},
    {V4L2_PIX_FMT_MJPEG, "MJPEG", RAW_RGB, 8, 0},
};

const struct v4l2_pixels *v4l2_pixels_format(unsigned index) {
    const unsigned count = sizeof formats / sizeof formats[0];
    const unsigned usable = v4l2_jpeg_available() ? count : count - 1;
    return index < usable ? &formats[index] : NULL;
}

size_t v4l2_pixels_row_values(const struct v4l2_pixels *format, uint16_t width_px) {
    return (size_t)width_px * (format->layout == RAW_RGB ? 3 : 1);
}

size_t v4l2_pixels_row_bytes(const struct v4l2_pixels *format, uint32_t width_px) {
    const size_t pixels =
        format->fourcc == V4L2_PIX_FMT_YUYV ? (size_t)width_px + width_px % 2 : width_px;
    return pixels * format->bytes_per_pixel;
}

static void row_of_words(const uint8_t *from, uint16_t *to, size_t values, unsigned bits) {
    const unsigned mask = (1U << bits) - 1;
    for (size_t i = 0; i < values; i++) {
        to[i] = (uint16_t)((from[2 * i] | (unsigned)from[2 * i + 1] << 8) & mask);
    }
}

static void row_of_bytes(const uint8_t *from, uint16_t *to, size_t values) {
    for (size_t i = 0; i < values; i++) {
        to[i] = from[i];
    }
}

static uint16_t clamp_byte(int value_q8) {
    return (uint16_t)math_clamp_int((value_q8 + 128) >> 8, 0, 255);
}

/// Weights in 1/256: of Y, and of the colour differences in red, green and blue.
struct weights {
    int black, y, red_v, green_u, green_v, blue_u;
};

static void pixel_of_yuv(const struct weights *w, int y, int u, int v, uint16_t rgb[3]) {
    const int grey = w->y * (y - w->black);
    rgb[0] = clamp_byte(grey + w->red_v * (v - 128));
    rgb[1] = clamp_byte(grey - w->green_u * (u - 128) - w->green_v * (v - 128));
    rgb[2] = clamp_byte(grey + w->blue_u * (u - 128));
}

static void row_of_yuyv(const uint8_t *from, uint16_t *to, uint16_t width_px, bool full_range) {
    static const struct weights limited = {16, 298, 409, 100, 208, 516};
    static const struct weights full = {0, 256, 359, 88, 183, 454};
    const struct weights *w = full_range ? &full : &limited;
    for (unsigned x = 0; x < width_px; x++) {
        const uint8_t *pair = from + 4 * (x / 2);
        pixel_of_yuv(w, pair[2 * (x % 2)], pair[1], pair[3], to + 3 * (size_t)x);
    }
}

static void convert_row(const struct v4l2_pixels *format, const struct v4l2_pixels_source *source,
                        const uint8_t *from, uint16_t *to) {
    switch (format->fourcc) {
        case V4L2_PIX_FMT_SGRBG10:
            row_of_words(from, to, source->width_px, format->bits);
            break;
        case V4L2_PIX_FMT_YUYV:
            row_of_yuyv(from, to, source->width_px, source->full_range);
            break;
        default:
            INVARIANT(format->bytes_per_pixel == 1);
            row_of_bytes(from, to, source->width_px);
            break;
    }
}

bool v4l2_pixels_fit(const struct v4l2_pixels *format, const struct v4l2_pixels_source *layout) {
    return format->fourcc == V4L2_PIX_FMT_SGRBG10 && layout->bytes_per_line % sizeof(uint16_t) == 0;
}

uint32_t v4l2_pixels_convert(const struct v4l2_pixels *format,
                             const struct v4l2_pixels_source *source, uint16_t *values,
                             ptrdiff_t stride) {
    const size_t row_values = v4l2_pixels_row_values(format, source->width_px);
    INVARIANT(stride >= (ptrdiff_t)row_values);
    if (format->bytes_per_pixel == 0) {
        INVARIANT(stride == (ptrdiff_t)row_values);
        return v4l2_jpeg_decode(source->data, source->bytes, source->width_px, source->height_px,
                                values)
                   ? 0
                   : HAL_CAMERA_DAMAGED;
    }
    const size_t row_bytes = v4l2_pixels_row_bytes(format, source->width_px);
    INVARIANT(source->bytes_per_line >= row_bytes);
    uint32_t faults = 0;
    for (size_t y = 0; y < source->height_px; y++) {
        const size_t at = y * source->bytes_per_line;
        uint16_t *row = values + (ptrdiff_t)y * stride;
        if (at + row_bytes <= source->bytes) {
            convert_row(format, source, source->data + at, row);
        } else {
            memset(row, 0, row_values * sizeof *row);
            faults = HAL_CAMERA_SHORT;
        }
    }
    return faults;
}
