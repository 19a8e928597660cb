// SPDX-License-Identifier: Apache-2.0
#include <png.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include "core/invariant.h"
#include "daemon/images/picture.h"

enum { MAX_SIDE_PX = 1 << 17, FIRST_BYTES = 1 << 16 };

struct output {
    uint8_t *bytes;
    size_t length, capacity;
};

static void append(png_structp png, png_bytep data, size_t length) {
    struct output *output = png_get_io_ptr(png);
    if (length > output->capacity - output->length) {
        const size_t capacity = 2 * output->capacity + length + FIRST_BYTES;
        uint8_t *more = realloc(output->bytes, capacity);
        if (more == NULL) {
            png_error(png, "out of memory");
        }
        output->bytes = more;
        output->capacity = capacity;
    }
    memcpy(output->bytes + output->length, data, length);
    output->length += length;
}

static void flush(png_structp png) {
    (void)png;
}

/// The only errors are those of memory, which the caller sees.
static void say_nothing(png_structp png, png_const_charp text) {
    (void)png;
    (void)text;
}

static void write_head(png_structp png, png_infop info, const struct picture *picture) {
    char software[] = "Software", vergence[] = "vergence", comment[] = "Comment";
    png_text texts[] = {
        {.compression = PNG_TEXT_COMPRESSION_NONE, .key = software, .text = vergence},
        {.compression = PNG_TEXT_COMPRESSION_NONE,
         .key = comment,
         .text = (char *)(uintptr_t)picture->text},
    };
    const int one = picture->palette != NULL ? PNG_COLOR_TYPE_PALETTE : PNG_COLOR_TYPE_GRAY;
    png_set_IHDR(png, info, (png_uint_32)picture->width_px, (png_uint_32)picture->height_px, 8,
                 picture->channels == 3 ? PNG_COLOR_TYPE_RGB : one, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    if (one == PNG_COLOR_TYPE_PALETTE) {
        png_color palette[PICTURE_COLOURS];
        for (size_t i = 0; i < PICTURE_COLOURS; i++) {
            const uint8_t *colour = picture->palette[i];
            palette[i] = (png_color){colour[0], colour[1], colour[2]};
        }
        png_set_PLTE(png, info, palette, PICTURE_COLOURS);
    }
    png_set_text(png, info, texts, picture->text != NULL ? 2 : 1);
    // Photographs repeat nothing: a search for repetitions takes long and saves little.
    png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_PAETH);
    png_set_compression_strategy(png, Z_HUFFMAN_ONLY);
    png_write_info(png, info);
}

/// False: out of memory.
static bool write_all_rows(png_structp png, png_infop info, const struct picture *picture) {
    if (setjmp(png_jmpbuf(png)) != 0) {
        return false;
    }
    write_head(png, info, picture);
    for (int y = 0; y < picture->height_px; y++) {
        png_write_row(png, picture->pixels + (size_t)y * picture->row_bytes);
    }
    png_write_end(png, info);
    return true;
}

uint8_t *picture_png(const struct picture *picture, size_t *bytes) {
    INVARIANT(picture->channels == 1 || (picture->channels == 3 && picture->palette == NULL));
    INVARIANT(picture->width_px >= 1 && picture->width_px <= MAX_SIDE_PX);
    INVARIANT(picture->height_px >= 1 && picture->height_px <= MAX_SIDE_PX);
    struct output output = {.bytes = NULL};
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, say_nothing);
    png_infop info = png != NULL ? png_create_info_struct(png) : NULL;
    bool good = false;
    if (info != NULL) {
        png_set_write_fn(png, &output, append, flush);
        good = write_all_rows(png, info, picture);
    }
    png_destroy_write_struct(&png, &info);
    if (!good) {
        free(output.bytes);
        return NULL;
    }
    *bytes = output.length;
    return output.bytes;
}

bool picture_png_is_ours(const uint8_t *head, size_t bytes) {
    // Behind the signature and the header's chunk, and the length of the next one.
    enum { SOFTWARE_AT = 8 + 12 + 13 + 4 };
    static const char name[] = "tEXtSoftware\0vergence";
    _Static_assert(SOFTWARE_AT + sizeof name - 1 <= PICTURE_HEAD_BYTES,
                   "the comment lies within the head");
    return bytes >= SOFTWARE_AT + sizeof name - 1 && png_sig_cmp(head, 0, 8) == 0 &&
           memcmp(head + SOFTWARE_AT, name, sizeof name - 1) == 0;
}
