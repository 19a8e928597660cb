// SPDX-License-Identifier: Apache-2.0
/// Files in memory: what the instrument made last, for `files` and `fetch`, and one file that a
/// client has sent.
#ifndef VERGENCE_MEMORY_FILES_H
#define VERGENCE_MEMORY_FILES_H

#include <stddef.h>
#include <stdint.h>

#include "console/command.h"

enum memory_file {
    MEMORY_FILE_SENT,
    MEMORY_FILE_LEFT,  ///< the frames of the last pair
    MEMORY_FILE_RIGHT,
    MEMORY_FILE_SURFACE,
    MEMORY_FILES,
};

enum { MEMORY_FILE_NAME_BYTES = 104, MEMORY_SENT_BYTES = 384 * 1024 };

/// Copies `bytes` bytes from `offset` on, which the file has.
typedef void memory_file_read(const void *source, size_t offset, void *to, size_t bytes);

/// Makes a file of what `read` gives of `source`. `directory` and `name`: of at most
/// MEMORY_FILE_NAME_BYTES - 1 characters together; both are copied.
void memory_files_put(enum memory_file file, const char *directory, const char *name,
                      memory_file_read *read, const void *source, size_t bytes);
void memory_files_remove(enum memory_file file);

/// The file that a client has sent, if it is complete and has this name; else NULL.
const void *memory_files_sent(const char *name, size_t *bytes);

const struct command *memory_files_table(size_t *count);

#endif
