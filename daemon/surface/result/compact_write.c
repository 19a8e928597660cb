// SPDX-License-Identifier: Apache-2.0
#include <stdlib.h>
#include <zlib.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/surface/result/compact.h"
#include "daemon/surface/result/result_format.h"

enum { WINDOW_BITS = 9 };  // noise repeats nothing but one value: runs need no window

struct writer {
    struct compact_writer compact;
    const struct reconstruct_context *context;
    struct output_file file;
    z_stream deflater;
    uint8_t *band, *packed;
    size_t packed_bytes;
};

static size_t pack(void *cookie, uint8_t *bytes, size_t length, uint8_t *packed) {
    struct writer *self = cookie;
    z_stream *deflater = &self->deflater;
    deflateReset(deflater);
    deflater->next_in = bytes;
    deflater->avail_in = (uInt)length;
    deflater->next_out = packed;
    deflater->avail_out = (uInt)self->packed_bytes;
    const int code = deflate(deflater, Z_FINISH);
    INVARIANT(code == Z_STREAM_END);
    return self->packed_bytes - deflater->avail_out;
}

static void put(void *cookie, const void *bytes, size_t length) {
    struct writer *self = cookie;
    output_file_write(&self->file, bytes, length);
}

static void put_rows(struct writer *self) {
    const struct reconstruct_context *context = self->context;
    int rows = 0;
    compact_writer_rows(&self->compact, context->result, self->band, self->packed);
    while (rows < context->result->plan.height_px && self->file.error_number == 0) {
        rows = compact_writer_band(&self->compact);
        if (context->rows_written != NULL) {
            context->rows_written(context->owner, rows);
        }
    }
}

static int write_all_of(struct writer *self, struct message *message) {
    const struct compact_output output = {pack, put, self};
    compact_writer_begin(&self->compact, &output);
    const int error = compact_head_print(self->context, &self->compact);
    if (error == ERROR_OK) {
        put_rows(self);
    }
    const int closed = output_file_close(&self->file, message);
    return error == ERROR_OK
               ? closed
               : message_set(message, error, "%s: %s", self->file.path, error_text(error));
}

/// To `sink`, or if that is NULL into the file.
static int write_to(const struct reconstruct_context *context, const struct output_sink *sink,
                    const char *path, struct message *message) {
    const int width = context->result->plan.width_px;
    struct writer *self = calloc(1, sizeof *self);
    const bool ready = self != NULL && deflateInit2(&self->deflater, Z_BEST_SPEED, Z_DEFLATED,
                                                    WINDOW_BITS, MAX_MEM_LEVEL - 1, Z_RLE) == Z_OK;
    int error = ERROR_MEMORY;
    if (ready) {
        self->context = context;
        self->packed_bytes = compressBound((uLong)compact_band_pixels(width));
        self->band = calloc(1, compact_band_bytes(width) + self->packed_bytes);
    }
    if (ready && self->band != NULL) {
        self->packed = self->band + compact_band_bytes(width);
        if (sink != NULL) {
            output_file_open_sink(&self->file, sink, path);
        } else {
            output_file_open(&self->file, path);
        }
        error = write_all_of(self, message);
    } else {
        message_set(message, error, "%s: out of memory", path);
    }
    if (ready) {
        deflateEnd(&self->deflater);
        free(self->band);
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
