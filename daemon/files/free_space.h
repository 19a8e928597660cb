// SPDX-License-Identifier: Apache-2.0
/// Memory and space for files that are left, for work that checks before it begins: a kernel that
/// has promised too much memory kills processes, and a disk that fills leaves half a result.
#ifndef VERGENCE_DAEMON_FILES_FREE_SPACE_H
#define VERGENCE_DAEMON_FILES_FREE_SPACE_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Bytes that are there, or that are needed.
struct free_space {
    uint64_t memory_bytes, files_bytes;
    uint64_t freed_bytes;  ///< of the memory needed, what is free again before files are written
    bool files_in_memory;  ///< files take memory as well
    bool files_limited;    ///< `files_bytes` are what is left of a limit, not of a disk
};

/// What is there now, a reserve of memory for everything else excepted. `files`: a directory, which
/// may be open as O_PATH, in which all files may take `files_limit_bytes` (0: no limit); -1: none.
struct free_space free_space_now(int files, uint64_t files_limit_bytes);

/// Whether the bytes of `need` are there. Files in memory need both.
bool free_space_fits(const struct free_space *available, const struct free_space *need);

/// Bytes of memory that `need` takes with its files, at most.
uint64_t free_space_memory_bytes(const struct free_space *available, const struct free_space *need);

/// Bytes that the files below a directory take, in whole pages; links are not followed. `directory`
/// may be open as O_PATH.
uint64_t free_space_used_bytes(int directory);

#ifdef __cplusplus
}
#endif

#endif
