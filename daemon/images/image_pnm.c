// SPDX-License-Identifier: Apache-2.0
#include "daemon/images/image_pnm.h"

#include <stdlib.h>

#include "core/error.h"
#include "core/invariant.h"

struct pnm {
    const unsigned char *data;
    size_t length, at;
    bool plain;  // decimal text
    int channels, width_px, height_px;
    uint32_t maxval;
};

bool image_pnm_probe(const unsigned char *head, size_t length) {
    return length >= 3 && head[0] == 'P' &&
           (head[1] == '2' || head[1] == '3' || head[1] == '5' || head[1] == '6') &&
           (head[2] == ' ' || head[2] == '\t' || head[2] == '\n' || head[2] == '\r' ||
            head[2] == '#');
}

static bool is_space(unsigned char c) {
    return c == ' ' || (c >= '\t' && c <= '\r');
}

static void skip_space(struct pnm *pnm) {
    while (pnm->at < pnm->length) {
        if (pnm->data[pnm->at] == '#') {
            while (pnm->at < pnm->length && pnm->data[pnm->at] != '\n') {
                pnm->at++;
            }
        } else if (!is_space(pnm->data[pnm->at])) {
            return;
        } else {
            pnm->at++;
        }
    }
}

/// Reads the next decimal number; false if there is none or it exceeds `maximum`.
static bool next_number(struct pnm *pnm, uint32_t maximum, uint32_t *number) {
    skip_space(pnm);
    const size_t begin = pnm->at;
    uint32_t value = 0;
    while (pnm->at < pnm->length && pnm->data[pnm->at] >= '0' && pnm->data[pnm->at] <= '9') {
        value = value * 10 + (uint32_t)(pnm->data[pnm->at] - '0');
        if (value > maximum) {
            return false;
        }
        pnm->at++;
    }
    *number = value;
    return pnm->at > begin;
}

static bool parse_header(struct pnm *pnm) {
    if (!image_pnm_probe(pnm->data, pnm->length)) {
        return false;
    }
    const unsigned char kind = pnm->data[1];
    pnm->plain = kind == '2' || kind == '3';
    pnm->channels = kind == '3' || kind == '6' ? 3 : 1;
    pnm->at = 2;
    uint32_t width = 0, height = 0;
    // Sizes beyond any legal image must still reach the message that states the limit.
    if (!next_number(pnm, 10000000, &width) || !next_number(pnm, 10000000, &height) ||
        !next_number(pnm, 65535, &pnm->maxval) || pnm->maxval == 0) {
        return false;
    }
    pnm->width_px = (int)width;
    pnm->height_px = (int)height;
    // Exactly one white space precedes the pixels, which may look like white space themselves.
    return pnm->at < pnm->length && is_space(pnm->data[pnm->at++]);
}

static int bits_of_maxval(uint32_t maxval) {
    int bits = 8;
    while ((maxval >> bits) != 0) {
        bits++;
    }
    return bits;
}

static bool next_row(struct pnm *pnm, uint16_t *row) {
    const size_t count = (size_t)pnm->width_px * (size_t)pnm->channels;
    const size_t value_bytes = pnm->maxval > 255 ? 2 : 1;
    if (!pnm->plain && pnm->length - pnm->at < count * value_bytes) {
        return false;
    }
    for (size_t i = 0; i < count; i++) {
        uint32_t value = 0;
        if (pnm->plain) {
            if (!next_number(pnm, pnm->maxval, &value)) {
                return false;
            }
        } else {
            value = pnm->data[pnm->at++];
            if (value_bytes == 2) {
                value = value << 8 | pnm->data[pnm->at++];
            }
        }
        if (value > pnm->maxval) {
            return false;
        }
        row[i] = (uint16_t)value;
    }
    return true;
}

static void stretch_row(uint16_t *row, size_t count, uint32_t maxval, int bits) {
    const uint32_t full = (1u << bits) - 1;
    INVARIANT(maxval <= full && full <= 65535);
    for (size_t i = 0; i < count && maxval != full; i++) {
        row[i] = (uint16_t)(((uint64_t)row[i] * full + maxval / 2) / maxval);
    }
}

