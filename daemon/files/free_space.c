// SPDX-License-Identifier: Apache-2.0
#include "daemon/files/free_space.h"

#include <fcntl.h>
#include <linux/magic.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/statfs.h>
#include <unistd.h>

#include "daemon/base/memory.h"
#include "daemon/base/raw_memory.h"
#include "daemon/files/directory_names.h"

uint64_t free_space_used_bytes(int directory) {
    enum { PAGE_BYTES = 4096 };
    const int fd = openat(directory, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *stream = directory_stream(fd);
    uint64_t bytes = 0;
    if (stream == NULL) {
        return 0;
    }
    for (const struct dirent *entry = readdir(stream); entry != NULL; entry = readdir(stream)) {
        struct stat about;
        if (strcmp(entry->d_name, ".") == 0 || strcmp(entry->d_name, "..") == 0 ||
            fstatat(fd, entry->d_name, &about, AT_SYMLINK_NOFOLLOW) != 0) {
            continue;
        }
        if (S_ISDIR(about.st_mode)) {
            const int below =
                openat(fd, entry->d_name, O_PATH | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
            bytes += below >= 0 ? free_space_used_bytes(below) : 0;
            close(below);
        } else if (S_ISREG(about.st_mode)) {
            bytes += ((uint64_t)about.st_size + PAGE_BYTES - 1) / PAGE_BYTES * PAGE_BYTES;
        }
    }
    closedir(stream);
    return bytes;
}

static uint64_t left_of(uint64_t bytes, uint64_t used) {
    return bytes > used ? bytes - used : 0;
}

struct free_space free_space_now(int files, uint64_t files_limit_bytes) {
    struct statfs about;
    struct free_space available = {
        .memory_bytes = left_of(memory_available_bytes(), RAW_MEMORY_RESERVE_BYTES),
        .files_bytes = UINT64_MAX,
    };
    if (files < 0) {
        return available;
    }
    if (fstatfs(files, &about) == 0) {
        const uint32_t type = (uint32_t)about.f_type;
        available.files_in_memory = type == TMPFS_MAGIC || type == RAMFS_MAGIC;
        if (about.f_blocks != 0) {  // ramfs has no limit, and states 0
            available.files_bytes = (uint64_t)about.f_bavail * (uint64_t)about.f_bsize;
        }
    }
    if (files_limit_bytes > 0) {
        const uint64_t left_bytes = left_of(files_limit_bytes, free_space_used_bytes(files));
        available.files_limited = left_bytes < available.files_bytes;
        available.files_bytes = available.files_limited ? left_bytes : available.files_bytes;
    }
    return available;
}

uint64_t free_space_memory_bytes(const struct free_space *available,
                                 const struct free_space *need) {
    const uint64_t files_bytes = available->files_in_memory ? need->files_bytes : 0;
    return need->memory_bytes + left_of(files_bytes, need->freed_bytes);
}

bool free_space_fits(const struct free_space *available, const struct free_space *need) {
    return need->files_bytes <= available->files_bytes &&
           free_space_memory_bytes(available, need) <= available->memory_bytes;
}
