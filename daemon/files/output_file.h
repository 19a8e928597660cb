// SPDX-License-Identifier: Apache-2.0
/// A file being written whose first error is remembered, so that writers check once, at the end.
/// Full disks show up in any write, and often only when the file is closed.
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

struct output_file {
    FILE *stream;  // NULL when it could not be opened; writers may print to it before they write
    const char *path;
    int error_number;  // errno of the first failure, 0 while all is well
    size_t filled;     // bytes waiting in the buffer
    unsigned char buffer[OUTPUT_FILE_BUFFER_BYTES];  // points come in pieces of a few bytes
};

/// Creates or empties the file. A failure is reported by `output_file_close`.
void output_file_open(struct output_file *file, const char *path);

/// Appends bytes; numbers in little-endian order. Nothing is written any more after a failure, or
/// after an interrupt was requested.
void output_file_write(struct output_file *file, const void *bytes, size_t length);
void output_file_u32(struct output_file *file, uint32_t value);
void output_file_f32(struct output_file *file, float value);

/// Flushes and closes (`outdir_commit` then sees to it that the disk has it). Returns 0, or
/// ERROR_BUFFER (ERROR_FULL: there is no room) with `message` naming the file and the reason, or
/// ERROR_CANCELLED.
int output_file_close(struct output_file *file, struct message *message);

/// Stores a float as 4 bytes, least significant first.
void output_file_put_f32(unsigned char bytes[4], float value);
void output_file_put_u32(unsigned char bytes[4], uint32_t value);

#ifdef __cplusplus
}
#endif

#endif
