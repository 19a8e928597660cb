// SPDX-License-Identifier: Apache-2.0
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include "core/crc.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/surface/result/compact.h"
#include "daemon/surface/result/compact_band.h"
#include "daemon/surface/result/result_format.h"

enum { WINDOW_BITS = 9 };  // noise repeats nothing but one value: runs need no window

struct writer {
    struct output_file file;
    struct compact_band band;
    z_stream deflater;
    uint32_t crc;
};

static void put(struct writer *self, const void *bytes, size_t length) {
    self->crc = crc_update(self->crc, bytes, length);
    output_file_write(&self->file, bytes, length);
}

/// Its packed length, then the bytes.
static void put_chunk(struct writer *self, uint8_t *bytes, size_t length) {
    unsigned char packed_length[4];
    z_stream *deflater = &self->deflater;
    deflateReset(deflater);
    deflater->next_in = bytes;
    deflater->avail_in = (uInt)length;
    deflater->next_out = self->band.packed;
    deflater->avail_out = (uInt)self->band.packed_bytes;
    const int code = deflate(deflater, Z_FINISH);
    INVARIANT(code == Z_STREAM_END);
    const size_t packed = self->band.packed_bytes - deflater->avail_out;
    output_file_put_u32(packed_length, (uint32_t)packed);
    put(self, packed_length, sizeof packed_length);
    put(self, self->band.packed, packed);
}

static void gather_row(struct writer *self, const struct reconstruct_result *result, int y,
                       uint8_t *reason) {
    struct compact_band *band = &self->band;
    const size_t width = (size_t)band->width;
    const uint8_t *rgb = reconstruct_colour_row(result, y);
    const uint8_t *confidence = image_u8_row(&result->match.confidence, y);
    const uint8_t *sigma = image_u8_row(&result->sigma, y);
    memcpy(reason, image_u8_row(&result->match.reason, y), width);
    memcpy(band->row[COMPACT_DISPARITY][1], image_i32_row(&result->match.disparity_q8, y),
           width * sizeof(int32_t));
    for (size_t x = 0; x < width; x++) {
        const int32_t green = rgb[3 * x + 1];
        band->row[COMPACT_CONFIDENCE][1][x] = confidence[x];
        band->row[COMPACT_SIGMA][1][x] = subpixel_sigma_q8(sigma[x]);
        band->row[COMPACT_GREEN][1][x] = green;
        band->row[COMPACT_RED][1][x] = compact_wrap(rgb[3 * x] - green, 1, true);
        band->row[COMPACT_BLUE][1][x] = compact_wrap(rgb[3 * x + 2] - green, 1, true);
    }
    for (int i = 0; i < COMPACT_CHANNELS; i++) {
        compact_encode(band, (enum compact_channel)i, reason, y == 0);
    }
}

static void put_rows(struct writer *self, const struct reconstruct_context *context) {
    const struct reconstruct_result *result = context->result;
    struct compact_band *band = &self->band;
    const int height = result->plan.height_px;
    for (int y = 0; y < height && self->file.error_number == 0;) {
        const int end = height - y < band->rows_max ? height : y + band->rows_max;
        uint8_t *reason = band->reason;
        memset(band->used, 0, sizeof band->used);
        for (; y < end; y++, reason += band->width) {
            gather_row(self, result, y, reason);
        }
        put_chunk(self, band->reason, (size_t)(reason - band->reason));
        for (int i = 0; i < COMPACT_CHANNELS; i++) {
            for (int byte = 0; byte < compact_forms[i].bytes; byte++) {
                put_chunk(self, band->chunk[i][byte], band->used[i]);
            }
        }
        if (context->rows_written != NULL) {
            context->rows_written(context->owner, y);
        }
    }
}

/// The head is printed into memory: it has to be summed.
static int put_head(struct writer *self, const struct reconstruct_context *context) {
    char *text = NULL;
    size_t length = 0;
    FILE *stream = open_memstream(&text, &length);
    if (stream == NULL) {
        return ERROR_MEMORY;
    }
    const int error = compact_head_print(context, stream);
    const bool printed = fclose(stream) == 0;
    if (error == ERROR_OK && printed) {
        put(self, text, length);
    }
    free(text);
    return error != ERROR_OK ? error : printed ? ERROR_OK : ERROR_MEMORY;
}

static int write_all_of(struct writer *self, const struct reconstruct_context *context,
                        struct message *message) {
    unsigned char crc[COMPACT_CRC_BYTES];
    const int error = put_head(self, context);
    if (error == ERROR_OK) {
        put_rows(self, context);
        output_file_put_u32(crc, self->crc);
        output_file_write(&self->file, crc, sizeof crc);
    }
    const int closed = output_file_close(&self->file, message);
    return error == ERROR_OK
               ? closed
               : message_set(message, error, "%s: %s", self->file.path, error_text(error));
}

/// To `sink`, or if that is NULL into the file.
static int write_to(const struct reconstruct_context *context, const struct output_sink *sink,
                    const char *path, struct message *message) {
    struct writer *self = calloc(1, sizeof *self);
    const bool ready = self != NULL && deflateInit2(&self->deflater, Z_BEST_SPEED, Z_DEFLATED,
                                                    WINDOW_BITS, MAX_MEM_LEVEL - 1, Z_RLE) == Z_OK;
    int error = ERROR_MEMORY;
    if (ready && compact_band_take(context->result->plan.width_px, &self->band)) {
        if (sink != NULL) {
            output_file_open_sink(&self->file, sink, path);
        } else {
            output_file_open(&self->file, path);
        }
        error = write_all_of(self, context, message);
    } else {
        message_set(message, error, "%s: out of memory", path);
    }
    if (ready) {
        deflateEnd(&self->deflater);
        free(self->band.memory);
    }
    free(self);
    return error;
}

int compact_write(const struct reconstruct_context *context, const char *path,
                  struct message *message) {
    return write_to(context, NULL, path, message);
}

int compact_send(const struct reconstruct_context *context, const struct output_sink *sink,
                 struct message *message) {
    return write_to(context, sink, result_formats[RESULT_COMPACT].file_name, message);
}
