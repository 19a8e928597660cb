// SPDX-License-Identifier: Apache-2.0
#include "daemon/base/memory.h"

#include <inttypes.h>
#include <malloc.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/sysinfo.h>

enum { LINE_BYTES = 128, KIB = 1024 };

/// Whether the file of vm.overcommit_memory says that no more memory is promised than there is.
static bool is_strict(const char *overcommit) {
    FILE *file = fopen(overcommit, "re");
    const bool strict = file != NULL && fgetc(file) == '2';
    if (file != NULL) {
        fclose(file);
    }
    return strict;
}

static uint64_t smaller(uint64_t a, uint64_t b) {
    return a < b ? a : b;
}

uint64_t memory_available_as_in(const char *meminfo, const char *overcommit) {
    enum { AVAILABLE, SWAP_FREE, COMMIT_LIMIT, COMMITTED, FIGURES };
    static const char *const names[FIGURES] = {
        "MemAvailable:", "SwapFree:", "CommitLimit:", "Committed_AS:"};
    char line[LINE_BYTES];
    uint64_t kib[FIGURES] = {0};
    bool known[FIGURES] = {false};
    FILE *file = fopen(meminfo, "re");
    while (file != NULL && fgets(line, sizeof line, file) != NULL) {
        for (int i = 0; i < FIGURES; i++) {
            const size_t length = strlen(names[i]);
            if (strncmp(line, names[i], length) == 0) {
                known[i] = sscanf(line + length, "%" SCNu64, &kib[i]) == 1;
            }
        }
    }
    if (file != NULL) {
        fclose(file);
    }
    if (known[AVAILABLE]) {
        const uint64_t available = kib[AVAILABLE] + kib[SWAP_FREE];
        const uint64_t left =
            kib[COMMIT_LIMIT] > kib[COMMITTED] ? kib[COMMIT_LIMIT] - kib[COMMITTED] : 0;
        const bool limited = known[COMMIT_LIMIT] && known[COMMITTED] && is_strict(overcommit);
        return (limited ? smaller(left, available) : available) * KIB;
    }
    struct sysinfo all;
    if (sysinfo(&all) != 0) {
        return UINT64_MAX;
    }
    return ((uint64_t)all.freeram + all.bufferram + all.freeswap) * all.mem_unit;
}

uint64_t memory_available_bytes(void) {
    const char *other = getenv("VERGENCE_MEMINFO");
    return memory_available_as_in(other != NULL ? other : "/proc/meminfo",
                                  "/proc/sys/vm/overcommit_memory");
}

void memory_return_freed(void) {
#ifdef M_MMAP_THRESHOLD  // glibc has it, other C libraries have not
    mallopt(M_MMAP_THRESHOLD, 1 << 18);
#endif
}

struct memory_used memory_used_now(void) {
    char line[LINE_BYTES];
    struct memory_used used = {0, 0};
    uint64_t kib = 0;
    FILE *file = fopen("/proc/self/status", "re");
    while (file != NULL && fgets(line, sizeof line, file) != NULL) {
        if (sscanf(line, "VmRSS: %" SCNu64, &kib) == 1) {
            used.bytes = kib * KIB;
        } else if (sscanf(line, "VmHWM: %" SCNu64, &kib) == 1) {
            used.peak_bytes = kib * KIB;
        }
    }
    if (file != NULL) {
        fclose(file);
    }
    return used;
}