/// Whether a header of a legal size promises more than the file contains. A value takes at least
/// one byte (binary) or a digit and a space.
static bool is_truncated(const struct pnm *pnm, int bits) {
    if (pnm->width_px > IMAGE_FILE_MAX_SIDE_PX || pnm->height_px > IMAGE_FILE_MAX_SIDE_PX) {
        return false;
    }
    const uint64_t values =
        (uint64_t)pnm->width_px * (uint64_t)pnm->height_px * (uint64_t)pnm->channels;
    const uint64_t min = pnm->plain ? 2 * values - (values > 0) : values * (bits > 8 ? 2 : 1);
    return pnm->length - pnm->at < min;
}

int image_pnm_parse(const unsigned char *data, size_t length, struct image_file *file,
                    struct message *message) {
    struct pnm pnm = {.data = data, .length = length};
    if (!parse_header(&pnm)) {
        return message_set(message, ERROR_SYNTAX, "%s: invalid PNM header", file->path);
    }
    const int bits = bits_of_maxval(pnm.maxval);
    if (is_truncated(&pnm, bits)) {  // checked before memory is allocated
        return message_set(message, ERROR_SYNTAX,
                           "%s: truncated: %dx%d pixels need more than %zu bytes", file->path,
                           pnm.width_px, pnm.height_px, length);
    }
    int error = image_file_begin(file, pnm.width_px, pnm.height_px, pnm.channels, bits,
                                 pnm.channels == 3 ? RAW_RGB : RAW_GREY, message);
    if (error != ERROR_OK) {
        return error;
    }
    const size_t count = (size_t)pnm.width_px * (size_t)pnm.channels;
    uint16_t *row = malloc(count * sizeof *row);
    if (row == NULL) {
        return message_set(message, ERROR_MEMORY, "%s: out of memory", file->path);
    }
    for (int y = 0; y < pnm.height_px && error == ERROR_OK; y++) {
        if (next_row(&pnm, row)) {
            stretch_row(row, count, pnm.maxval, bits);
            error = image_file_row(file, row, message);
        } else {
            error = message_set(message, ERROR_SYNTAX, "%s: row %d is invalid or missing",
                                file->path, y);
        }
    }
    free(row);
    return error;
}

int image_pnm_read(const char *path, const struct image_request *request, struct image_file *file,
                   struct message *message) {
    (void)request;
    return image_file_load(path, image_pnm_parse, file, message);
}

int image_raw_parse(const unsigned char *data, size_t length, struct image_file *file,
                    struct message *message) {
    const struct image_request *request = file->request;
    const bool stated = request->raw_width_px > 0;
    const int width_px = stated ? request->raw_width_px : IMAGE_RAW_WIDTH_PX;
    const int height_px = stated ? request->raw_height_px : IMAGE_RAW_HEIGHT_PX;
    const uint64_t expected = 2 * (uint64_t)width_px * (uint64_t)height_px;
    if (length != expected) {
        return message_set(message, ERROR_SYNTAX,
                           "%s: %zu bytes do not match %dx%d words of 16 bits (%llu bytes); %s",
                           file->path, length, width_px, height_px, (unsigned long long)expected,
                           stated ? "check --raw" : "give the size with --raw WxH");
    }
    int error =
        image_file_begin(file, width_px, height_px, 1, IMAGE_RAW_BITS, RAW_BAYER_GRBG, message);
    if (error != ERROR_OK) {
        return error;
    }
    uint16_t *row = malloc((size_t)width_px * sizeof *row);
    if (row == NULL) {
        return message_set(message, ERROR_MEMORY, "%s: out of memory", file->path);
    }
    for (int y = 0; y < height_px && error == ERROR_OK; y++) {
        const unsigned char *words = data + 2 * (size_t)y * (size_t)width_px;
        for (int x = 0; x < width_px; x++) {
            row[x] = (uint16_t)(words[2 * x] | words[2 * x + 1] << 8);
        }
        error = image_file_row(file, row, message);
    }
    free(row);
    return error;
}

int image_raw_read(const char *path, const struct image_request *request, struct image_file *file,
                   struct message *message) {
    (void)request;
    return image_file_load(path, image_raw_parse, file, message);
}
