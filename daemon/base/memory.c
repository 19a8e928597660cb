// SPDX-License-Identifier: Apache-2.0
#include "daemon/base/memory.h"

#include <inttypes.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/sysinfo.h>

enum { LINE_BYTES = 128, KIB = 1024 };

uint64_t memory_available_as_in(const char *meminfo) {
    char line[LINE_BYTES];
    uint64_t available_kib = 0;
    uint64_t swap_kib = 0;
    uint64_t free_kib = 0;
    bool known = false;
    FILE *file = fopen(meminfo, "re");
    while (file != NULL && fgets(line, sizeof line, file) != NULL) {
        known = sscanf(line, "MemAvailable: %" SCNu64, &available_kib) == 1 || known;
        if (sscanf(line, "SwapFree: %" SCNu64, &free_kib) == 1) {
            swap_kib = free_kib;
        }
    }
    if (file != NULL) {
        fclose(file);
    }
    if (known) {
        return (available_kib + swap_kib) * KIB;
    }
    struct sysinfo all;
    if (sysinfo(&all) != 0) {
        return UINT64_MAX;
    }
    return ((uint64_t)all.freeram + all.bufferram + all.freeswap) * all.mem_unit;
}

uint64_t memory_available_bytes(void) {
    const char *other = getenv("VERGENCE_MEMINFO");
    return memory_available_as_in(other != NULL ? other : "/proc/meminfo");
}

void memory_return_freed(void) {
#ifdef __GLIBC__
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
