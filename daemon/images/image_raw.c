// SPDX-License-Identifier: Apache-2.0
#include "daemon/images/image_raw.h"

#include <stdlib.h>

#include "core/error.h"

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
