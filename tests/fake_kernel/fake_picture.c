// SPDX-License-Identifier: Apache-2.0
#include "fake_picture.h"

#include <linux/videodev2.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct picture {
    unsigned width_px, height_px, maximum;
    int channels;  // 0: the file unchanged
    size_t bytes;
    uint8_t *data;
};

static void stop(const char *path, const char *why) {
    fprintf(stderr, "fake kernel: picture %s: %s\n", path, why);
    abort();
}

/// Reads the picture of the frame `sequence`: a file of several equal ones, one behind the other as
/// Netpbm allows, is a loop.
static struct picture load(const char *path, int plain, uint32_t sequence) {
    struct picture picture = {.channels = 0};
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        stop(path, "cannot be opened");
    }
    if (!plain) {
        char kind = '0';
        if (fscanf(file, "P%c %u %u %u", &kind, &picture.width_px, &picture.height_px,
                   &picture.maximum) != 4 ||
            (kind != '5' && kind != '6') || fgetc(file) == EOF) {
            stop(path, "not a binary PGM or PPM without comments");
        }
        picture.channels = kind == '6' ? 3 : 1;
    }
    const long begin = ftell(file);
    const long end = fseek(file, 0, SEEK_END) == 0 ? ftell(file) : -1;
    if (begin < 0 || end <= begin) {
        stop(path, "not a file with pixels");
    }
    const long pixels = (long)picture.width_px * (long)picture.height_px;
    const long one = begin + pixels * picture.channels * (picture.maximum > 255 ? 2 : 1);
    const long pictures = plain || end < one ? 1 : end / one;
    const long first = pictures == 1 ? 0 : (long)sequence % pictures * one;
    if (fseek(file, first + begin, SEEK_SET) != 0) {
        stop(path, "not a file with pixels");
    }
    picture.bytes = (size_t)(pictures == 1 ? end - begin : one - begin);
    picture.data = malloc(picture.bytes);
    if (picture.data == NULL || fread(picture.data, 1, picture.bytes, file) != picture.bytes) {
        stop(path, "cannot be read");
    }
    fclose(file);
    return picture;
}

void fake_picture_size(const char *path, uint32_t *width_px, uint32_t *height_px) {
    const struct picture picture = load(path, 0, 0);
    *width_px = picture.width_px;
    *height_px = picture.height_px;
    free(picture.data);
}

static uint8_t byte_of(int value) {
    return (uint8_t)(value < 0 ? 0 : value > 255 ? 255 : value);
}

/// Converts by BT.601, Y from 16 to 235; a pair's colour is the mean of its two pixels.
static void yuyv_of(const uint8_t *rgb, size_t pixels, uint8_t *data) {
    for (size_t i = 0; i + 1 < pixels; i += 2) {
        const uint8_t *a = rgb + 3 * i, *b = a + 3;
        const int red = a[0] + b[0], green = a[1] + b[1], blue = a[2] + b[2];
        data[2 * i] = byte_of(16 + (66 * a[0] + 129 * a[1] + 25 * a[2] + 128) / 256);
        data[2 * i + 1] = byte_of(128 + (-38 * red - 74 * green + 112 * blue) / 512);
        data[2 * i + 2] = byte_of(16 + (66 * b[0] + 129 * b[1] + 25 * b[2] + 128) / 256);
        data[2 * i + 3] = byte_of(128 + (112 * red - 94 * green - 18 * blue) / 512);
    }
}

static void words_of(const struct picture *picture, size_t pixels, uint8_t *data) {
    for (size_t i = 0; i < pixels; i++) {
        const uint8_t *from = picture->data + 2 * i;
        data[2 * i] = from[1];
        data[2 * i + 1] = from[0];
    }
}

void fake_picture_paint(const char *path, uint32_t fourcc, uint32_t width_px, uint32_t height_px,
                        uint32_t sequence, uint8_t *data, size_t *bytes) {
    const int plain = fourcc == V4L2_PIX_FMT_MJPEG;
    struct picture picture = load(path, plain, sequence);
    const size_t pixels = (size_t)width_px * height_px;
    if (!plain && (picture.width_px != width_px || picture.height_px != height_px)) {
        stop(path, "is of another size than the camera's frames");
    }
    const int deep = picture.maximum > 255;
    const size_t needed = plain ? 0 : pixels * (size_t)(picture.channels << deep);
    if (picture.bytes < needed) {
        stop(path, "is too short");
    }
    if (plain) {
        *bytes = picture.bytes < *bytes ? picture.bytes : *bytes;
        memcpy(data, picture.data, *bytes);
    } else if (fourcc == V4L2_PIX_FMT_YUYV && picture.channels == 3 && !deep) {
        yuyv_of(picture.data, pixels, data);
    } else if (fourcc == V4L2_PIX_FMT_GREY && picture.channels == 1 && !deep) {
        memcpy(data, picture.data, pixels);
    } else if (fourcc == V4L2_PIX_FMT_SGRBG10 && picture.channels == 1 && deep) {
        words_of(&picture, pixels, data);
    } else {
        stop(path, "does not go with the camera's format");
    }
    free(picture.data);
}

void fake_picture_expose(uint32_t fourcc, double light, uint8_t *data, size_t bytes) {
    // As webcams do, for a screen's curve.
    const double factor = sqrt(light);
    const int black = fourcc == V4L2_PIX_FMT_YUYV ? 16 : 0;
    const int white = fourcc == V4L2_PIX_FMT_YUYV ? 235 : 255;
    for (size_t i = 0; i < bytes; i++) {
        const int zero = fourcc == V4L2_PIX_FMT_YUYV && i % 2 == 1 ? 128 : black;
        const double value = zero + (data[i] - zero) * factor;
        data[i] = (uint8_t)(value < black ? black : value > white ? white : value + 0.5);
    }
}
