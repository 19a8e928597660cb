// SPDX-License-Identifier: Apache-2.0
#include "daemon/images/picture.h"

#include <stdlib.h>
#include <string.h>

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
        if (shrink == 1) {
            memcpy(out, top, (size_t)picture->width_px * channels);
            continue;
        }
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
        arena_init(&arena, work, need);
        error = develop_image(raw, balance, &parallel_serial, &arena, &grey_image, &colour_image);
    }
    if (error == ERROR_OK) {
        const size_t channels = (size_t)picture->channels;
        shrink_into(channels == 3 ? colour : grey, (size_t)raw->width_px * channels, shrink,
                    picture);
    }
    free(grey);
    free(colour);
    free(work);
    return error;
}
