// SPDX-License-Identifier: Apache-2.0
#include "daemon/files/output_file.h"

#include <errno.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/process.h"
#include "daemon/files/file_io.h"

/// Surfaces have tens of megabytes: fewer calls of the system.
enum { STREAM_BYTES = 1 << 17 };

static void remember_error(struct output_file *file) {
    if (file->error_number == 0) {
        file->error_number = errno != 0 ? errno : EIO;
    }
}

void output_file_open(struct output_file *file, const char *path) {
    file->path = path;
    file->sink = (struct output_sink){NULL, NULL};
    file->error_number = 0;
    file->filled = 0;
    file->stream = fopen(path, "wb");
    if (file->stream == NULL) {
        remember_error(file);
    } else {
        setvbuf(file->stream, NULL, _IOFBF, STREAM_BYTES);
    }
}

void output_file_open_sink(struct output_file *file, const struct output_sink *sink,
                           const char *name) {
    file->path = name;
    file->sink = *sink;
    file->error_number = 0;
    file->filled = 0;
    file->stream = NULL;
}

static void pass_on(struct output_file *file, const void *bytes, size_t length) {
    if (file->error_number != 0 || interrupt_requested()) {
        return;
    }
    if (file->sink.put != NULL) {
        file->sink.put(file->sink.self, bytes, length);
    } else if (fwrite(bytes, 1, length, file->stream) != length) {
        remember_error(file);
    }
}

void output_file_write(struct output_file *file, const void *bytes, size_t length) {
    if (length > OUTPUT_FILE_BUFFER_BYTES - file->filled) {
        pass_on(file, file->buffer, file->filled);
        file->filled = 0;
    }
    if (length > OUTPUT_FILE_BUFFER_BYTES) {
        pass_on(file, bytes, length);
        return;
    }
    if (length > 0) {
        memcpy(file->buffer + file->filled, bytes, length);
    }
    file->filled += length;
}

void output_file_put_u32(unsigned char bytes[4], uint32_t value) {
    for (int i = 0; i < 4; i++) {
        bytes[i] = (unsigned char)(value >> (8 * i));
    }
}

void output_file_put_f32(unsigned char bytes[4], float value) {
    uint32_t bits = 0;
    _Static_assert(sizeof bits == sizeof value, "a float has 32 bits");
    memcpy(&bits, &value, sizeof bits);
    output_file_put_u32(bytes, bits);
}

void output_file_u32(struct output_file *file, uint32_t value) {
    unsigned char bytes[4];
    output_file_put_u32(bytes, value);
    output_file_write(file, bytes, sizeof bytes);
}

int output_file_close(struct output_file *file, struct message *message) {
    INVARIANT(file->stream != NULL || file->sink.put != NULL || file->error_number != 0);
    if (file->stream != NULL || file->sink.put != NULL) {
        pass_on(file, file->buffer, file->filled);
    }
    if (file->stream != NULL) {
        errno = 0;
        if (fflush(file->stream) != 0 || ferror(file->stream) != 0) {
            remember_error(file);
        }
        if (fclose(file->stream) != 0) {
            remember_error(file);
        }
        file->stream = NULL;
    }
    if (file->error_number != 0) {
        return message_set(message,
                           file_error_is_full(file->error_number) ? ERROR_FULL : ERROR_BUFFER,
                           "writing %s failed: %s", file->path, strerror(file->error_number));
    }
    if (interrupt_requested()) {
        return message_set(message, ERROR_CANCELLED, "interrupted; nothing was written");
    }
    return ERROR_OK;
}
