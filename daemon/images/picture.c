// SPDX-License-Identifier: Apache-2.0
#include "daemon/images/picture.h"

#include <stdlib.h>

#include "core/arena.h"
#include "core/error.h"
#include "core/invariant.h"

/// Means over squares of `from`, whose pixels have the picture's channels.
static void shrink_into(const uint8_t *from, size_t from_row_bytes, int shrink,
                        struct picture *picture) {
    const size_t channels = (size_t)picture->channels;
    const uint32_t area = (uint32_t)(shrink * shrink);
    for (int y = 0; y < picture->height_px; y++) {
        uint8_t *out = picture->pixels + (size_t)y * picture->row_bytes;
        const uint8_t *top = from + (size_t)y * (size_t)shrink * from_row_bytes;
        for (size_t i = 0; i < (size_t)picture->width_px * channels; i++) {
            const uint8_t *corner = top + i / channels * (size_t)shrink * channels + i % channels;
            uint32_t sum = area / 2;
            for (int row = 0; row < shrink; row++) {
                for (int column = 0; column < shrink; column++) {
                    sum += corner[(size_t)row * from_row_bytes + (size_t)column * channels];
                }
            }
            out[i] = (uint8_t)(sum / area);
        }
    }
}

/// What is wanted goes to its place if nothing else is to be done with it.
static void place(const struct picture *picture, struct image_u8 *grey, struct image_rgb8 *colour) {
    uint8_t **data = picture->channels == 1 ? &grey->data : &colour->data;
    ptrdiff_t *stride = picture->channels == 1 ? &grey->stride : &colour->stride;
    *data = picture->pixels;
    *stride = (ptrdiff_t)picture->row_bytes;
}

int picture_develop(const struct raw_image *raw, const struct develop_balance *balance, int shrink,
                    struct picture *picture) {
    const size_t pixels = (size_t)raw->width_px * (size_t)raw->height_px;
    INVARIANT(shrink >= 1 && (picture->channels == 1 || picture->channels == 3));
    INVARIANT(picture->width_px == raw->width_px / shrink);
    INVARIANT(picture->height_px == raw->height_px / shrink);
    if (raw->bits < 8 || raw->bits > 16) {
        return ERROR_ARGUMENT;
    }
    const size_t need = develop_need_bytes(raw->width_px, raw->bits, parallel_serial.threads);
    uint8_t *grey = malloc(pixels);
    uint8_t *colour = malloc(3 * pixels);
    void *work = malloc(need);
    int error = ERROR_MEMORY;
    if (grey != NULL && colour != NULL && work != NULL) {
        struct arena arena;
        struct image_u8 grey_image = {grey, raw->width_px, raw->height_px, raw->width_px};
        struct image_rgb8 colour_image = {colour, raw->width_px, raw->height_px, 3 * raw->width_px};
        if (shrink == 1) {
            place(picture, &grey_image, &colour_image);
        }
        arena_init(&arena, work, need);
        error = develop_image(raw, balance, &parallel_serial, &arena, &grey_image, &colour_image);
    }
    if (error == ERROR_OK && shrink > 1) {
        const size_t channels = (size_t)picture->channels;
        shrink_into(channels == 3 ? colour : grey, (size_t)raw->width_px * channels, shrink,
                    picture);
    }
    free(grey);
    free(colour);
    free(work);
    return error;
}

struct picture picture_half(const struct picture *picture, unsigned side) {
    struct picture half = *picture;
    INVARIANT(side < 2);
    half.width_px /= 2;
    half.pixels += side * (size_t)half.width_px * (size_t)half.channels;
    return half;
}

int picture_develop_pair(const struct raw_image *left, const struct raw_image *right, int shrink,
                         bool colour, struct picture *picture) {
    INVARIANT(left->width_px == right->width_px && left->height_px == right->height_px);
    const struct develop_balance balance = develop_balance_of(left);
    *picture = (struct picture){.width_px = 2 * (left->width_px / shrink),
                                .height_px = left->height_px / shrink,
                                .channels = colour && left->layout != RAW_GREY ? 3 : 1};
    picture->row_bytes = (size_t)picture->width_px * (size_t)picture->channels;
    picture->pixels = malloc(picture->row_bytes * (size_t)picture->height_px);
    int error = picture->pixels != NULL ? ERROR_OK : ERROR_MEMORY;
    for (unsigned side = 0; side < 2 && error == ERROR_OK; side++) {
        struct picture half = picture_half(picture, side);
        error = picture_develop(side == 0 ? left : right, &balance, shrink, &half);
    }
    if (error != ERROR_OK) {
        free(picture->pixels);
        picture->pixels = NULL;
    }
    return error;
}
