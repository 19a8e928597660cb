// SPDX-License-Identifier: Apache-2.0
/// A file being written that remembers its first error, so that writers check once, at the end. A
/// full disk can show in any write, and often only on close.
#ifndef VERGENCE_DAEMON_FILES_OUTPUT_FILE_H
#define VERGENCE_DAEMON_FILES_OUTPUT_FILE_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "daemon/base/message.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { OUTPUT_FILE_BUFFER_BYTES = 8192 };

/// Takes what would be written, in place of a file.
struct output_sink {
    void (*put)(void *self, const void *bytes, size_t length);
    void *self;
};

struct output_file {
    FILE *stream;  // NULL if the file could not be opened; may be printed to before the first write
    struct output_sink sink;  // has `put`: in place of `stream`
    const char *path;
    int error_number;                                // errno of the first failure, 0: no failure
    size_t filled;                                   // bytes in the buffer
    unsigned char buffer[OUTPUT_FILE_BUFFER_BYTES];  // points are written a few bytes at a time
};

/// Creates or truncates the file. `output_file_close` reports a failure.
void output_file_open(struct output_file *file, const char *path);

/// Sends to `sink` what is written. Only numbers and bytes: there is no `stream`.
void output_file_open_sink(struct output_file *file, const struct output_sink *sink,
                           const char *name);

/// Appends bytes; numbers in little-endian order. Nothing is written after a failure or after an
/// interrupt was requested. Without bytes the pointer may be NULL.
void output_file_write(struct output_file *file, const void *bytes, size_t length);
void output_file_u32(struct output_file *file, uint32_t value);

/// Flushes and closes (`atomic_dir_commit` syncs the file to disk). Returns 0, or ERROR_BUFFER
/// (ERROR_FULL: no space) with `message` naming the file and the reason, or ERROR_CANCELLED.
int output_file_close(struct output_file *file, struct message *message);

/// Stores a float as 4 bytes, least significant first.
void output_file_put_f32(unsigned char bytes[4], float value);
void output_file_put_u32(unsigned char bytes[4], uint32_t value);

#ifdef __cplusplus
}
#endif

#endif
