// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/linux/v4l2_jpeg.h"

#include <string.h>

#ifdef VERGENCE_HAS_JPEG

#include <setjmp.h>
#include <stdio.h>
// libjpeg's headers require the two above.
#include <jerror.h>
#include <jpeglib.h>

/// Webcams write up to ten bytes of padding before a marker (Logitech C270), or pad to a word. Lost
/// synchronisation leaves more: of 800 flipped bits in an image of 512 x 480, 128 left bytes over,
/// and only one of them fewer than 17.
enum { PADDING_MAX_BYTES = 16 };

bool v4l2_jpeg_available(void) {
    return true;
}

struct escape {
    struct jpeg_error_mgr manager;
    jmp_buf place;
    bool damaged;
};

static void give_up(j_common_ptr info) {
    // The manager is the first member, so both have the same address.
    struct escape *escape = (struct escape *)(void *)info->err;
    longjmp(escape->place, 1);
}

/// Warnings have levels below 0; all of them mean wrong pixels, except those that cameras cause
/// harmlessly. The caller counts damaged frames, so they are not logged one by one.
static void record_warning(j_common_ptr info, int level) {
    struct escape *escape = (struct escape *)(void *)info->err;
    const struct jpeg_error_mgr *error = info->err;
    const bool padding =
        error->msg_code == JWRN_EXTRANEOUS_DATA && error->msg_parm.i[0] <= PADDING_MAX_BYTES;
    if (level < 0 && !padding && error->msg_code != JWRN_JFIF_MAJOR) {
        escape->damaged = true;
    }
}

/// Widens a row of bytes to 16 bits in place, from the end.
static void widen(uint16_t *row, size_t values) {
    const uint8_t *bytes = (const uint8_t *)row;
    for (size_t i = values; i-- > 0;) {
        const uint8_t value = bytes[i];
        row[i] = value;
    }
}

static bool decode(struct jpeg_decompress_struct *info, uint16_t width_px, uint16_t height_px,
                   uint16_t *values) {
    if (jpeg_read_header(info, TRUE) != JPEG_HEADER_OK || info->image_width != width_px ||
        info->image_height != height_px) {
        return false;
    }
    info->out_color_space = JCS_RGB;
    info->dct_method = JDCT_ISLOW;
    jpeg_start_decompress(info);
    const size_t row_values = 3 * (size_t)width_px;
    while (info->output_scanline < info->output_height) {
        uint16_t *row = values + info->output_scanline * row_values;
        JSAMPROW bytes = (JSAMPROW)row;
        if (jpeg_read_scanlines(info, &bytes, 1) != 1) {
            return false;
        }
        widen(row, row_values);
    }
    jpeg_finish_decompress(info);
    return true;
}

bool v4l2_jpeg_decode(const uint8_t *data, size_t bytes, uint16_t width_px, uint16_t height_px,
                      uint16_t *values) {
    struct jpeg_decompress_struct info;
    struct escape escape;
    memset(&info, 0, sizeof info);
    memset(values, 0, 3 * (size_t)width_px * height_px * sizeof *values);
    if (bytes == 0) {
        return false;
    }
    info.err = jpeg_std_error(&escape.manager);
    escape.manager.error_exit = give_up;
    escape.manager.emit_message = record_warning;
    escape.damaged = false;
    if (setjmp(escape.place) != 0) {
        jpeg_destroy_decompress(&info);
        return false;
    }
    jpeg_create_decompress(&info);
    jpeg_mem_src(&info, data, (unsigned long)bytes);
    const bool good = decode(&info, width_px, height_px, values) && !escape.damaged;
    jpeg_destroy_decompress(&info);
    return good;
}

#else

bool v4l2_jpeg_available(void) {
    return false;
}

bool v4l2_jpeg_decode(const uint8_t *data, size_t bytes, uint16_t width_px, uint16_t height_px,
                      uint16_t *values) {
    (void)data;
    (void)bytes;
    memset(values, 0, 3 * (size_t)width_px * height_px * sizeof *values);
    return false;
}

#endif
